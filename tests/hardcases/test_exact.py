"""The hundred digits against mpmath, SymPy's Lagrangian equations, and closed forms."""

import math
from decimal import Decimal
from functools import cache

import mpmath
import pytest
import sympy as sp
from hypothesis import given

from tests.strategies import State, chains, states
from twolink.chain import Chain
from twolink.contact.impact_laws import Response, rough_impulse
from twolink.hardcases import exact

with mpmath.workdps(110):
    PI = mpmath.pi + 0


def as_mpf(x: Decimal) -> mpmath.mpf:
    return mpmath.mpf(str(x))


def test_pi():
    with mpmath.workdps(110):
        assert abs(as_mpf(exact.pi()) - PI) < mpmath.mpf(10) ** -108


@pytest.mark.parametrize(
    "x", [0.0, 5e-324, 1e-8, 0.3, -0.4, math.pi / 2, math.pi, -math.pi, 22.0, 1e8, -1e15]
)
def test_cosine_and_sine(x):
    cos, sin = exact.cosine_and_sine(Decimal(x))
    with mpmath.workdps(140):
        for found, true in ((cos, mpmath.cos(x)), (sin, mpmath.sin(x))):
            assert abs(as_mpf(found) - true) <= mpmath.mpf(10) ** -98 * max(abs(true), 1e-30)


@cache
def lagrangian():
    """Return M and C u − Q by SymPy, from the energies: code shared with no other."""
    names = "m1 m2 L1 a1 b1 a2 b2 I1 I2 gx gy tau1 tau2 u1 u2"
    symbols = sp.symbols(names)
    m1, m2, L1, a1, b1, a2, b2, I1, I2, gx, gy, tau1, tau2, u1, u2 = symbols
    q1, q2 = sp.symbols("q1 q2")
    first = (a1 * sp.cos(q1) - b1 * sp.sin(q1), a1 * sp.sin(q1) + b1 * sp.cos(q1))
    second = (
        L1 * sp.cos(q1) + a2 * sp.cos(q2) - b2 * sp.sin(q2),
        L1 * sp.sin(q1) + a2 * sp.sin(q2) + b2 * sp.cos(q2),
    )
    q, u = (q1, q2), (u1, u2)
    T = I1 * u1**2 / 2 + I2 * u2**2 / 2
    V = -tau1 * q1 - tau2 * (q2 - q1)
    for mass, place in ((m1, first), (m2, second)):
        for x, g in zip(place, (gx, gy), strict=True):
            rate = sum(sp.diff(x, angle) * speed for angle, speed in zip(q, u, strict=True))
            T, V = T + mass * rate**2 / 2, V - mass * g * x
    M = sp.Matrix(2, 2, lambda i, j: sp.diff(T, u[i], u[j]))
    rest = [
        sum(sp.diff(T, u[i], q[j]) * u[j] for j in (0, 1)) - sp.diff(T - V, q[i]) for i in (0, 1)
    ]
    return sp.lambdify((*symbols, q1, q2), (M[0, 0], M[0, 1], M[1, 1], *rest), modules="mpmath")


GRAVITY = (0.7, 9.81)


def by_sympy(chain: Chain, q, u, torque):
    (a1, b1), (a2, b2) = chain.centre
    numbers = (chain.m1, chain.m2, chain.L1, a1, b1, a2, b2, chain.I_C1, chain.I_C2)
    values = (*numbers, *GRAVITY, *torque, *u, *q)
    M11, M12, M22, h1, h2 = lagrangian()(*map(mpmath.mpf, values))
    det = M11 * M22 - M12 * M12
    return (-M22 * h1 + M12 * h2) / det, (-M11 * h2 + M12 * h1) / det


@pytest.mark.slow
@given(chain=chains(), state=states())
def test_accelerations_are_those_of_the_lagrangian(chain, state: State):
    found = exact.accelerations(chain, state.q, state.u, GRAVITY, state.torque)
    with mpmath.workdps(150):
        true = by_sympy(chain, state.q, state.u, state.torque)
        size = max(abs(x) for x in true)
        for ours, theirs in zip(found, true, strict=True):
            assert abs(as_mpf(ours) - theirs) < mpmath.mpf(10) ** -60 * size


