"""Error bounds of a right engine, derived by `twolink.verification.tolerance`.

    |answer − truth| ≤ N ε S

S is the sum of the sizes of all terms, measured from the origin of the root and with the spatial
sizes of the model, since an engine may compute there; N is `ROUNDINGS` plus the share of the
angles. The bound is proportional to ε, so for another precision it is scaled by its ε.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.chain import Chain
from twolink.conformance.quantities import Quantity
from twolink.conformance.spatial import SpatialModel
from twolink.coordinates import JointConvention
from twolink.engines.chain_engine import Sizes
from twolink.engines.messages import Precision
from twolink.urdf.spatial import norm
from twolink.verification.states import States
from twolink.verification.tolerance import EPSILON, Problem, Scale, tolerance

Array = NDArray[np.float64]

ROUNDINGS = 500
"""Operations on the longest path from a file to an answer, for any engine.

Reading: a rotation by roll, pitch and yaw (16), placed through five fixed frames (12 each) and
applied to an inertia (24), and the parallel-axis theorem (8) make about 110. Recursion over two
joints: 116 in vectors, as counted in `twolink/engines/pinocchio_chain.py`; with products of 6 × 6
matrices (11 operations each, on both sides, inwards and outwards) about 200. That is 310; the rest
is for the kit's own conversions, such as angles to quaternions."""

REASON = (
    f"N ε S with N = {ROUNDINGS} + 2 + 2Θ, ε = 2^-52, Θ the sum of the sizes of the angles and S"
    " the sum of the sizes of all terms; derived in twolink/verification/tolerance.py. For an"
    " engine of another precision it is scaled by its ε."
)

EPSILONS: Mapping[Precision, float] = {
    "binary32": 2.0**-23,
    "binary64": EPSILON,
    "extended": EPSILON,
}
"""ε of each precision; extended answers arrive as binary64 numbers."""


def bound(
    quantity: Quantity,
    model: SpatialModel,
    chain: Chain,
    convention: JointConvention,
    gravity: float,
    states: Mapping[str, Array],
    truth: Array,
) -> Array:
    """Return the bound of each entry of an answer at ε = 2⁻⁵², in the shape of the truth.

    `model` is the spatial model in float64, `chain` its planar reduction with its joint convention
    and gravity (m/s²); `states` has fields of shape (n, 2), `truth` has shape (n, …).
    """
    scale = Scale.of(chain, joint=True, gravity=gravity, joints=convention)
    scale = replace(scale.widened(sizes_of(model)), from_world=True)
    nothing = np.zeros((2, len(truth)))
    given = {name: np.asarray(rows, dtype=float).T for name, rows in states.items()}
    if quantity.name == "forward_dynamics":
        given["accelerations"] = truth.T
        resistance = np.abs(given["speeds"].T) * np.array(model.damping) + np.array(model.friction)
        given["torques"] = np.abs(given["torques"]) + resistance.T
    fields = ("angles", "speeds", "accelerations", "torques", "end_force")
    problem = Problem(
        chain, scale, States(**{name: given.get(name, nothing) for name in fields}), ROUNDINGS
    )
    found = np.moveaxis(np.atleast_1d(tolerance(quantity.bound, problem)), -1, 0)
    # A potential is compared with that of the first state, whose error it includes.
    found = (2.0 if quantity.up_to_constant else 1.0) * found
    if found.ndim < truth.ndim:
        found = found.reshape(found.shape + (1,) * (truth.ndim - found.ndim))
    return np.array(np.broadcast_to(found, truth.shape))


def sizes_of(model: SpatialModel) -> Sizes:
    """Return the sizes of the model's numbers, with the ways through all frames."""
    links = [[body for body in model.bodies if body.link == link and body.mass] for link in (1, 2)]
    radius = [max(body.path for body in bodies) for bodies in links]
    inertia = [
        sum(_size(body.tensor) for body in bodies) + model.armature[link]
        for link, bodies in enumerate(links)
    ]
    return Sizes(
        radius=(radius[0], radius[1]),
        length=model.joints[1].path,
        inertia=(inertia[0], inertia[1]),
        tip=model.tip_path,
        origin=max(norm(model.origin), model.joints[0].path),
    )


def _size(tensor: Any) -> float:
    return float(np.linalg.norm(np.array(tensor, dtype=float)))
