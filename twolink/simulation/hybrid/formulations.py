"""The formulations of a mode: those in speeds, not in momenta."""

from types import ModuleType

from twolink import kane, lagrange

FORMULATIONS: dict[str, ModuleType] = {"kane": kane, "lagrange": lagrange}
