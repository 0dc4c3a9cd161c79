"""Names that options and scene files take, in one place; cheap to import.

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

JOINT_PROPERTIES = ("damping", "friction", "limits")
"""Properties of a URDF's joints that are no part of the chain: fields of `PlanarUrdf`, with an
entry for each joint. `twolink.effects.of_urdf` makes effects of them."""
