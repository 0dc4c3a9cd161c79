"""Words on the fastest rate of the surfaces of an arc."""

import re

import pytest

from tests.simulation.hybrid import BALANCED, mode_of, state_of, system_of
from twolink.chain import Chain
from twolink.contact.states import ContactState as S
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.fastest_rate import fastest_rate

PRECISIONS = ["double", "long double", "quadruple"]


def floor(stiffness, loss, y=0.0, name="cushion"):
    return CompliantSurface(
        (0.0, y), (0.0, -1.0), "kelvin-voigt", stiffness=stiffness, loss=loss, name=name
    )


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_surface_that_recovers_is_named_in_every_precision(precision):
    """Numbers of 113 bits know no format."""
    system = system_of(floor(1e8, 1e-6), precision=precision)
    state = state_of(system, (-0.5, -0.5))
    (own,) = state.compliant
    state = state._replace(compliant=(own._replace(residual_depth=system.number(1e-3)),))
    words = fastest_rate(system, mode_of(system, S.OPEN), state)
    assert words == ", while D on cushion recovers at 1e+14 1/s"


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_pressed_surface_damps_at_c_times_the_mobility_of_its_point(precision):
    """Straight along the surface, the mobility is 1/3 + 2: M = diag(3, 1/2), both levers 1 m."""
    system = system_of(floor(1e6, 3e6), chain=BALANCED, precision=precision)
    state = state_of(system, (1e-3, 1e-3))
    words = fastest_rate(system, mode_of(system, S.CLOSED), state)
    assert words == ", while D on cushion damps at 7e+06 1/s"


@pytest.mark.parametrize("loss", [0.0, 1e3])
def test_surfaces_that_are_not_pressed_have_no_rate(loss):
    system = system_of(floor(1e6, loss))
    assert fastest_rate(system, mode_of(system, S.OPEN), state_of(system, (-0.5, -0.5))) == ""


def test_a_spring_without_a_damper_has_no_rate():
    system = system_of(floor(1e6, 0.0))
    assert fastest_rate(system, mode_of(system, S.CLOSED), state_of(system, (1e-3, 1e-3))) == ""


def test_a_damper_that_steps_can_follow_is_no_reason_for_short_ones():
    """1000 of its times, of 3/(7 c) each, are the longest step of 0.5 s where c is 857 N s/m."""
    for loss, named in ((850.0, False), (865.0, True)):
        system = system_of(floor(1e6, loss), chain=BALANCED)
        state = state_of(system, (1e-3, 1e-3))
        assert bool(fastest_rate(system, mode_of(system, S.CLOSED), state)) == named


def test_the_fastest_of_two_surfaces_is_named():
    system = system_of(floor(1e6, 3e6), floor(1e6, 3e7, name="mat"), chain=BALANCED)
    words = fastest_rate(
        system, mode_of(system, S.CLOSED, S.CLOSED), state_of(system, (1e-3, 1e-3))
    )
    assert words == ", while D on mat damps at 7e+07 1/s"


def test_a_motion_that_a_damper_ends_names_it():
    """1e9 N s/m on a chain of 2 kg; its springs and torques are smooth, and are not blamed.

    The first steps show that there would be too many; at 1e8 N s/m, only the last of 1e5 do.
    """
    effects = Gravity(), floor(1e6, 1e9, 1.2)
    run = simulate(Scene(Chain.uniform_bars(), (0.3, -0.2), (0.0, 0.0), 1.0, effects), samples=3)
    (note,) = map(str, run.notes)
    cause = r"\(its steps become too short, while D on cushion damps at \d(\.\d)?e\+09 1/s\)"
    assert re.search(cause, note)
    assert "smooth" not in note
