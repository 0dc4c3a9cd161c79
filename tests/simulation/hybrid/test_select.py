"""Mode selection: scenes of which the right mode is known from statics by hand or by NumPy."""

import math

import numpy as np
import pytest

from tests.simulation.hybrid import BALANCED, BARS, state_of, system_of
from twolink.chain import Chain
from twolink.contact.states import ContactState as S
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.simulation.hybrid.confirm import Derivatives
from twolink.simulation.hybrid.dynamics import mode_solution
from twolink.simulation.hybrid.painleve import jammed
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.select import select


def selected(system, state, known=None):
    return select(system, state, Pose(system.chain, system.formulation, state.q), known or {})


def states_of(*effects, q=(0.0, 0.0), u=(0.0, 0.0), **more):
    system = system_of(*effects, **more)
    return selected(system, state_of(system, q, u)).states


def forces_in(system, state, states):
    pose = Pose(system.chain, system.formulation, state.q)
    dents = [None] * len(states)
    return mode_solution(
        pose, system.effects, system.elements, states, dents, state.u, state.t
    ).forces


@pytest.mark.parametrize(
    ("torque", "static", "expected"),
    [
        ((0.9, 0.9), (1.0, 1.0), (S.STICKS, S.STICKS)),
        # B alone slides, and gives its kinetic 0.5 N m to A, which with 0.9 N m at B is held.
        ((0.0, 1.1), (1.0, 1.0), (S.STICKS, S.FORWARD)),
        ((0.0, -1.1), (1.0, 1.0), (S.STICKS, S.BACKWARD)),
        # A alone begins to move. B needs the torque to turn link 2 along: 0.5 kg m² of 3.5 kg m².
        ((2.0, 0.0), (1.0, 1.0), (S.FORWARD, S.STICKS)),
        ((-2.0, 0.0), (1.0, 1.0), (S.BACKWARD, S.STICKS)),
        # 30 N m on 3.5 kg m² would need (30 − 0.5)/3.5 · 0.5 = 4.2 N m at B.
        ((30.0, 0.0), (1.0, 1.0), (S.FORWARD, S.BACKWARD)),
        ((30.0, 0.0), (1.0, 4.5), (S.FORWARD, S.STICKS)),
    ],
)
def test_joints_stick_or_slide_as_statics_say(torque, static, expected):
    friction = JointFriction((0.5, 0.5), static)
    assert states_of(JointTorque(torque), friction, chain=BALANCED) == expected


@pytest.mark.parametrize(("at_A", "expected"), [(0.9, S.STICKS), (0.7, S.FORWARD)])
def test_a_slipping_joint_loads_the_one_that_sticks(at_A, expected):
    """B slides forward with 0.8 N m against it, which act on link 1 the other way."""
    friction = JointFriction((0.1, 0.8), (at_A, 0.8))
    assert states_of(friction, u=(0.0, 1.0), chain=BALANCED) == (expected, S.FORWARD)


def test_the_joint_whose_limit_is_exceeded_breaks_loose_and_the_other_sticks():
    """5.50 N m at A, which holds 4; 1.37 N m at B, which holds 5.

    Once A slides both bars turn as one: (5.50 − 1) N m on 8/3 kg m². That needs at B
    5/6 · 1.69 − 1.37 = 0.04 N m, so B goes on sticking.
    """
    q = (1.2867, 1.2867)
    demanded = 9.81 * 2 * math.cos(q[0]), 9.81 * 0.5 * math.cos(q[1])
    assert demanded == pytest.approx((5.50, 1.37), abs=0.01)
    friction = JointFriction((1.0, 1.0), (4.0, 5.0))
    system = system_of(Gravity(9.81), friction)
    state = state_of(system, q)
    selection = selected(system, state)
    assert selection.states == (S.FORWARD, S.STICKS)
    at_B = 5 / 6 * (demanded[0] - 1) / (8 / 3) - demanded[1]
    forces = forces_in(system, state, selection.states)
    assert forces[1].tangential == pytest.approx(at_B, rel=1e-9)
    assert abs(at_B) < 5


