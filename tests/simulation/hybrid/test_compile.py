"""Compiled modes: their variables, and Taylor coefficients known from closed forms."""

import math

import numpy as np
import pytest

from tests.simulation.hybrid import BALANCED, BARS, mode_of, system_of
from twolink.contact.coordinates import PointCoordinate
from twolink.contact.force_laws import Phase, PlasticState
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.kinematics import velocity
from twolink.simulation.hybrid.compile import Compiler, safe_order

FLOOR = Surface((0.0, 0.9), (0.0, -1.0), on=("B", "D"))
BALL = CompliantSurface((0.0, 1.2), (0.0, -1.0), "hertz", 1000.0)
CUSHION = CompliantSurface((0.0, 1.2), (0.0, -1.0), "kelvin-voigt", 100.0, 4.0)


def compiled(system, *states, dents=(), recovering=(), formulation="lagrange"):
    return Compiler(formulation).mode(system, mode_of(system, *states, dents=dents), recovering)


def coefficients(mode, *values, scale=1.0, start=0.0, rate=0.0):
    """Return the Taylor coefficients of a step from these values, zero for all that follow."""
    integrator = mode.pool.original
    integrator.state[:] = [*values, *[0.0] * (len(integrator.state) - len(values))]
    integrator.time = 0 * integrator.time
    count = len(integrator.pars)
    integrator.pars[:] = [*[0.0] * mode.numbers, scale, start, rate][:count]
    integrator.step(write_tc=True)
    return integrator.tc.copy()


@pytest.mark.parametrize("rate", [0.0, 0.5, 3.0])
def test_errors_of_a_held_point_decay_at_the_rate_of_stabilisation(rate):
    """The height y of D obeys y'' + 2 r y' + r² (y - bound) = 0."""
    mode = compiled(system_of(FLOOR), S.OPEN, S.CLOSED)
    q, u = (0.3, 0.8), (0.2, -0.7)
    found = coefficients(mode, *q, *u, 1.0, rate=rate)
    (a1, a2), (s1, s2), (c1, c2) = found[2:4, 1], np.sin(q), np.cos(q)
    speed, acceleration = c1 * u[0] + c2 * u[1], c1 * a1 + c2 * a2 - s1 * u[0] ** 2 - s2 * u[1] ** 2
    # The place of the surface is a parameter, which is 0 here.
    expected = -2 * rate * speed - rate**2 * (s1 + s2)
    assert acceleration == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("formulation", ["kane", "lagrange"])
def test_a_steady_torque_gives_a_parabola(formulation):
    """M = diag(3, 1/2), 6 N m at A and 1 N m at B, whose reaction acts on link 1."""
    system = system_of(JointTorque((6.0, 1.0)), chain=BALANCED)
    found = coefficients(compiled(system, formulation=formulation), 0.1, 0.2, 0.3, 0.4)
    assert found[0, :4] == pytest.approx([0.1, 0.3, 5 / 6, 0], abs=1e-15)
    assert found[1, :4] == pytest.approx([0.2, 0.4, 1.0, 0], abs=1e-15)
    assert found[2, :3] == pytest.approx([0.3, 5 / 3, 0], abs=1e-15)


def test_an_open_contact_has_its_gap_as_a_variable():
    """Its rate is the speed along the normal, whatever the gap is."""
    system = system_of(Gravity(), FLOOR)
    mode = compiled(system, S.OPEN, S.OPEN)
    assert (mode.gaps, mode.recovering, mode.roots, mode.clock) == ((0, 1), (), (), None)
    q, u = (0.3, 0.2), (1.5, -0.5)
    found = coefficients(mode, *q, *u, 7.0, 1e-12)
    assert found[4:6, 0].tolist() == [7.0, 1e-12]
    assert found[4, 1] == pytest.approx(-velocity(BARS, q, u, BARS.B)[1])
    assert found[5, 1] == pytest.approx(-velocity(BARS, q, u, BARS.D)[1])


def test_a_contact_that_rests_has_no_gap_but_an_event_function_of_its_force():
    system = system_of(Gravity(), FLOOR)
    mode = compiled(system, S.OPEN, S.CLOSED)
    assert mode.gaps == (0,)
    kinds = {(w.trigger.kind, w.trigger.index, w.integral) for w in mode.watched}
    assert kinds == {(E.HITS, 0, False), (E.LEAVES, 1, True)}


def test_the_rate_of_an_integral_is_the_event_function_times_the_scale():
    """A stop that holds link 1 against −6 N m pushes with 6 N m."""
    system = system_of(JointTorque((-6.0, 0.0)), JointStop("A", lower=0.0), chain=BALANCED)
    mode = compiled(system, S.CLOSED)
    assert mode.watched == ()
    system = system_of(
        JointTorque((-6.0, 0.0), (0.0, 1.0), (0.0, 2.0)), JointStop("A", lower=0.0), chain=BALANCED
    )
    mode = compiled(system, S.CLOSED)
    (watched,) = mode.watched
    found = coefficients(mode, 0.0, 0.0, 0.0, 0.0, scale=0.125)
    # 6 + sin(2 t): the torque at B reacts on link 1.
    assert found[watched.variable, 1] == pytest.approx(0.125 * 6)
    assert found[watched.variable, 2] == pytest.approx(0.125 * 2 / 2)
    assert mode.integrals == slice(watched.variable, watched.variable + 1)


