"""Motions as functions of time: polynomials written by hand, and a fine solution of an ODE."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.simulation.hybrid import BARS, mode_of, state_of, system_of
from twolink.contact.states import ContactState as S
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_torque import JointTorque
from twolink.integration.precisions import PRECISIONS
from twolink.scene import Scene
from twolink.simulation.hybrid import dense
from twolink.simulation.hybrid.compile import Compiler
from twolink.simulation.hybrid.dense import Polynomials, polynomials_of
from twolink.simulation.hybrid.flow import flow
from twolink.simulation.hybrid.run import hybrid_run


def rows(*series):
    """Return a step's coefficients of q1, q2, u1, u2, padded to the order 3."""
    return [[*map(float, row), *[0.0] * (4 - len(row))] for row in series]


# From 0 s: q1 = t², u1 = 2 t. From 1 s u1 has jumped to −1, and stays. The end is at 3 s.
BOUNCE = Polynomials(
    precision="double",
    starts=np.array([0.0, 1.0, 3.0]),
    coefficients=np.array(
        [
            rows((0, 0, 1), (5,), (0, 2), (0,)),
            rows((1, -1), (5,), (-1,), (0,)),
            rows((-1,), (5,), (-1,), (0,)),
        ]
    ),
    clocks=np.zeros((3, 4)),
    by_clock=np.array([False, False, False]),
    ends=np.array([1.0, 2.0, 0.0]),
    arcs=np.array([0, 1, 2]),
)


@pytest.mark.parametrize(
    ("t", "q1", "u1"), [(0.0, 0, 0), (0.5, 0.25, 1), (1.5, 0.5, -1), (3.0, -1, -1)]
)
@pytest.mark.parametrize("side", ["left", "right"])
def test_values_within_a_step_are_those_of_its_polynomial(t, q1, u1, side):
    q, u = BOUNCE.at(t, side)
    assert (q[0, 0], q[1, 0], u[0, 0]) == (q1, 5, u1)


def test_values_at_a_jump_are_those_of_the_requested_side():
    """After the jump by default."""
    assert BOUNCE.at([1.0], "left")[1][0] == [2.0]
    assert BOUNCE.at([1.0], "right")[1][0] == [-1.0]
    assert BOUNCE.at([1.0])[1][0] == [-1.0]
    assert BOUNCE.at([1.0], "left")[0][0] == BOUNCE.at([1.0])[0][0] == [1.0]


def test_times_in_long_double_are_compared_with_the_very_starts_of_steps():
    """The step begins between two numbers of float64."""
    early = np.longdouble(2.0) ** -60
    starts = BOUNCE.starts.astype(np.longdouble) - [0, early, 0]
    fine = replace(BOUNCE, precision="long double", starts=starts)
    assert fine.at(np.array([1 - 2 * early, 1 - early, 1 - early / 2]))[1][0].tolist() == [
        2 - 4 * early, -1, -1,
    ]  # fmt: skip
    assert fine.at([1.0], "left")[1][0] == [2]


def test_many_times_are_looked_up_at_once():
    q, u = BOUNCE.at(np.array([2.0, 0.5, 1.0]))
    assert q.shape == u.shape == (2, 3)
    assert q[0].tolist() == [0.0, 0.25, 1.0]


@pytest.mark.parametrize("count", [0, 1, 7, 8, 20])
def test_values_do_not_depend_on_how_many_are_computed_together(count, monkeypatch):
    times = np.linspace(0.0, 3.0, count)
    together = BOUNCE.at(times)
    monkeypatch.setattr(dense, "_AT_ONCE", 7)
    for whole, pieces in zip(together, BOUNCE.at(times), strict=True):
        assert whole.shape == (2, count)
        assert np.array_equal(whole, pieces)


def test_the_sides_of_several_jumps_at_one_instant_are_the_first_and_the_last():
    """An arc that takes no time lies between them."""
    several = Polynomials(
        "double", np.array([0.0, 1.0, 1.0, 2.0]),
        np.array([rows((), (), (k,), ()) for k in (1, 2, 3, 4)]), np.zeros((4, 4)),
        np.zeros(4, dtype=bool), np.array([1.0, 0.0, 1.0, 0.0]), np.arange(4),
    )  # fmt: skip
    assert several.at([1.0], "left")[1][0] == [1.0]
    assert several.at([1.0], "right")[1][0] == [3.0]