@pytest.mark.parametrize("q", [(1.2867, 1.2867), (0.4, 1.4), (-2.0, 0.3), (2.8, -1.0)])
@pytest.mark.parametrize("static", [(4.0, 5.0), (20.0, 1.0), (8.0, 3.0), (40.0, 40.0)])
def test_every_selection_of_joint_friction_obeys_its_laws(q, static):
    """Torques within the limits where joints stick; against the motion where they begin to."""
    system = system_of(Gravity(9.81), JointFriction((1.0, 0.5), static))
    state = state_of(system, q)
    states = selected(system, state).states
    pose = Pose(system.chain, system.formulation, q)
    solution = mode_solution(pose, system.effects, system.elements, states, [None] * 2, (0, 0), 0)
    joints = solution.du[0], solution.du[1] - solution.du[0]
    for own, limit, force, acceleration in zip(
        states, static, solution.forces, joints, strict=True
    ):
        if own is S.STICKS:
            assert abs(force.tangential) <= limit
            assert acceleration == pytest.approx(0, abs=1e-12)
        else:
            assert own.direction * acceleration > 0
    held = 9.81 * (1.5 * math.cos(q[0]) + 0.5 * math.cos(q[1])), 9.81 * 0.5 * math.cos(q[1])
    both_hold = all(abs(torque) < limit for torque, limit in zip(held, static, strict=True))
    assert (states == (S.STICKS, S.STICKS)) == both_hold


@pytest.mark.parametrize("at_B", [math.nextafter(0.75, 0), 0.75, math.nextafter(0.75, 1), 0.7501])
def test_either_of_two_joints_may_break_loose_if_both_limits_are_exceeded(at_B):
    """Each can hold while the other slides. The limits are exceeded by one factor at 0.75 N m."""
    friction, torque = JointFriction((2.0, 0.5), (2.5, 0.625)), JointTorque((3.0, at_B))
    system = system_of(friction, torque, chain=BARS)
    found = selected(system, state_of(system, (0.0, 0.25)))
    modes = (S.FORWARD, S.STICKS), (S.STICKS, S.FORWARD)
    first, other = modes if at_B < 0.75005 else modes[::-1]
    assert found.states == first
    assert found.others == (other,)


def test_a_moving_joint_keeps_its_direction():
    friction = JointFriction((1.0, 1.0), (50.0, 50.0))
    assert states_of(friction, u=(1.0, 1.0)) == (S.FORWARD, S.STICKS)
    assert states_of(friction, u=(-1.0, 1.0)) == (S.BACKWARD, S.FORWARD)


def floor_under(q, **more):
    """Return a floor on which D rests."""
    return Surface((0.0, math.sin(q[0]) + math.sin(q[1])), (0.0, -1.0), name="floor", **more)


POSE = (0.3, 1.2)


@pytest.mark.parametrize(("down", "expected"), [(1.0, S.CLOSED), (-1.0, S.OPEN)])
def test_a_contact_closes_under_a_weight_and_opens_above_it(down, expected):
    gravity = Gravity(9.81, (0.0, down))
    assert states_of(gravity, floor_under(POSE), q=POSE) == (expected,)


def test_a_contact_that_is_not_touched_is_open():
    surface = Surface((0.0, 5.0), (0.0, -1.0))
    assert states_of(Gravity(), surface, q=POSE) == (S.OPEN,)


def needed(q):
    """Return N and T that hold two uniform bars in a pose by their end, with NumPy."""
    rows = np.array([-np.cos(q), -np.sin(q)])
    weight = 9.81 * np.array([1.5, 0.5]) * np.cos(q)
    return np.linalg.solve(rows.T, -weight)


@pytest.mark.parametrize("q", [POSE, (0.8, 1.9), (1.0, 0.2)])
@pytest.mark.parametrize(("share", "sticks"), [(1.01, True), (0.99, False)])
def test_a_point_sticks_inside_coulombs_cone_and_slides_outside(q, share, sticks):
    N, T = needed(q)
    assert N > 0
    mu = share * abs(T) / N
    (own,) = states_of(Gravity(9.81), floor_under(q, friction=mu), q=q)
    expected = S.STICKS if sticks else (S.FORWARD if T < 0 else S.BACKWARD)
    assert own is expected


def test_contacts_at_the_ends_of_both_links_share_the_weight():
    """Both bars lie on the floor: it carries B with 1 kg and D with 1/2 kg."""
    system = system_of(Gravity(9.81), Surface((0.0, 0.0), (0.0, -1.0), on=("B", "D")))
    state = state_of(system, (0.0, 0.0))
    states = selected(system, state).states
    assert states == (S.CLOSED, S.CLOSED)
    forces = forces_in(system, state, states)
    assert [f.normal for f in forces] == pytest.approx([9.81, 9.81 / 2])