def test_an_event_function_that_never_changes_is_not_watched():
    """Both joints are held under a steady torque: neither limit is ever reached."""
    system = system_of(JointTorque((0.5, 0.5)), JointFriction((1.0, 1.0)), chain=BALANCED)
    assert compiled(system, S.STICKS, S.STICKS).watched == ()


def test_a_press_in_the_root_of_the_depth_has_its_own_time_variable():
    """dt = root ds, and d root/ds = −(normal speed)/2."""
    system = system_of(Gravity(0.0), BALL)
    mode = compiled(system, S.CLOSED)
    assert mode.roots == (0,)
    names = [str(v) for v, _ in mode.pool.original.sys]
    root, clock = names.index("root0"), mode.clock
    assert names[clock] == "clock"
    q, u = (0.3, 0.2), (1.5, -0.5)
    values = [0.0] * len(names)
    values[:4], values[root] = [*q, *u], 0.25
    found = coefficients(mode, *values)
    falling = velocity(BARS, q, u, BARS.D)[1]
    assert found[root, 1] == pytest.approx(falling / 2)
    assert found[clock, 1] == pytest.approx(0.25)
    assert found[clock, 2] == pytest.approx(falling / 4)
    assert found[:2, 1] == pytest.approx(0.25 * np.array(u))
    (watched,) = mode.watched
    assert (watched.trigger.kind, watched.variable, watched.integral) == (E.LEAVES, root, False)


def test_the_speed_along_a_rooted_press_is_braked_by_hertz():
    """M du/ds = root · force, with the force of 1000 root³."""
    system = system_of(Gravity(0.0), BALL)
    mode = compiled(system, S.CLOSED)
    names = [str(v) for v, _ in mode.pool.original.sys]
    q, root = (0.3, 0.2), 0.25
    values = [0.0] * len(names)
    values[:2], values[names.index("root0")] = q, root
    found = coefficients(mode, *values)
    c = math.cos(q[1] - q[0])
    M = np.array([[4 / 3, c / 2], [c / 2, 1 / 3]])
    expected = np.linalg.solve(M, -1000 * root**3 * np.cos(q)) * root
    assert found[2:4, 1] == pytest.approx(expected, rel=1e-13)


def test_a_surface_that_springs_back_is_a_variable_that_decays():
    """k/c = 25/s; the gap closes by as much as the surface comes back."""
    system = system_of(Gravity(0.0), CUSHION)
    mode = compiled(system, S.OPEN, recovering=(0,))
    assert mode.recovering == (0,)
    found = coefficients(mode, 0.3, 0.2, 0.0, 0.0, 0.5, 0.02)
    decay = [0.02 * (-25) ** k / math.factorial(k) for k in range(6)]
    assert found[5, :6] == pytest.approx(decay, rel=1e-13)
    assert found[4, 1:6] == pytest.approx(decay[1:], rel=1e-13)


def test_modes_of_one_kind_share_an_integrator():
    """Dents, torques and places that differ in numbers only are parameters."""
    system = system_of(Gravity(), FLOOR)
    assert compiled(system, S.OPEN, S.OPEN) is compiled(system, S.OPEN, S.OPEN)
    assert compiled(system, S.OPEN, S.OPEN) is not compiled(system, S.OPEN, S.CLOSED)
    other = compiled(system, S.OPEN, S.OPEN, formulation="kane")
    assert other is not compiled(system, S.OPEN, S.OPEN)
    steel = CompliantSurface(
        (0.0, 1.2), (0.0, -1.0), "elasto-plastic", radius=0.02, modulus=(2e11, 2e11),
        poisson=(0.3, 0.3), strength=(1e9, 1e9),
    )  # fmt: skip
    system = system_of(Gravity(), steel)
    dents = [PlasticState(Phase.DENTED, 1e9, 1e-6, x) for x in (1e-5, 2e-5)]
    first, second = (compiled(system, S.CLOSED, dents=(dent,)) for dent in dents)
    assert first is second
    # Three of the dent, and the place of D.
    assert first.numbers == 4
    moved = system.moved_to([place + 1e-9 for place in system.places])
    assert compiled(moved, S.CLOSED, dents=dents[:1]).pool is first.pool


