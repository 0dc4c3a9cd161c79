"""The formulations in which a mode can be written: with speeds, and never with momenta."""

from types import ModuleType

from twolink import kane, lagrange

FORMULATIONS: dict[str, ModuleType] = {"kane": kane, "lagrange": lagrange}