@pytest.mark.parametrize(
    ("torque", "friction", "stop"), [(-5.0, 3.0, 2.0), (-2.0, 2.0, 0.0), (4.0, -4.0, 0.0)]
)
def test_friction_in_a_joint_holds_first_and_its_stop_the_rest(torque, friction, stop):
    """A static limit of 3 N m (5 N m the other way) beside a stop at the lower end."""
    static = 3.0 if torque < 0 else 5.0
    system = system_of(
        JointTorque((torque, 0.0)),
        JointFriction((1.0, 0.0), (static, 0.0)),
        JointStop("A", lower=0.0),
        chain=BALANCED,
    )
    state = state_of(system, (0.0, 0.0))
    selection = selected(system, state)
    of_joint, of_stop = forces_in(system, state, selection.states)
    assert of_joint.tangential == pytest.approx(friction)
    assert of_stop.normal == pytest.approx(stop, abs=1e-14)
    if stop:
        assert selection.states == (S.PRESSED_BACKWARD, S.CLOSED)
    assert not selection.others


def test_a_joint_held_by_a_stop_breaks_away_from_it():
    """6 N m away from the stop against 3 N m of friction."""
    states = states_of(
        JointTorque((6.0, 0.0)),
        JointFriction((1.0, 0.0), (3.0, 0.0)),
        JointStop("A", lower=0.0),
        chain=BALANCED,
    )
    assert states == (S.FORWARD, S.OPEN)


def painleve(down, mu=2.0, direction=-1):
    """Return a system and the state in which D slides on its floor."""
    q = (1.1, 1.3)
    system = system_of(Gravity(9.81, (0.0, down)), floor_under(q, friction=mu))
    rows = np.array([-np.cos(q), -np.sin(q)])
    u = np.linalg.solve(rows, [0.0, 0.01 * direction])
    state = state_of(system, q)._replace(
        u=tuple(map(float, u)), touching=frozenset({0}), sliding=(direction,)
    )
    c = math.cos(q[1] - q[0])
    M = np.array([[4 / 3, c / 2], [c / 2, 1 / 3]])
    force = rows[0] - direction * mu * rows[1]
    response = rows[0] @ np.linalg.solve(M, force)
    free = rows[0] @ np.linalg.solve(M, 9.81 * down * np.array([1.5, 0.5]) * np.cos(q))
    return system, state, response, free


def locking_direction():
    return next(d for d in (1, -1) if painleve(1.0, direction=d)[2] < 0)


def test_a_locked_slide_under_a_weight_has_no_mode():
    """N = −a/G: with a < 0 and G < 0 no push holds the point, and no opening lets it go."""
    system, state, response, free = painleve(1.0, direction=locking_direction())
    assert response < 0
    assert free < 0
    assert selected(system, state) is None
    pose = Pose(system.chain, system.formulation, state.q)
    assert list(jammed(system, state, pose)) == [0]


def test_a_locked_slide_that_is_pulled_off_has_two_modes_and_opens_or_slides():
    """With a > 0 and G < 0 both a push of −a/G and none obey the laws."""
    system, state, response, free = painleve(-1.0, direction=locking_direction())
    assert response < 0 < free
    selection = selected(system, state)
    slides = S.FORWARD if state.sliding[0] > 0 else S.BACKWARD
    assert {selection.states, *selection.others} == {(slides,), (S.OPEN,)}
    # The mode with the fewest contacts that open is taken.
    assert selection.states == (slides,)


def test_a_jammed_contact_has_no_mode_where_the_derivatives_contradict_all(monkeypatch):
    """Elsewhere a contradiction is rounding: a mode is taken, and it is not confirmed."""
    monkeypatch.setattr(Derivatives, "confirmed", lambda self, candidate: None)
    system, state, response, _ = painleve(-1.0, direction=locking_direction())
    assert response < 0
    assert selected(system, state) is None
    system, state, response, _ = painleve(-1.0, direction=-locking_direction())
    assert response > 0
    assert not selected(system, state).confirmed


def test_a_slide_that_answers_its_push_has_one_mode():
    for down in (1.0, -1.0):
        system, state, response, free = painleve(down, direction=-locking_direction())
        assert response > 0
        selection = selected(system, state)
        assert (selection.states == (S.OPEN,)) == (free > 0)
        assert selection.others == ()
        pose = Pose(system.chain, system.formulation, state.q)
        assert list(jammed(system, state, pose)) == []


