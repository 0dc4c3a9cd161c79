"""Evaluation: forward dynamics at one state, where proportions, poses or sizes are extreme."""

from __future__ import annotations

import math
from typing import Any

from twolink.chain import Chain
from twolink.hardcases.in_state import InState, Numbers
from twolink.hardcases.record import Case

_EXPECTED = "du of M du + C u = Q, and u and dp/dt of the momenta, each to its last digits"
_REFERENCE = "the equations of motion in 100-digit decimal arithmetic, in the run"
_BOUND = (
    "N ε (|M⁻¹| R + |du|), N the depth of the compiled text: det M is a sum of positive terms, "
    "right to N ε and to the rounding of the elbow's angle; a peer's is 500 ε by the condition "
    "of Bauer and Skeel, |M⁻¹| (R + M̄ |du|), in whichever angles it computes"
)

_GENERAL = (0.3, -0.4)
_BAR = 1 / 12


def _links(
    mass: Numbers = (1.0, 1.0),
    length: Numbers = (1.0, 1.0),
    *,
    along: Numbers = (0.5, 0.5),
    across: Numbers = (0.0, 0.0),
    share: float = _BAR,
) -> Chain:
    """Return links whose centres and inertias are shares of their lengths and of m L²."""
    (m1, m2), (L1, L2) = mass, length
    return Chain(
        mass,
        length,
        ((along[0] * L1, across[0] * L1), (along[1] * L2, across[1] * L2)),
        (share * m1 * L1 * L1, share * m2 * L2 * L2),
    )


_AT_THE_ENDS: dict[str, Any] = {"along": (1.0, 1.0), "share": 0.0}

# A torque at A alone, and a momentum of link 1 alone: what is found is a column of M⁻¹, as well
# known as det M is.
_A_COLUMN: dict[str, Any] = {"u": (0.0, 0.0), "g": 0.0, "torque": (0.3, 0.0), "p": (1.0, 0.0)}


_HEAVY_TIP = _links((1.0, 1e9), along=(0.5, 1.0), share=1e-20)


def _case(name: str, hard: str, trial: InState) -> Case:
    return Case(name, "evaluation", hard, _EXPECTED, _REFERENCE, _BOUND, trial, seconds=20.0)


CASES = (
    _case(
        "heavy-second-link",
        "link 2 is 1e12 times as heavy, nearly aligned: det M is 1e-12 of its two products",
        InState(_links((1.0, 1e12), along=(0.5, 1.0), share=0.0), (0.3, 0.3 + 1e-7)),
    ),
    _case(
        "light-second-link",
        "link 2 weighs 1e-12 of link 1, and its acceleration is all its own",
        InState(_links((1.0, 1e-12)), _GENERAL, torque=(0.3, -1e-13)),
    ),
    _case(
        "long-second-link",
        "link 2 is 1e9 times as long: M has entries of 1 and of 1e18",
        InState(_links(length=(1.0, 1e9)), _GENERAL),
    ),
    _case(
        "short-second-link",
        "link 2 is 1e-9 times as long: in joint angles M22 is lost beside M11",
        InState(_links(length=(1.0, 1e-9)), _GENERAL, torque=(0.3, -1e-10)),
    ),
    _case(
        "massless-second-link",
        "link 2 weighs 1e-30 kg and drags nothing, yet falls as it must",
        InState(_links((1.0, 1e-30)), _GENERAL, torque=(0.3, -1e-31)),
    ),
    _case(
        "point-masses",
        "no central inertia at all: what simulators refuse as not physical is a textbook's chain",
        InState(_links(**_AT_THE_ENDS), _GENERAL),
    ),
    _case(
        "point-masses-heavy-tip-aligned",
        "point masses of 1 and 1e12 kg in line: det M = m1 m2 is what 1e24 − 1e24 leaves",
        InState(_links((1.0, 1e12), **_AT_THE_ENDS), (0.7, 0.7), **_A_COLUMN),
    ),
    _case(
        "point-masses-heavy-tip-folded",
        "the same folded, as nearly as π is a float64",
        InState(_links((1.0, 1e12), **_AT_THE_ENDS), (0.7, 0.7 - math.pi), **_A_COLUMN),
    ),
    _case("aligned", "δ = q2 − q1 = 0: the coupling is largest", InState(_links(), (0.9, 0.9))),
    _case("folded", "δ = π, as nearly as float64 has it", InState(_links(), (0.9, 0.9 - math.pi))),
    _case(
        "nearly-aligned",
        "δ = 1e-8: its square is lost beside 1, and its sine is not",
        InState(_HEAVY_TIP, (0.9, 0.9 + 1e-8), **_A_COLUMN),
    ),
    _case(
        "nearly-folded",
        "δ = π − 1e-8",
        InState(_HEAVY_TIP, (0.9, 0.9 + math.pi - 1e-8), **_A_COLUMN),
    ),
    _case(
        "angles-of-1e8",
        "both angles are 1e8 rad: turns count, and a reduction by float64's π loses eight digits",
        InState(_links(), (1e8, 1e8 + 0.75)),
    ),
    _case(
        "speeds-of-1e6",
        "speeds of 1e6 rad/s: gravity is 1e-11 of the centrifugal terms",
        InState(_links(), _GENERAL, u=(1e6, -9e5)),
    ),
    _case(
        "denormal-state",
        "angles and speeds below the smallest normal number: products underflow, nothing divides",
        InState(_links(), (5e-324, -1e-310), u=(2e-310, -5e-324), torque=(1e-308, 0.0)),
    ),
    _case(
        "tiny-chain",
        "1e-100 kg and 1e-20 m: det M is 1e-280, near the end of float64's range",
        InState(_links((1e-100, 2e-100), (1e-20, 1e-20)), _GENERAL, torque=(0.0, 0.0)),
    ),
    _case(
        "huge-chain",
        "1e100 kg and 1e20 m: det M is 1e280, near the other end",
        InState(_links((1e100, 2e100), (1e20, 1e20)), _GENERAL, torque=(0.0, 0.0)),
    ),
    _case(
        "centre-off-the-axis",
        "both mass centres stand off their links' axes, so δ = 0 is no special pose of M",
        InState(_links(along=(0.5, 0.4), across=(-0.3, 0.6)), (0.3, 0.3)),
    ),
    _case(
        "centre-beyond-the-end",
        "the mass centres lie behind the pivot and beyond the end of their links",
        InState(_links(along=(-1.5, 2.5), across=(0.7, -0.2)), _GENERAL),
    ),
    _case(
        "torque-against-weight",
        "torques hold the chain still: du is what two equal and opposite moments leave",
        InState(_links(), (0.0, 0.0), u=(0.0, 0.0), torque=(19.62, 4.905)),
    ),
)
