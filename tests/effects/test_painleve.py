"""Painlevé: a rough surface wedges a link that leans into its slide; no silent wrong branch."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from twolink import lagrange
from twolink.chain import Chain
from twolink.data import data_path
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.surface import Surface
from twolink.errors import IntegrationError
from twolink.loads import Force
from twolink.scene import Scene
from twolink.simulation import simulate

BARS = Chain.uniform_bars()
Q = (1.1, 1.3)
FLOOR = math.sin(Q[0]) + math.sin(Q[1])


def rows() -> np.ndarray:
    """The Jacobians of D up from the floor and along it."""
    directions = (0.0, -1.0), (1.0, 0.0)
    return np.array(
        [
            lagrange.generalized_active_force(BARS, Q, (Force(BARS.D, direction),))
            for direction in directions
        ],
        dtype=float,
    )


def contact(speed: float, friction: float):
    """A = ∂a_n/∂N and b = a_n without contact, of a slide at a speed, from the definitions."""
    J = rows()
    u = np.linalg.solve(J, [0.0, speed])
    M = np.array(lagrange.mass_matrix(BARS, Q))
    load = J[0] - math.copysign(friction, speed) * J[1]
    forces = np.array(lagrange.generalized_active_force(BARS, Q, Gravity().loads(BARS, Q, (0, 0))))
    du = np.linalg.solve(M, forces - np.array(lagrange.velocity_terms(BARS, Q, tuple(u))))
    drift = math.sin(Q[0]) * u[0] ** 2 + math.sin(Q[1]) * u[1] ** 2
    return J[0] @ np.linalg.solve(M, load), J[0] @ du + drift, tuple(u.tolist())


def scene(speed: float, friction: float, **options) -> Scene:
    *_, u = contact(speed, friction)
    floor = Surface((0.0, FLOOR), (0.0, -1.0), friction=friction, name="floor", **options)
    return Scene(chain=BARS, q=Q, u=u, duration=0.3, effects=(Gravity(), floor), accuracy=1e-9)


LEANING = 1.0
"""The direction of sliding in which the chain leans against it."""


@pytest.mark.parametrize("law", ["newton", "newton-routh", "poisson", "stronge"])
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_contact_without_a_consistent_mode_has_an_impact_without_collision(law, restitution):
    A, b, _ = contact(LEANING * 0.2, 2.0)
    assert A < 0 > b
    trajectory = simulate(scene(LEANING * 0.2, 2.0, law=law, restitution=restitution))
    first = trajectory.impacts[0]
    assert first.time == 0
    assert first.speeds[0] == 0
    assert first.normal_impulse > 0
    assert first.energy_change < 0
    assert first.sliding[0] > 0
    assert first.sliding[1] == pytest.approx(0, abs=1e-12)
    y = trajectory.position(BARS.D)[1]
    assert y.max() <= FLOOR + 5e-15


def test_two_consistent_modes_are_noted():
    A, b, _ = contact(LEANING * 6.0, 2.0)
    assert A < 0 < b
    trajectory = simulate(scene(LEANING * 6.0, 2.0))
    (note, *_) = trajectory.notes
    assert note.startswith("At 0 s the laws of contact leave a choice: ")
    assert "is taken; or" in note


@pytest.mark.parametrize("speed", [0.2, 6.0])
def test_sliding_the_other_way_has_one_mode(speed):
    A, b, _ = contact(-LEANING * speed, 2.0)
    assert A > 0
    trajectory = simulate(scene(-LEANING * speed, 2.0))
    assert trajectory.notes == ()
    expected = "D on floor slips backward" if b < 0 else "moves freely"
    assert str(trajectory.events[0].mode) == expected


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_the_threshold_of_wedging(share):
    """At the μ at which A = 0 the slide goes over from sliding on to the impact."""
    J, M = rows(), np.array(lagrange.mass_matrix(BARS, Q))
    G = J @ np.linalg.solve(M, J.T)
    critical = G[0, 0] / abs(G[0, 1])
    trajectory = simulate(scene(LEANING * 0.2, share * critical))
    struck = [impact for impact in trajectory.impacts if impact.time == 0]
    assert bool(struck) == (share > 1)


@pytest.mark.slow
@pytest.mark.parametrize("friction", [1.5, 2.0])
def test_a_slide_that_slows_down_towards_the_pose_where_it_jams_ends_there(friction):
    """D slides along a floor through the base, the links mirror images of each other.

    Without gravity the floor pushes in proportion to u², so that the slide slows down to rest where
    a push no longer accelerates D upwards: n · M⁻¹(n − μ t) is zero within round-off at its end.
    """

    def response(q2):
        M = np.array(lagrange.mass_matrix(BARS, (-q2, q2)))
        up, along = np.array([1.0, 1.0]) * math.cos(q2), np.array([1.0, -1.0]) * math.sin(q2)
        return up @ np.linalg.solve(M, up + friction * along)

    floor = Surface((0.0, 0.0), (0.0, 1.0), friction=friction)
    trajectory = simulate(Scene(BARS, (-0.5, 0.5), (-5.0, 5.0), 0.5, (floor,)))
    assert trajectory.met
    assert response(0.5) > 0.01
    assert trajectory.q[1, -1] == pytest.approx(brentq(response, 0.5, 1.5), abs=1e-9)
    assert not trajectory.u[:, -1].any()
    (impact,) = trajectory.impacts
    T = trajectory.kinetic_energy
    assert impact.kinetic_energy[0] < 1e-15 * T[0]
    (given,) = trajectory.work().values()
    assert given == pytest.approx(T - T[0], abs=1e-14 * T[0])


def test_the_shipped_scene_shows_it():
    trajectory = simulate(Scene.load(data_path("scenes") / "painleve.toml"))
    assert trajectory.met
    assert trajectory.impacts[0].time == 0
    assert trajectory.impacts[0].speeds[0] == 0


def folded(obstacle: type, friction: float, **options) -> Scene:
    """A folded chain at rest, whose end touches a surface at 0.5 rad to the links."""
    chain, angle = Chain.uniform_bars(length=(1.0, 0.6)), 1.2
    place = 0.4 * math.cos(angle), 0.4 * math.sin(angle)
    normal = -math.cos(angle + 0.5), -math.sin(angle + 0.5)
    surface = obstacle(place, normal, friction=friction, **options)
    q = angle, angle + math.pi
    return Scene(chain=chain, q=q, u=(0.0, 0.0), duration=0.2, effects=(Gravity(), surface))


def test_a_folded_chain_at_rest_is_wedged_if_its_links_are_inside_the_cone_of_friction():
    slides = simulate(folded(Surface, 0.99 * math.tan(0.5)))
    assert slides.events[0].description == "D on surface slips forward"
    with pytest.raises(IntegrationError, match="at 0 s D on surface is wedged"):
        simulate(folded(Surface, 1.01 * math.tan(0.5)))


@pytest.mark.slow
def test_the_motion_of_a_wedged_chain_vanishes_as_its_surface_grows_stiff():
    """The links turn by ε, and press D by ε²; their force, of order 1/ε, is of order k ε²."""
    friction = 1.2 * math.tan(0.5)
    turned = []
    for stiffness in (1e7, 1e8, 1e9):
        scene = folded(CompliantSurface, friction, law="kelvin-voigt", stiffness=stiffness)
        q = simulate(scene, accuracy=1e-6, samples=2001).q
        turned.append(np.ptp(q, axis=1).max())
    assert turned[0] / turned[1] == pytest.approx(10 ** (1 / 3), rel=0.05)
    assert turned[1] / turned[2] == pytest.approx(10 ** (1 / 3), rel=0.05)
