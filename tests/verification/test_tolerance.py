"""The tolerance: its parts, and that it is neither too large nor too small."""

import math

import numpy as np
import pytest

from tests.verification.chains import GENERAL
from twolink import lagrange
from twolink.chain import Chain
from twolink.coordinates import JointConvention
from twolink.engines.chain_engine import Sizes
from twolink.verification.states import random_states
from twolink.verification.tolerance import EPSILON, Problem, Scale, tolerance

STATES = random_states(500, seed=3)


def problem(chain, *, joint=False, roundings=20, states=STATES):
    return Problem(chain, Scale.of(chain, joint=joint, gravity=9.81), states, roundings)


@pytest.mark.parametrize("joint", [False, True])
def test_magnitudes_bound_the_quantities(joint):
    """No term is larger than the sum it is part of: the mass matrix and C u, in any pose."""
    scale = Scale.of(GENERAL, joint=joint)
    q = STATES.angles if not joint else np.cumsum(STATES.angles, axis=0)
    u = STATES.speeds if not joint else np.cumsum(STATES.speeds, axis=0)
    (M11, M12), (_, M22) = lagrange.mass_matrix(GENERAL, tuple(q))
    S = np.array([[1, 0], [1, 1]]) if joint else np.eye(2)
    for entries in zip(*np.broadcast_arrays(M11, M12, M22), strict=True):
        M = S.T @ np.array([[entries[0], entries[1]], [entries[1], entries[2]]]) @ S
        assert np.all(np.abs(M) <= scale.mass_matrix * (1 + 1e-12))
    Cu = S.T @ np.array(lagrange.velocity_terms(GENERAL, tuple(q), tuple(u)))
    still = STATES.with_accelerations(np.zeros_like(STATES.accelerations))
    assert np.all(np.abs(Cu) <= scale.inertia_force(still) * (1 + 1e-12))


def test_the_tolerance_grows_with_operations_and_angles():
    few = tolerance("mass matrix", problem(GENERAL, roundings=10))
    many = tolerance("mass matrix", problem(GENERAL, roundings=1000))
    assert np.all(many > few)
    far = random_states(500, seed=3)
    far.angles[...] *= 1e6
    assert np.all(tolerance("mass matrix", problem(GENERAL, states=far)) > 1e4 * few)


def test_conditioning_enters_the_solution():
    """Stretched, with a light first link: the forward dynamics is ill-conditioned there."""
    states = random_states(2, seed=3)
    states.angles[:, 0] = (0.3, 0.3)
    states.angles[:, 1] = (0.3, 0.3 + np.pi / 2)
    light = Chain.point_masses((1e-6, 1.0))
    stretched, bent = tolerance("forward dynamics", problem(light, states=states)).max(axis=0)
    assert stretched > 1e5 * bent


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("offset", [0.0, 1.3, -math.pi / 2])
def test_conditioning_does_not_depend_on_the_convention_of_joint_angles(sign, offset):
    """The chain is ill-conditioned where it is stretched, not where a joint angle is zero."""
    light = Chain.point_masses((1e-6, 1.0))
    joints = JointConvention((1, sign), (0.0, offset))
    states = random_states(2, seed=3)
    for number, q in enumerate(((0.3, 0.3 + 1e-4), (0.3, 0.3 + math.pi / 2))):
        states.angles[:, number] = joints.joint_angles(q)
    posed = Problem(light, Scale.of(light, joint=True, joints=joints), states, roundings=20)
    stretched, bent = tolerance("forward dynamics", posed).max(axis=0)
    assert stretched > 1e5 * bent


def test_the_relative_tolerance_does_not_depend_on_units():
    """In millimetres and grams the relative tolerance is the same: κ₂(M) would not be."""
    k, m = 1000.0, 1000.0
    scaled = Chain(
        tuple(m * x for x in GENERAL.mass),
        tuple(k * x for x in GENERAL.length),
        tuple((k * a, k * b) for a, b in GENERAL.centre),
        tuple(m * k * k * x for x in GENERAL.inertia),
    )
    ours = tolerance("mass matrix", problem(GENERAL))
    assert tolerance("mass matrix", problem(scaled)) == pytest.approx(ours * m * k * k)


def test_the_sizes_of_an_engine_widen_the_tolerance():
    scale = Scale.of(GENERAL, joint=True)
    sizes = Sizes(radius=(9.0, 0.0), length=0.0, inertia=(0.0, 7.0), tip=0.0, origin=3.0)
    wide = scale.widened(sizes)
    assert wide.radius == (9.0, scale.radius[1])
    assert wide.inertia == (scale.inertia[0], 7.0)
    assert (wide.length, wide.tip, wide.origin) == (scale.length, scale.tip, 3.0)


def test_a_bound_that_needs_the_found_value_is_refused_without_it():
    with pytest.raises(ValueError, match="found"):
        tolerance("∂θ̈/∂τ", problem(GENERAL))


def test_the_tolerance_is_some_units_in_the_last_place():
    """Of an ordinary mass matrix it allows some 1e-15 to 1e-14 of its largest entry."""
    share = tolerance("mass matrix", problem(GENERAL)) / np.abs(
        Scale.of(GENERAL, joint=False).mass_matrix[:, :, None]
    )
    assert np.all((share >= 20 * EPSILON) & (share <= 60 * EPSILON))