def test_a_restricted_element_takes_no_other_state():
    system = system_of(JointTorque((0.0, 0.2)), JointFriction((0.5, 0.5)), chain=BALANCED)
    state = state_of(system, (0.0, 0.0))
    assert selected(system, state).states == (S.STICKS, S.STICKS)
    restricted = {1: (S.FORWARD,)}
    assert selected(system, state, restricted).states[1] is S.FORWARD


@pytest.mark.parametrize("precision", ["long double", "quadruple"])
def test_the_modes_are_the_same_in_every_precision(precision):
    system = system_of(
        Gravity(9.81), JointFriction((1.0, 1.0), (4.0, 5.0)), chain=BARS, precision=precision
    )
    state = state_of(system, (1.2867, 1.2867))
    assert selected(system, state).states == (S.FORWARD, S.STICKS)


def drawn_scene(random):
    """Return a system and a state at rest, with friction, a floor and a stop, some left out."""
    q = tuple(random.uniform(-1.4, 1.4, 2))
    effects = [Gravity(9.81), JointTorque(tuple(8 * random.normal(size=2)))]
    if random.random() < 0.7:
        kinetic = random.uniform(0, 3, 2)
        effects.append(
            JointFriction(tuple(kinetic), tuple(kinetic * random.choice([1, 1.5], size=2)))
        )
    if random.random() < 0.7:
        mu = random.choice([0.0, 0.3, 0.9])
        effects.append(floor_under(q, friction=mu, static=1.4 * mu))
    if random.random() < 0.5:
        effects.append(JointStop("A", lower=q[0]))
    system = system_of(*effects)
    return system, state_of(system, q)


def assert_obeyed(element, own, force, normal, tangential):
    """Assert the laws of one element, of which the accelerations along n and t are given."""
    if element.normal is not None:
        if own is S.OPEN:
            assert normal > -1e-9
            return
        assert force.normal > -1e-9
        assert abs(normal) < 1e-9
    if element.tangent is None:
        return
    if own is S.STICKS:
        assert abs(force.tangential) <= element.limits(force.normal)[1] + 1e-8
    if own.slips:
        assert own.direction * tangential > -1e-9
    else:
        assert abs(tangential) < 1e-9


@pytest.mark.slow
def test_drawn_scenes_of_several_elements_obey_all_laws(random):
    """From rest, so accelerations along coordinates are rows times du."""
    for _ in range(300):
        system, state = drawn_scene(random)
        states = selected(system, state).states
        pose = Pose(system.chain, system.formulation, state.q)
        solution = mode_solution(
            pose, system.effects, system.elements, states, [None] * len(states), state.u, state.t
        )
        for element, own, force in zip(system.elements, states, solution.forces, strict=True):
            along = [
                0.0 if coordinate is None else np.dot(pose.row(coordinate), solution.du)
                for coordinate in (element.normal, element.tangent)
            ]
            assert_obeyed(element, own, force, *along)


@pytest.mark.parametrize(
    ("q", "kinetic", "static", "torque", "expected"),
    [
        ((0.0, 0.0), (0.8, 0.9), (1.0, 1.6), (-1.3, -2.2), (S.FORWARD, S.BACKWARD)),
        ((3.0, 3.0), (0.4, 0.5), (0.8, 1.2), (1.5, 1.6), (S.BACKWARD, S.FORWARD)),
    ],
)
def test_both_joints_break_loose_where_neither_can_hold_while_the_other_slides(
    q, kinetic, static, torque, expected
):
    """Held, both exceed their limits. If B alone slides, A cannot be held; nor B, if A alone does.

    If both slide, B drives A against the torque at A.
    """
    system = system_of(JointTorque(torque), JointFriction(kinetic, static))
    state = state_of(system, q)
    found = selected(system, state)
    assert found.states == expected
    assert not found.others
    alone = S.FORWARD if expected[0] is S.BACKWARD else S.BACKWARD
    for states in ((S.STICKS, S.STICKS), (S.STICKS, expected[1]), (alone, S.STICKS)):
        forces = forces_in(system, state, states)
        assert any(
            abs(force.tangential) > limit
            for force, limit, own in zip(forces, static, states, strict=True)
            if own is S.STICKS
        )
    (M11, M12), (_, M22) = system.formulation.mass_matrix(system.chain, q)
    senses = np.array([s.direction for s in expected])
    at_A, at_B = torque - senses * kinetic
    du = np.linalg.solve([[M11, M12], [M12, M22]], [at_A - at_B, at_B])
    assert senses[0] * du[0] > 0
    assert senses[1] * (du[1] - du[0]) > 0


