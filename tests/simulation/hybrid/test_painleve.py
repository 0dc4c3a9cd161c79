"""Slides that friction locks, and the impacts that end them."""

import math

import numpy as np
import pytest

from tests.simulation.hybrid import BARS, mode_of, sliding_painleve, state_of, system_of
from twolink import lagrange
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.effects.gravity import Gravity
from twolink.effects.surface import Surface
from twolink.errors import IntegrationError
from twolink.simulation.hybrid.jump import jump, settle
from twolink.simulation.hybrid.mode import Trigger


def test_a_locked_slide_under_a_weight_is_struck_without_a_collision():
    """In one direction the slide goes on; in the other an impact takes energy."""
    kinds = []
    for system, state in sliding_painleve():
        after = settle(system, state, {})
        kinds.append(len(after.strikes))
        if after.strikes:
            energies = [
                lagrange.kinetic_energy(system.chain, state.q, s.u[1]) for s in after.strikes
            ]
            start = lagrange.kinetic_energy(system.chain, state.q, state.u)
            assert all(energy <= start * (1 + 1e-12) for energy in energies)
            assert after.strikes[0].speeds[0] == pytest.approx(0, abs=1e-15)
        else:
            assert after.mode.states[0].slips
    assert sorted(kinds)[0] == 0
    assert sorted(kinds)[1] >= 1


def at_the_limit(share):
    """Return a slide whose friction cancels a push but for a share, with its mode and direction."""
    q = (1.1, 1.3)
    normal, tangent = np.array([-np.cos(q), -np.sin(q)])
    answer = np.linalg.solve(lagrange.mass_matrix(BARS, q), normal)
    direction = 1 if tangent @ answer > 0 else -1
    friction = (1 - share) * (normal @ answer) / abs(tangent @ answer)
    floor = Surface((0.0, float(np.sin(q).sum())), (0.0, -1.0), friction=friction)
    system = system_of(Gravity(9.81), floor)
    u = np.linalg.solve([normal, tangent], [0.0, 0.2 * direction])
    state = state_of(system, q)._replace(
        u=tuple(u.tolist()), touching=frozenset({0}), sliding=(direction,)
    )
    return system, state, mode_of(system, S.FORWARD if direction > 0 else S.BACKWARD), direction


def test_a_slide_whose_force_grew_without_bound_is_stopped():
    """Its friction takes all momenta: M u + N (n - s μ t) = 0 in the limit."""
    system, state, mode, direction = at_the_limit(1e-4)
    after = jump(system, state, mode, Trigger(E.JAMS, 0, direction))
    assert after.state.u == (0.0, 0.0)
    (strike,) = after.strikes
    assert strike.impulse.regime == "slides, then sticks"
    pose = system.pose(state.q)
    rows = [pose.row(way) for way in (system.elements[0].normal, system.elements[0].tangent)]
    given = np.array([strike.impulse.normal, strike.impulse.tangential]) @ np.array(rows)
    momenta = np.array(lagrange.mass_matrix(BARS, state.q)) @ state.u
    assert given == pytest.approx(-momenta, abs=1e-3 * np.abs(momenta).max())


def test_a_slide_that_its_friction_cannot_stop_is_an_error():
    """Half of the response to a push is left, and the links would have to be stopped otherwise."""
    system, state, mode, direction = at_the_limit(0.5)
    with pytest.raises(IntegrationError, match="no impulse of its friction stops the links"):
        jump(system, state, mode, Trigger(E.JAMS, 0, direction))


@pytest.mark.parametrize("u", [(1.0, -1.0), (0.0, 0.0)], ids=["turning", "at rest"])
@pytest.mark.parametrize(("share", "is_wedged"), [(0.99, False), (1.01, True)])
def test_a_stretched_chain_is_wedged_if_it_is_inside_the_cone_of_friction(share, is_wedged, u):
    """The links turn and pull D along the chain, into the surface, at 0.4 rad to its normal.

    D follows along the surface only if the chain is outside the cone of friction: μ < tan 0.4.
    """
    system, state = stretched(share * math.tan(0.4), (math.pi / 2 - 0.4, math.pi / 2 - 0.4), u)
    if is_wedged:
        with pytest.raises(IntegrationError, match="D on surface is wedged"):
            settle(system, state, {})
    else:
        assert settle(system, state, {}).mode.states[0].slips


def stretched(friction, q, u):
    """Return a chain whose end rests on a rough surface, beyond which its base is.

    The surface bars the end only; gravity presses it on.
    """
    end = math.cos(q[0]) + math.cos(q[1]), math.sin(q[0]) + math.sin(q[1])
    system = system_of(Gravity(-9.81), Surface(end, (0.0, 1.0), friction=friction))
    return system, state_of(system, q)._replace(u=u, touching=frozenset({0}), sliding=(0,))
