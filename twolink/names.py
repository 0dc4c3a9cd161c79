"""The names of formulations that options take, in one place; cheap to import.

`twolink.formulations` and `twolink.simulation.smooth.equations` have what they name.
"""

from __future__ import annotations

from typing import Literal, get_args

FormulationName = Literal["kane", "lagrange"]
FORMULATION_NAMES: tuple[FormulationName, ...] = get_args(FormulationName)

# Momenta are other variables of Lagrange's equations, for simulation.
EquationsName = Literal["momenta"] | FormulationName
EQUATIONS_NAMES: tuple[EquationsName, ...] = ("momenta", *reversed(FORMULATION_NAMES))
"""The first is the default, as it has the lowest measured cost (benchmarks/simulation.py)."""
