"""The hybrid system: its names, its refusals, and its changes of effects."""

import numpy as np
import pytest

from tests.simulation.hybrid import system_of
from twolink.chain import Chain
from twolink.contact.force_laws import Phase, PlasticState
from twolink.contact.states import ContactState as S
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.errors import SimulationError
from twolink.simulation.hybrid.dynamics import held_coordinates
from twolink.simulation.hybrid.mode import Mode
from twolink.simulation.hybrid.pose import Pose

FLOOR = Surface((0.0, 1.0), (0.0, -1.0), on=("B", "D"), name="floor")


def test_a_system_names_the_elements_of_its_effects_in_their_order():
    system = system_of(Gravity(), JointFriction((1.0, 1.0)), FLOOR)
    assert system.names == ("A", "B", "B on floor", "D on floor")


def test_two_frictions_in_one_joint_are_refused():
    with pytest.raises(SimulationError, match="A has dry friction twice"):
        system_of(JointFriction((1.0, 0.0)), JointFriction((2.0, 0.0))).check()
    with pytest.raises(SimulationError, match="D has dry friction twice"):
        system_of(EndForce(1.0, 0.5), EndForce(2.0, 0.5)).check()


def test_a_contact_whose_point_hardly_moves_is_refused():
    """At 1e-14 m from A its motion is round-off, and it would have no impact; at A it has none."""

    def wall_on_centre(distance):
        chain = Chain((1.0, 1.0), (1.0, 1.0), ((distance, 0.0), (0.5, 0.0)), (0.5, 0.5))
        return system_of(Surface((0.0, 2.0), (0.0, -1.0), on=("C1",)), chain=chain)

    with pytest.raises(SimulationError, match=r"C1 on surface: .* at A, or at least 2\.8e-14 m"):
        wall_on_centre(1e-14).check()
    for distance in (0.0, 1e-13, 1.0):
        wall_on_centre(distance).check()


def test_frictions_along_different_coordinates_are_accepted():
    """So are contacts at one point: a corner has two."""
    system = system_of(JointFriction((1.0, 1.0)), EndForce(1.0, 0.5), JointStop("A", lower=0.0))
    system.check()
    system_of(FLOOR, Surface((2.0, 0.0), (-1.0, 0.0), on=("B", "D"), friction=0.5)).check()


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_the_known_frictions_have_the_sign_of_their_direction(precision):
    """A joint has a limit, and a surface a coefficient; at rest it is unknown."""
    system = system_of(
        JointFriction((0.5, 0.1), (0.7, 0.2)), Surface((0.0, 1.0), (0.0, -1.0), friction=0.3),
        precision=precision,
    )  # fmt: skip
    assert system.frictions((S.STICKS, S.STICKS, S.OPEN)) == ()
    assert system.frictions((S.BACKWARD, S.STICKS, S.FORWARD)) == (-0.5, 0.3)
    assert system.frictions((S.PRESSED_BACKWARD, S.PRESSED_FORWARD, S.CLOSED)) == (-0.7, 0.2)
    (friction,) = system.frictions((S.OPEN, S.OPEN, S.BACKWARD))
    assert isinstance(friction, system.number)


def test_each_pose_of_a_system_has_its_own_rows():
    """Poses share formulas only."""
    system = system_of(FLOOR)
    normal = system.elements[1].normal
    for q in ((0.3, 1.1), (0.4, -0.2)):
        assert system.pose(q).row(normal) == Pose(system.chain, system.formulation, q).row(normal)


def test_modes_of_rigid_elements_are_cached():
    """Dents differ from arc to arc, and so do their modes."""
    system = system_of(FLOOR)
    free, pressed = (S.OPEN, S.OPEN), (S.CLOSED, S.OPEN)
    assert system.mode(free) is system.mode(free)
    assert system.mode(free) == Mode(("B on floor", "D on floor"), free)
    assert system.mode(pressed) != system.mode(free)
    dents = (PlasticState(Phase.DENTED, 1.0, 0.5, 2.0), None)
    assert system.mode(free, dents).dents == dents
    assert system.mode(free).dents == ()


def test_elements_with_friction_have_a_tangent():
    system = system_of(JointFriction((1.0, 0.5)), FLOOR)
    assert [tangent is None for tangent in system.tangents] == [False, False, True, True]


def test_other_effects_bring_their_own_elements():
    system = system_of(JointFriction((1.0, 1.0)))
    changed = system.with_effects((Gravity(), JointFriction((2.0, 4.0))))
    assert changed.effects[0] == Gravity()
    assert [element.kinetic for element in changed.elements] == [2.0, 4.0]
    assert [element.kinetic for element in system.elements] == [1.0, 1.0]


def test_the_numbers_of_a_system_are_of_its_precision():
    system = system_of(Gravity(), precision="long double")
    assert isinstance(system.chain.L1, np.longdouble)
    assert isinstance(system.scene_chain.L1, float)
    assert system.rounding == float(np.finfo(np.longdouble).eps)


def test_the_last_pose_is_cached():
    system = system_of(Gravity(), FLOOR)
    q = (0.3, 0.2)
    pose = system.pose(q)
    assert system.pose(q) is pose
    # Equal angles may differ in the sign of a zero.
    assert system.pose((0.3, 0.2)).q == q
    assert system.pose((0.4, 0.2)).row(system.elements[0].normal) != pose.row(
        system.elements[0].normal
    )
    assert system.pose(q) is not pose


def test_a_system_under_other_effects_shares_no_pose():
    system, q = system_of(Gravity(), FLOOR), (0.3, 0.2)
    pose = system.pose(q)
    assert system.with_effects((FLOOR,)).pose(q) is not pose


def test_the_held_coordinates_are_those_of_the_elements():
    system = system_of(JointFriction((1.0, 1.0)), FLOOR)
    states = (S.STICKS, S.FORWARD, S.CLOSED, S.OPEN)
    assert system.held(states) == tuple(held_coordinates(system.elements, states))
    assert system.held(states) == (system.elements[0].tangent, system.elements[2].normal)
    assert system.held((S.FORWARD, S.FORWARD, S.OPEN, S.OPEN)) == ()


def test_a_system_is_equal_to_itself_only():
    """So caches of two systems with the same values are apart: their effects may differ."""
    assert system_of(Gravity()) != system_of(Gravity())


def test_numbers_of_effects_are_of_the_precision_of_the_system():
    pieces = SampledTorque((0.0, 1.0), (1.0, 2.0), (0.0, 0.0), "linear").piece_at(0.5)
    assert system_of(Gravity()).effect_numbers == ()
    found = system_of(pieces, precision="long double").effect_numbers
    assert [float(number) for number in found] == list(pieces.numbers)
    assert {type(number) for number in found} == {np.longdouble}


@pytest.mark.parametrize("precision", ["long double", "quadruple"])
def test_a_system_in_double_has_the_numbers_of_the_scene(precision):
    system = system_of(Gravity(), FLOOR, precision=precision)
    found, exact = system.in_double, system_of(Gravity(), FLOOR)
    assert (found.number, found.rounding) == (float, exact.rounding)
    assert found.chain == exact.chain
    assert found.elements == exact.elements
    assert exact.in_double is exact