@pytest.mark.parametrize("t", [0.0, 1e-12, 0.1, 0.5, 0.74, 0.75])
def test_steps_by_a_clock_are_looked_up_by_time(t):
    """t = s + s² for s up to 1/2, so s = (√(1 + 4 t) − 1)/2; q1 = s³."""
    by_clock = Polynomials(
        "double", np.array([0.0, 0.75]),
        np.array([rows((0, 0, 0, 1), (), (), ()), rows((0.125,), (), (), ())]),
        np.array([[0.0, 1.0, 1.0, 0.0], [0.0] * 4]), np.array([True, False]),
        np.array([0.5, 0.0]), np.arange(2),
    )  # fmt: skip
    s = 2 * t / (math.sqrt(1 + 4 * t) + 1)
    assert by_clock.at(t)[0][0] == pytest.approx([s**3], rel=1e-13, abs=1e-50)


@pytest.mark.parametrize("t", [1e-30, 1e-18, 1e-6, 1.0])
def test_a_clock_of_zero_initial_rate_is_inverted(t):
    """t = s², as a press starts whose root grows from zero."""
    slow = Polynomials(
        "double", np.array([0.0, 1.0]),
        np.array([rows((0, 1), (), (), ()), rows((1,), (), (), ())]),
        np.array([[0.0, 0.0, 1.0, 0.0], [0.0] * 4]), np.array([True, False]),
        np.array([1.0, 0.0]), np.arange(2),
    )  # fmt: skip
    assert slow.at(t)[0][0] == pytest.approx([math.sqrt(t)], rel=1e-6)


@pytest.mark.parametrize("precision", ["long double", "quadruple"])
def test_values_are_in_the_numbers_of_the_precision(precision):
    number = PRECISIONS[precision].number
    system = system_of(JointTorque((1.0, 0.0)), precision=precision)
    state = state_of(system, (0.3, 0.2))
    arc = flow(
        system, state, mode_of(system), number(1), Compiler("lagrange"), lambda t, size: None
    )
    q, _ = polynomials_of([arc], arc.end, precision).at([0.0, 0.5, 1.0])
    assert isinstance(q[0, 1], number)
    assert q[0, 0] == number(0.3)
    assert abs(float(q[0, 2] - arc.end.q[0])) < 8 * system.rounding


@pytest.mark.parametrize("t", [0.0, 1e-30, 0.3, 0.74, 0.75, 0.9])
def test_quadruple_values_are_rounded_to_long_doubles(t):
    """On a step by a clock, whose coefficients leave the range of float64, and after the end."""
    own = PRECISIONS["quadruple"]
    small = own.number(2) ** own.number(-1200)

    def scaled(*row):
        return own.array(np.array(row, dtype=float)) * np.array([small**-k for k in range(4)])

    zero = 0 * scaled(0.0, 0.0, 0.0, 0.0)
    long = Polynomials(
        "quadruple", own.array(np.array([0.0, 0.75])),
        np.array([[scaled(0, 0, 0, 1), zero, scaled(1, 1, 0, 0), zero],
                  [own.array(np.array(row)) for row in rows((0.125,), (), (1.5,), ())]]),
        np.array([scaled(0.0, 1.0, 1.0, 0.0), zero]), np.array([True, False]),
        np.array([own.number(0.5) * small, own.number(0)]), np.arange(2),
    )  # fmt: skip
    s = 2 * np.longdouble(t) / (np.sqrt(1 + 4 * np.longdouble(t)) + 1) if t < 0.75 else 0.5
    q, u = long.rounded_at(np.array([t]))
    assert q.dtype == u.dtype == np.longdouble
    assert abs(q[0, 0] - s**3) <= 4 * PRECISIONS["long double"].rounding
    assert abs(u[0, 0] - 1 - s) <= 4 * PRECISIONS["long double"].rounding


def test_values_of_shorter_precisions_are_not_rounded():
    for rounded, own in zip(BOUNCE.rounded_at([0.5, 1.5]), BOUNCE.at([0.5, 1.5]), strict=True):
        assert np.array_equal(rounded, own)


