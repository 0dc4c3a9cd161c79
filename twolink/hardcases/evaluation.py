"""Hard cases of evaluation: forward dynamics with extreme proportions, poses or sizes."""

from __future__ import annotations

import math
from typing import Any

from twolink.chain import Chain
from twolink.hardcases.record import Case
from twolink.hardcases.state_trial import Numbers, StateTrial

_EXPECTED = "du of M du + C u = Q, and u and dp/dt of the momenta, each to its last digits"
_REFERENCE = "the equations of motion in 100-digit decimal arithmetic, computed in the run"
_BOUND = (
    "N ε (|M⁻¹| R + |du|), N the depth of the compiled expression: det M is a sum of positive "
    "terms, accurate to N ε and to the rounding of the elbow's angle; for an external engine it is "
    "500 ε by the condition of Bauer and Skeel, |M⁻¹| (R + M̄ |du|), in the angles it uses"
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
    """Return links with centres and inertias given as fractions of their lengths and of m L²."""
    (m1, m2), (L1, L2) = mass, length
    return Chain(
        mass,
        length,
        ((along[0] * L1, across[0] * L1), (along[1] * L2, across[1] * L2)),
        (share * m1 * L1 * L1, share * m2 * L2 * L2),
    )


_AT_THE_ENDS: dict[str, Any] = {"along": (1.0, 1.0), "share": 0.0}

# A torque only at A, and a momentum only of link 1: the result is a column of M⁻¹, as accurate as
# det M.
_A_COLUMN: dict[str, Any] = {"u": (0.0, 0.0), "g": 0.0, "torque": (0.3, 0.0), "p": (1.0, 0.0)}


_HEAVY_TIP = _links((1.0, 1e9), along=(0.5, 1.0), share=1e-20)


def _case(name: str, hard: str, trial: StateTrial) -> Case:
    return Case(name, "evaluation", hard, _EXPECTED, _REFERENCE, _BOUND, trial, seconds=20.0)


CASES = (
    _case(
        "heavy-second-link",
        "link 2 is 1e12 times as heavy, nearly aligned: det M is 1e-12 of its two products",
        StateTrial(_links((1.0, 1e12), along=(0.5, 1.0), share=0.0), (0.3, 0.3 + 1e-7)),
    ),
    _case(
        "light-second-link",
        "link 2 weighs 1e-12 of link 1 and does not affect it",
        StateTrial(_links((1.0, 1e-12)), _GENERAL, torque=(0.3, -1e-13)),
    ),
    _case(
        "long-second-link",
        "link 2 is 1e9 times as long: M has entries of 1 and of 1e18",
        StateTrial(_links(length=(1.0, 1e9)), _GENERAL),
    ),
    _case(
        "short-second-link",
        "link 2 is 1e-9 times as long: in joint angles M22 is lost beside M11",
        StateTrial(_links(length=(1.0, 1e-9)), _GENERAL, torque=(0.3, -1e-10)),
    ),
    _case(
        "massless-second-link",
        "link 2 weighs 1e-30 kg: it exerts no load, yet its own fall must be correct",
        StateTrial(_links((1.0, 1e-30)), _GENERAL, torque=(0.3, -1e-31)),
    ),
    _case(
        "point-masses",
        "zero central inertia: rejected by simulators as unphysical, common in textbooks",
        StateTrial(_links(**_AT_THE_ENDS), _GENERAL),
    ),
    _case(
        "point-masses-heavy-tip-aligned",
        "point masses of 1 and 1e12 kg in line: det M = m1 m2 is the difference of two 1e24",
        StateTrial(_links((1.0, 1e12), **_AT_THE_ENDS), (0.7, 0.7), **_A_COLUMN),
    ),
    _case(
        "point-masses-heavy-tip-folded",
        "the same, folded, with the float64 nearest to π",
        StateTrial(_links((1.0, 1e12), **_AT_THE_ENDS), (0.7, 0.7 - math.pi), **_A_COLUMN),
    ),
    _case("aligned", "δ = q2 − q1 = 0: the coupling is largest", StateTrial(_links(), (0.9, 0.9))),
    _case("folded", "δ = π, to the nearest float64", StateTrial(_links(), (0.9, 0.9 - math.pi))),
    _case(
        "nearly-aligned",
        "δ = 1e-8: its square is lost beside 1, its sine is not",
        StateTrial(_HEAVY_TIP, (0.9, 0.9 + 1e-8), **_A_COLUMN),
    ),
    _case(
        "nearly-folded",
        "δ = π − 1e-8",
        StateTrial(_HEAVY_TIP, (0.9, 0.9 + math.pi - 1e-8), **_A_COLUMN),
    ),
    _case(
        "angles-of-1e8",
        "both angles are 1e8 rad: argument reduction with float64's π loses eight digits",
        StateTrial(_links(), (1e8, 1e8 + 0.75)),
    ),
    _case(
        "speeds-of-1e6",
        "speeds of 1e6 rad/s: gravity is 1e-11 of the centrifugal terms",
        StateTrial(_links(), _GENERAL, u=(1e6, -9e5)),
    ),
    _case(
        "denormal-state",
        "angles and speeds below the smallest normal number: products underflow",
        StateTrial(_links(), (5e-324, -1e-310), u=(2e-310, -5e-324), torque=(1e-308, 0.0)),
    ),
    _case(
        "tiny-chain",
        "1e-100 kg and 1e-20 m: det M is 1e-280, near the end of float64's range",
        StateTrial(_links((1e-100, 2e-100), (1e-20, 1e-20)), _GENERAL, torque=(0.0, 0.0)),
    ),
    _case(
        "huge-chain",
        "1e100 kg and 1e20 m: det M is 1e280, near the upper end of float64's range",
        StateTrial(_links((1e100, 2e100), (1e20, 1e20)), _GENERAL, torque=(0.0, 0.0)),
    ),
    _case(
        "centre-off-the-axis",
        "both mass centres are off their links' axes, so δ = 0 is not a special pose of M",
        StateTrial(_links(along=(0.5, 0.4), across=(-0.3, 0.6)), (0.3, 0.3)),
    ),
    _case(
        "centre-beyond-the-end",
        "the mass centres are behind the pivot and beyond the end of their links",
        StateTrial(_links(along=(-1.5, 2.5), across=(0.7, -0.2)), _GENERAL),
    ),
    _case(
        "torque-against-weight",
        "torques balance gravity: du is the difference of two nearly equal moments",
        StateTrial(_links(), (0.0, 0.0), u=(0.0, 0.0), torque=(19.62, 4.905)),
    ),
)