def test_modes_that_slide_to_either_side_share_an_integrator():
    """du/dt = ∓0.6/3 of link 1 and ∓0.1/0.5 of link 2; a slide stops where its speed is zero."""
    friction = JointFriction((0.6, 0.0), (0.9, 0.0))
    system = system_of(friction, Gravity(0.0), chain=BALANCED)
    forward, backward = compiled(system, S.FORWARD), compiled(system, S.BACKWARD)
    assert backward.pool is forward.pool
    assert backward is compiled(system_of(friction, Gravity(0.0), chain=BALANCED), S.BACKWARD)
    for mode, sign in ((forward, 1), (backward, -1)):
        (watched,) = mode.watched
        assert (watched.trigger.kind, watched.trigger.sense) == (E.STOPS, sign)
        assert mode.layout.reversed == (frozenset() if sign > 0 else frozenset({0}))
        integrator = mode.pool.original
        integrator.state[:] = [0.0, 0.0, sign * 0.3, 0.0, 0.0]
        integrator.pars[0] = system.frictions((S.FORWARD if sign > 0 else S.BACKWARD,))[0]
        integrator.step(write_tc=True)
        assert integrator.tc[2, :2] == pytest.approx([sign * 0.3, -sign * 0.2], abs=1e-15)
        assert watched.factor * integrator.tc[watched.variable, 1] == pytest.approx(0.3)
    pressed = compiled(system, S.PRESSED_BACKWARD)
    assert pressed.pool is compiled(system, S.PRESSED_FORWARD).pool is not forward.pool


def test_an_event_function_of_parameters_alone_is_not_watched():
    """Joint A is held against −0.1 N m, the reaction of the friction at B."""
    system = system_of(JointFriction((1.0, 0.1)), Gravity(0.0), chain=BALANCED)
    kinds = {w.trigger.kind for w in compiled(system, S.STICKS, S.BACKWARD).watched}
    assert kinds == {E.STOPS}


def test_steps_of_another_order_are_another_mode():
    from dataclasses import replace

    system = system_of(Gravity(), FLOOR)
    lower = compiled(replace(system, order=15), S.OPEN, S.OPEN)
    assert lower.pool.original.order == 15
    assert compiled(system, S.OPEN, S.OPEN).pool.original.order > 15


def test_a_sliding_contact_watches_force_slide_and_lock():
    system = system_of(Gravity(), Surface((0.0, 1.2), (0.0, -1.0), friction=0.4))
    assert system.elements[0].tangent == PointCoordinate("D", (1.0, 0.0))
    mode = compiled(system, S.FORWARD)
    assert {w.trigger.kind for w in mode.watched} == {E.LEAVES, E.STOPS, E.JAMS}
    assert {w.trigger.sense for w in mode.watched if w.trigger.kind is E.STOPS} == {1}
    assert mode.operations > 0


def test_systems_of_like_effects_share_an_integrator():
    one, other = system_of(Gravity(), FLOOR), system_of(Gravity(), FLOOR)
    assert compiled(one, S.OPEN, S.OPEN) is compiled(other, S.OPEN, S.OPEN)
    without = compiled(system_of(FLOOR), S.OPEN, S.OPEN)
    assert compiled(one, S.OPEN, S.OPEN) is not without


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_dt_ds_is_the_product_of_roots_but_as_small_as_two_of_them(count):
    """Over the root of the sum of all depths once for each root beyond two."""
    surfaces = (
        CompliantSurface((0.0, 1.2), (0.0, -1.0), "hertz", 1.0, name=f"s{i}") for i in range(count)
    )
    mode = compiled(system_of(*surfaces), *[S.CLOSED] * count)
    roots = np.array([0.1, 0.2, 0.3, 0.4][:count])
    q, u = (0.3, 0.2), (1.5, -0.5)
    found = coefficients(mode, *q, *u, *roots)
    pace = roots.prod() / math.sqrt((roots**2).sum()) ** max(count - 2, 0)
    assert found[mode.clock, 1] == pytest.approx(pace, rel=1e-14)
    assert found[0, 1] == pytest.approx(1.5 * pace, rel=1e-14)
    sinks = velocity(BARS, q, u, BARS.D)[1] / 2 / roots
    assert found[4 : 4 + count, 1] == pytest.approx(sinks * pace, rel=1e-14)


def test_an_order_whose_last_coefficients_vanish_is_avoided():
    """On a Hertz-like surface u has the coefficients 0, 5, 10, …, √depth 1, 6, …, q 2, 7, …"""
    hertz, damped = system_of(BALL).elements, system_of(CUSHION).elements
    assert [safe_order(hertz, order) for order in (14, 15, 17, 19, 21, 23, None)] == [
        16, 15, 17, 21, 21, 23, None,
    ]  # fmt: skip
    assert safe_order(damped, 19) == 19


@pytest.mark.slow_but_first
@pytest.mark.parametrize("precision", ["double", "long double"])
def test_optimised_code_gives_the_same_series(precision):
    """It may fuse multiplications and additions of doubles, and is compiled once as well."""
    system = system_of(Gravity(), FLOOR, precision=precision)
    mode = mode_of(system, S.OPEN, S.CLOSED)
    compiler = Compiler("kane")
    plain = compiler.mode(system, mode)
    optimised = compiler.mode(system, mode, optimised=True)
    assert optimised.pool is not plain.pool
    assert compiler.mode(system, mode, optimised=True) is optimised
    values = [system.number(x) for x in (0.3, 0.2, 1.5, -0.5)]
    first, second = coefficients(plain, *values), coefficients(optimised, *values)
    if precision == "double":
        assert second == pytest.approx(first, rel=1e-11, abs=1e-11)
    else:
        assert np.array_equal(second, first)
