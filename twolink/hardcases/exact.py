"""Reference values to a hundred digits, with Python's decimal numbers.

The library's equations are not used: the chain's two equations of motion are written independently
and solved by the textbook determinant, whose cancellation is harmless with a hundred digits.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from decimal import MAX_EMAX, MIN_EMIN, Context, Decimal, localcontext
from functools import cache

from twolink.arithmetic import Pair
from twolink.chain import Chain

DIGITS = 100

# Terms near 1e-600 (a small mass times a small length, squared) are added to terms near 1.
_WORKING = Context(prec=DIGITS + 20, Emax=MAX_EMAX, Emin=MIN_EMIN)


@contextmanager
def digits() -> Iterator[None]:
    """Compute with a hundred digits plus guard digits in the block."""
    with localcontext(_WORKING):
        yield


@cache
def pi() -> Decimal:
    """Return π by the arithmetic-geometric mean of Gauss."""
    with digits():
        a, b, t, p = Decimal(1), 1 / Decimal(2).sqrt(), Decimal("0.25"), Decimal(1)
        for _ in range(8):
            mean = (a + b) / 2
            a, b, t, p = mean, (a * b).sqrt(), t - p * (a - mean) ** 2, 2 * p
        return (a + b) ** 2 / (4 * t)


def cosine_and_sine(x: Decimal) -> tuple[Decimal, Decimal]:
    """Return cos x and sin x (x in rad) by their series after argument reduction."""
    with digits():
        half_turns = (x / pi()).to_integral_value()
        near = x - half_turns * pi()
        # e^{iy} of y = x/2^k, squared k times.
        halvings = 8
        y = near / 2**halvings
        cos, sin, term, n = Decimal(1), y, y, 1
        while abs(term) > Decimal(10) ** (-DIGITS - 15) * abs(y):
            n += 1
            term = term * y / n
            sign = -1 if n % 4 in (2, 3) else 1
            if n % 2:
                sin += sign * term
            else:
                cos += sign * term
        for _ in range(halvings):
            cos, sin = 1 - 2 * sin * sin, 2 * sin * cos
        return (-cos, -sin) if half_turns % 2 else (cos, sin)


class _Terms:
    """The mass matrix of a chain in a pose, and the slope of its entries (kg m²)."""

    def __init__(self, chain: Chain, q: Pair) -> None:
        (m1, m2), (I1, I2) = map(_pair, (chain.mass, chain.inertia))
        (a1, b1), (a2, b2) = map(_pair, chain.centre)
        L1 = Decimal(chain.L1)
        cos, sin = cosine_and_sine(Decimal(q[1]) - Decimal(q[0]))
        self.M11 = I1 + m1 * (a1 * a1 + b1 * b1) + m2 * L1 * L1
        self.M22 = I2 + m2 * (a2 * a2 + b2 * b2)
        self.M12 = m2 * L1 * (a2 * cos - b2 * sin)
        self.slope = -m2 * L1 * (a2 * sin + b2 * cos)

    def solved(self, r1: Decimal, r2: Decimal) -> tuple[Decimal, Decimal]:
        """Return M⁻¹ r."""
        det = self.M11 * self.M22 - self.M12 * self.M12
        return (self.M22 * r1 - self.M12 * r2) / det, (self.M11 * r2 - self.M12 * r1) / det


def active_force(chain: Chain, q: Pair, gravity: Pair, torque: Pair) -> tuple[Decimal, Decimal]:
    """Return Q1, Q2 (N m) of gravity (m/s², along x and y) and motor torques (N m)."""
    with digits():
        (m1, m2), (gx, gy), (tau1, tau2) = map(_pair, (chain.mass, gravity, torque))
        (a1, b1), (a2, b2) = map(_pair, chain.centre)
        c1, s1 = cosine_and_sine(Decimal(q[0]))
        c2, s2 = cosine_and_sine(Decimal(q[1]))
        along, across = m1 * a1 + m2 * Decimal(chain.L1), m1 * b1
        Q1 = (-along * s1 - across * c1) * gx + (along * c1 - across * s1) * gy
        Q2 = m2 * ((-a2 * s2 - b2 * c2) * gx + (a2 * c2 - b2 * s2) * gy)
        return Q1 + tau1 - tau2, Q2 + tau2


def accelerations(
    chain: Chain, q: Pair, u: Pair, gravity: Pair, torque: Pair
) -> tuple[Decimal, Decimal]:
    """Return du (rad/s²) of a float64 chain at a float64 state, to a hundred digits."""
    with digits():
        terms = _Terms(chain, q)
        Q1, Q2 = active_force(chain, q, gravity, torque)
        u1, u2 = _pair(u)
        return terms.solved(Q1 - terms.slope * u2 * u2, Q2 + terms.slope * u1 * u1)


def momentum_rates(
    chain: Chain, q: Pair, p: Pair, gravity: Pair, torque: Pair
) -> tuple[Decimal, Decimal, Decimal, Decimal]:
    """Return u = M⁻¹ p (rad/s) and dp/dt (N m) of momenta p (kg m²/s), to a hundred digits."""
    with digits():
        terms = _Terms(chain, q)
        u1, u2 = terms.solved(*_pair(p))
        Q1, Q2 = active_force(chain, q, gravity, torque)
        slope = terms.slope * u1 * u2
        return u1, u2, Q1 - slope, Q2 + slope


def pendulum(start: float, w_squared: float, t: float) -> tuple[float, float]:
    """Return angle (rad) and speed (rad/s) of θ'' = −w² sin θ, initially at rest at `start`.

    sin(θ/2) = k cd(w t, k) with k = sin(start/2): Jacobi's functions by the arithmetic-geometric
    mean (M. Abramowitz and I. Stegun, Handbook of Mathematical Functions, 1964, section 16.4).
    """
    with digits():
        w, time = Decimal(w_squared).sqrt(), Decimal(t)
        k = cosine_and_sine(Decimal(start) / 2)[1]
        other = (1 - k * k).sqrt()
        a, b, c = [Decimal(1)], [other], [k]
        while abs(c[-1]) > Decimal(10) ** (-DIGITS // 2):
            a.append((a[-1] + b[-1]) / 2)
            c.append((a[-2] - b[-1]) / 2)
            b.append((a[-2] * b[-1]).sqrt())
        last = len(a) - 1
        phase = 2**last * a[-1] * w * time
        turns = 2 * pi() * 2**last
        phase -= turns * (phase / turns).to_integral_value()
        phi = _descended(phase, a, c)
        cn, sn = cosine_and_sine(phi)
        dn = (1 - k * k * sn * sn).sqrt()
        half_sine, speed = k * cn / dn, -2 * w * k * other * sn / dn
        return 2 * math.asin(float(half_sine)), float(speed)


def _descended(phase: Decimal, a: list[Decimal], c: list[Decimal]) -> Decimal:
    """Return φ_0 of φ_N, by sin(2 φ_{n−1} − φ_n) = c_n/a_n sin φ_n."""
    for n in range(len(a) - 1, 0, -1):
        phase = (phase + _arcsine(c[n] / a[n] * cosine_and_sine(phase)[1])) / 2
    return phase


def _arcsine(x: Decimal) -> Decimal:
    """Return asin x for |x| < 1 by Newton's method, starting from the float64 value."""
    found = Decimal(math.asin(float(x)))
    for _ in range(4):
        cos, sin = cosine_and_sine(found)
        found -= (sin - x) / cos
    return found


