"""Contacts between which a chain may be gripped, against linear programs and by hand."""

import math

import numpy as np
import pytest
from scipy.optimize import linprog

from tests.simulation.hybrid import BARS, state_of, system_of
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.grip import is_gripped
from twolink.simulation.hybrid.select import select

ABOVE, BELOW = (0.0, -1.0), (0.0, 1.0)


def at_rest(*effects, q):
    """Return a chain at rest on all of its contacts."""
    system = system_of(*effects, chain=BARS)
    touching = frozenset(i for i, e in enumerate(system.elements) if e.normal is not None)
    state = state_of(system, q)._replace(touching=touching)
    return system, state, system.pose(state.q)


def slot(friction, height, *more):
    """Return the effects of a slot without play for D, whose upper side is rough."""
    place = (0.0, height)
    return *more, Surface(place, ABOVE, friction=friction), Surface(place, BELOW)


Q = 0.3, 0.9
HEIGHT = math.sin(Q[0]) + math.sin(Q[1])


@pytest.mark.parametrize(("friction", "gripped"), [(0.5, True), (1e-3, True), (0.0, False)])
def test_a_point_in_a_slot_is_gripped_if_a_side_is_rough(friction, gripped):
    assert is_gripped(*at_rest(*slot(friction, HEIGHT), q=Q)) is gripped


def test_one_side_grips_only_with_a_stop_against_it():
    rough = Surface((0.0, HEIGHT), ABOVE, friction=2.0)
    lower, upper = JointStop("A", lower=Q[0]), JointStop("A", upper=Q[0])
    assert not is_gripped(*at_rest(rough, q=Q))
    assert not is_gripped(*at_rest(lower, upper, q=Q))
    assert is_gripped(*at_rest(rough, lower, q=Q))
    assert not is_gripped(*at_rest(rough, upper, q=Q))


@pytest.mark.parametrize("seed", range(60))
def test_contacts_grip_a_chain_if_every_load_has_an_answer(seed):
    """Against linear programs for loads all around."""
    random = np.random.default_rng([seed, 20])
    q = tuple(random.uniform(-3, 3, 2).tolist())
    effects = []
    for number in range(int(random.integers(2, 4))):
        angle = float(random.uniform(-math.pi, math.pi))
        on = str(random.choice(["B", "C1", "C2", "D"]))
        point = {"B": (1, 0), "C1": (0.5, 0), "C2": (1, 0.5), "D": (1, 1)}[on]
        x, y = (sum(L * f(a) for L, a in zip(point, q, strict=True)) for f in (math.cos, math.sin))
        friction = float(random.choice([0.0, random.uniform(0.1, 2)]))
        normal = math.cos(angle), math.sin(angle)
        effects.append(Surface((x, y), normal, (on,), friction=friction, name=f"s{number}"))
    system, state, pose = at_rest(*effects, q=q)
    cones = []
    for element in system.elements:
        row = np.array(pose.row(element.normal), float)
        limit = float(element.limits(1)[1])
        along = np.zeros(2) if element.tangent is None else np.array(pose.row(element.tangent))
        cones += [row + limit * along, row - limit * along]
    loads = [(math.cos(a), math.sin(a)) for a in np.linspace(0, 2 * math.pi, 25)[:-1]]
    found = [linprog(np.ones(len(cones)), A_eq=np.array(cones).T, b_eq=b).status for b in loads]
    assert is_gripped(system, state, pose) == all(status == 0 for status in found)


def test_a_chain_that_leaves_its_rest_in_a_slot_is_noted():
    """D's friction of 0.1 gives way to a torque, but not if the sides pressed on it."""
    push = JointTorque((0.0, 20.0))
    system, state, pose = at_rest(*slot(0.1, HEIGHT, Gravity(), push), q=Q)
    found = select(system, state, pose, {})
    names = [str(system.mode(states)) for states in found.others]
    assert str(system.mode(found.states)).startswith("D on surface slips")
    assert names == ["D on surface sticks, D on surface 2 rests"]


def test_a_chain_that_rests_or_slides_in_a_slot_is_not_noted():
    held = Scene(BARS, Q, (0.0, 0.0), 0.2, slot(0.1, HEIGHT, Gravity(), JointFriction((30.0, 9.0))))
    assert simulate(held).notes == ()
    rows = np.array([[math.cos(a) for a in Q]])
    along = (float(rows[0, 1]), -float(rows[0, 0]))
    slides = Scene(BARS, Q, along, 0.05, slot(0.1, HEIGHT, Gravity()))
    assert simulate(slides).notes == ()