@pytest.mark.parametrize("end", [0.4, 1.0, 2.5])
def test_polynomials_end_earlier_in_their_state(end):
    shorter = BOUNCE.until(end)
    before = np.linspace(0.0, end, 9)[:-1]
    assert np.array_equal(shorter.at(before), BOUNCE.at(before))
    for t in (end, 2.9):
        assert np.array_equal(shorter.at(t), BOUNCE.at(end, "left"))
    assert float(shorter.starts[-1]) == end
    assert shorter.ends[-1] == 0


def test_a_run_without_arcs_is_constant():
    system = system_of(Gravity())
    state = state_of(system, (0.3, 0.2), (1.0, 2.0))
    q, u = polynomials_of([], state, "double").at([0.0, 5.0])
    assert q.tolist() == [[0.3, 0.3], [0.2, 0.2]]
    assert u.tolist() == [[1.0, 1.0], [2.0, 2.0]]


def test_a_press_on_hertzs_surface_is_that_of_a_fine_solution():
    """Two bars fall on an elastic ball: SciPy follows δ^{3/2} in time, at times in the press."""
    floor, stiffness = 1.0, 2e3
    ball = CompliantSurface((0.0, floor), (0.0, -1.0), "hertz", stiffness)
    scene = Scene(BARS, (0.45, 0.5), (0.5, 0.4), 0.5, (Gravity(9.81), ball))
    run = hybrid_run(scene, [0.0, 0.5])
    assert S.CLOSED in {arc.mode.states[0] for arc in run.arcs}
    assert run.polynomials.by_clock.any()

    def rates(t, y):
        q, u = y[:2], y[2:]
        c, s = np.cos(q[1] - q[0]), np.sin(q[1] - q[0])
        M = np.array([[4 / 3, c / 2], [c / 2, 1 / 3]])
        depth = max(np.sin(q).sum() - floor, 0.0)
        right = np.array([s / 2 * u[1] ** 2, -s / 2 * u[0] ** 2])
        right += 9.81 * np.array([1.5, 0.5]) * np.cos(q) - stiffness * depth**1.5 * np.cos(q)
        return [*u, *np.linalg.solve(M, right)]

    times = np.linspace(0, 0.5, 41)
    fine = solve_ivp(
        rates, (0, 0.5), [*scene.q, *scene.u], "DOP853", t_eval=times, rtol=1e-11, atol=1e-12,
        max_step=2e-3,
    )  # fmt: skip
    q, u = run.polynomials.at(times)
    assert np.abs(q - fine.y[:2]).max() < 1e-8
    assert np.abs(u - fine.y[2:]).max() < 1e-7
    elapsed = [float(arc.end.t - arc.start.t) for arc in run.arcs if arc.compiled.clock is not None]
    assert max(elapsed) > 0.02


@pytest.mark.parametrize(
    ("precision", "length"),
    [(name, 1.0) for name in PRECISIONS] + [("long double", 1e-20), ("quadruple", 1e-20)],
)
@pytest.mark.parametrize("start", [(0, 1), (1, 0)])
def test_a_clock_is_inverted_to_round_off_in_few_iterations(
    precision, length, start, random, monkeypatch
):
    """Also right after the start of a press, and where coefficients leave the range of float64."""
    looked_at = []
    with_slope = dense._with_slope
    monkeypatch.setattr(dense, "_with_slope", lambda *a: looked_at.append(1) or with_slope(*a))
    own = PRECISIONS[precision]
    shares = own.array([0.0, 1e-12, 1e-6, 1e-3, 0.1, 0.5, 0.9, 1.0])
    rates = [0.0, *start, *(0.1 ** np.arange(1, 25) * random.uniform(0, 1, 24))]
    high = own.array([length] * len(shares))
    # The coefficients of t as a function of the own variable of the step.
    terms = [own.number(rate) / high**k for k, rate in enumerate(rates)]
    clocks = np.stack(terms, axis=1)
    elapsed, _ = with_slope(clocks, shares * high)
    found = dense._inverted(clocks, elapsed, high)
    again, _ = with_slope(clocks, found)
    assert (np.abs(again - elapsed).astype(float) <= 8 * own.rounding * elapsed.astype(float)).all()
    assert len(looked_at) <= 20