def _pair(pair: Pair) -> tuple[Decimal, Decimal]:
    return Decimal(pair[0]), Decimal(pair[1])


def struck(
    chain: Chain, q: Pair, u: Pair, friction: float, restitution: float, law: str = "stronge"
) -> tuple[float, float]:
    """Return u (rad/s) after an impact of D on a floor (normal −y), by Routh's construction.

    As the normal impulse grows, D slides with friction until it stops, then sticks. By Stronge's
    law the impact ends when e² of the work of compression is restored; by Kane and Levinson's law,
    with D sticking, the normal speed is multiplied by −e.
    """
    with digits():
        L1, L2 = _pair(chain.length)
        (c1, s1), (c2, s2) = (cosine_and_sine(Decimal(angle)) for angle in q)
        terms = _Terms(chain, q)
        across, along = (-L1 * c1, -L2 * c2), (-L1 * s1, -L2 * s2)
        speeds = _pair(u)
        G_nn, G_nt, G_tt = (
            _dot(row, terms.solved(*force))
            for row, force in ((across, across), (across, along), (along, along))
        )
        v_n, v_t = _dot(across, speeds), _dot(along, speeds)
        mu, e = Decimal(friction), Decimal(restitution)
        if law == "newton":
            det = G_nn * G_tt - G_nt * G_nt
            p = (-(1 + e) * v_n * G_tt + v_t * G_nt) / det
            s = (-v_t * G_nn + (1 + e) * v_n * G_nt) / det
            assert abs(s) <= mu * p
        else:
            s_first = -mu if v_t > 0 else mu
            length = -v_t / (G_nt + s_first * G_tt)
            middle = v_n + (G_nn + s_first * G_nt) * length
            k = G_nn - G_nt * G_nt / G_tt
            # Sliding must end before compression, and D must then stick.
            assert length >= 0 >= middle
            assert abs(G_nt) <= mu * G_tt
            taken = -(v_n + middle) * length / 2 + middle * middle / (2 * k)
            rest = -middle / k + e * (2 * taken / k).sqrt()
            p, s = length + rest, s_first * length - G_nt / G_tt * rest
        du1, du2 = terms.solved(p * across[0] + s * along[0], p * across[1] + s * along[1])
        return float(speeds[0] + du1), float(speeds[1] + du2)


def _dot(first: tuple[Decimal, Decimal], second: tuple[Decimal, Decimal]) -> Decimal:
    return first[0] * second[0] + first[1] * second[1]