def test_momentum_rates_are_those_of_the_accelerations():
    """p = M u, and dp/dt less its part by M's rate is M du: checked by a small difference."""
    chain, q, u = Chain.uniform_bars((1.0, 2.0), (1.5, 0.5)), (0.3, -0.4), (0.5, -0.25)
    p = (1.75, 0.5)
    u1, u2, rate1, rate2 = exact.momentum_rates(chain, q, p, GRAVITY, (0.3, -0.7))
    del u
    with mpmath.workdps(120):
        speeds = as_mpf(u1), as_mpf(u2)
        numbers = (chain.m1, chain.m2, chain.L1, 0.75, 0.0, 0.25, 0.0, chain.I_C1, chain.I_C2)
        values = (*numbers, *GRAVITY, 0.3, -0.7, *speeds, *q)
        M11, M12, M22, *_ = lagrangian()(*map(mpmath.mpf, values))
        assert abs(M11 * speeds[0] + M12 * speeds[1] - p[0]) < mpmath.mpf(10) ** -90
        assert abs(M12 * speeds[0] + M22 * speeds[1] - p[1]) < mpmath.mpf(10) ** -90
        # The sum of both rates is the moment about A of all that acts: no M enters.
        Q1, Q2 = (as_mpf(x) for x in exact.active_force(chain, q, GRAVITY, (0.3, -0.7)))
        assert abs(as_mpf(rate1) + as_mpf(rate2) - Q1 - Q2) < mpmath.mpf(10) ** -90
        slope = -chain.m2 * chain.L1 * mpmath.mpf(0.25) * mpmath.sin(mpmath.mpf(q[1]) - q[0])
        assert abs(as_mpf(rate2) - Q2 - slope * speeds[0] * speeds[1]) < mpmath.mpf(10) ** -90


@pytest.mark.parametrize("start", [0.1, 1.0, -2.5])
@pytest.mark.parametrize("t", [0.0, 0.7, 12.3, 1e6])
def test_the_pendulum_is_that_of_the_elliptic_functions(start, t):
    with mpmath.workdps(60):
        w, k = mpmath.sqrt(mpmath.mpf(9.81)), mpmath.sin(mpmath.mpf(start) / 2)
        cd = mpmath.ellipfun("cd", w * t, m=k * k)
        angle = 2 * mpmath.asin(k * cd)
        speed_squared = 4 * w * w * (k * k - mpmath.sin(angle / 2) ** 2)
    found_angle, found_speed = exact.pendulum(start, 9.81, t)
    assert found_angle == pytest.approx(float(angle), abs=2e-15)
    assert found_speed**2 == pytest.approx(float(speed_squared), abs=1e-14)


STRUCK = {
    "stronge": ((0.5, 1.4), (1.2, -0.6), 0.8),
    "newton": ((1.2, 1.05), (0.1, 0.2), 0.9),
}


@pytest.mark.parametrize("law", STRUCK)
def test_impacts_are_those_of_the_other_text(law):
    """`contact.impact_laws` was written from Routh's construction, too, and shares no line."""
    (q, u, mu), e = STRUCK[law], 0.5
    after = exact.struck(Chain.uniform_bars(), q, u, mu, e, law)
    across = [-math.cos(x) for x in q]
    along = [-math.sin(x) for x in q]
    M11, M12, M22 = 4 / 3, math.cos(q[1] - q[0]) / 2, 1 / 3
    det = M11 * M22 - M12 * M12

    def solved(f):
        return (M22 * f[0] - M12 * f[1]) / det, (M11 * f[1] - M12 * f[0]) / det

    def dot(x, y):
        return x[0] * y[0] + x[1] * y[1]

    G = Response(
        *(dot(x, solved(y)) for x, y in ((across, across), (across, along), (along, along)))
    )
    impulse = rough_impulse(dot(across, u), dot(along, u), G, friction=mu, restitution=e, law=law)
    given = [
        impulse.normal * n + impulse.tangential * t for n, t in zip(across, along, strict=True)
    ]
    expected = [before + change for before, change in zip(u, solved(given), strict=True)]
    assert after == pytest.approx(expected, abs=1e-14)