@pytest.mark.parametrize(("friction", "wedged"), [(0.1, True), (0.04, False)])
def test_a_link_that_its_weight_would_lift_off_is_wedged_and_may_leave(friction, wedged):
    """B moves along a wall, away from it by 0.05: friction above tan 0.05 wedges link 1.

    Its weight would open the contact, so the laws admit rest and departure.
    """
    wall = Surface(
        (1.0, 0.0), (-math.cos(0.05), math.sin(0.05)), on=("B",), friction=friction, name="wall"
    )
    system = system_of(Gravity(), JointFriction((0.1, 0.5)), wall, chain=BARS)
    found = selected(system, state_of(system, (0.0, math.pi / 2), (0.0, 0.0)))
    at_wall = system.names.index("B on wall")
    assert (found.states[at_wall] is S.OPEN) is not wedged
    assert bool(found.others) is wedged
    for states in found.others:
        assert states[at_wall] is S.OPEN
        assert states[0] is S.FORWARD


@pytest.mark.parametrize(("friction", "others"), [(2.0, 1), (0.8, 1), (0.7, 0)])
@pytest.mark.parametrize("joints", [(), (JointFriction((1e-30, 0.0)),)])
def test_a_link_that_is_lifted_off_while_the_other_moves_may_be_wedged(friction, others, joints):
    """B moves along (1, 0) at the wall, away from it by 0.6, and along it by 0.8.

    A normal force N and friction μ N hold link 1 against a load that lifts it if μ > 3/4.
    """
    wall = Surface((0.0, -1.0), (0.6, -0.8), on=("B",), friction=friction, name="wall")
    chain = Chain.point_masses((1.0, 1.0), (1.0, 1.0))
    system = system_of(Gravity(), wall, *joints, chain=chain)
    found = selected(system, state_of(system, (-math.pi / 2, 0.0), (0.0, 1.0)))
    at_wall = system.names.index("B on wall")
    assert found.states[at_wall] is S.OPEN
    assert len(found.others) == others
    assert all(states[at_wall].pressed for states in found.others)


@pytest.mark.parametrize(
    "contact", [Surface((0.0, 0.0), (0.0, -1.0)), JointStop("A", lower=0.0)], ids=["floor", "stop"]
)
def test_a_contact_without_loads_has_no_choice(contact):
    """Whether it counts as closed or as open, the chain stays at rest."""
    system = system_of(contact, chain=BARS)
    assert selected(system, state_of(system, (0.0, 0.0), (0.0, 0.0))).others == ()


def test_a_chain_whose_rest_is_its_only_motion_has_no_choice():
    system = system_of(Gravity(), JointFriction((40.0, 40.0)), chain=BARS)
    assert selected(system, state_of(system, (0.3, 0.4), (0.0, 0.0))).others == ()


def test_points_in_one_place_with_one_friction_are_one_contact():
    """C1 and C2 are B: the first has the force of all, and the others stay beside it."""
    chain = Chain((1.0, 1.0), (1.0, 1.0), ((1.0, 0.0), (0.0, 0.0)), (0.1, 0.1))
    floor = Surface((0.0, 0.0), (0.0, -1.0), friction=0.5, on=("C2", "B", "C1"))
    system = system_of(Gravity(9.81, (0.0, 1.0)), floor, chain=chain)
    state = state_of(system, (0.0, 0.0))
    assert state.touching == {0, 1, 2}
    found = selected(system, state)
    assert found.states == (S.CLOSED, S.OPEN, S.OPEN)
    assert found.others == ()


@pytest.mark.parametrize(("frictions", "noted"), [((0.1, 0.5), True), ((0.5, 0.5), False)])
def test_a_slide_on_floors_in_one_place_with_two_frictions_is_a_choice(frictions, noted):
    """D is drawn along in the stretched pose, in which both give it the same acceleration."""
    floors = [
        Surface((0.0, 1.2), (0.0, -1.0), friction=friction, name=f"floor {number}")
        for number, friction in enumerate(frictions)
    ]
    q1 = math.asin(0.6)
    for q in ((q1, q1), (0.3, math.asin(1.2 - math.sin(0.3)))):
        u = 1.0, -math.cos(q[0]) / math.cos(q[1])
        system = system_of(Gravity(), *floors)
        found = selected(system, state_of(system, q, u))
        sliding = found.states.index(next(s for s in found.states if s is not S.OPEN))
        assert found.states[sliding].slips
        assert found.others == (((found.states[::-1]),) if noted else ())
