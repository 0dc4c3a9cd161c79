"""The 113-bit references against heyoka's Lagrangian, a published state, and conservation laws."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.verification.chains import GENERAL
from twolink.chain import Chain
from twolink.hardcases import stored_references
from twolink.hardcases.reference_integrator import ReferenceMotion
from twolink.optional import heyoka

BARS = Chain.uniform_bars()


def test_the_state_at_ten_seconds_that_256_bits_give():
    """Every input taken as its float64 number; all digits that float64 has are right."""
    states = ReferenceMotion(BARS, (0.3, -0.4), (0.1, 0.2), 10.0).states([0.0, 10.0])
    expected = [
        0.63169544965324369677714,
        14.846153572263320406222,
        1.6832078686201083588420,
        7.1716794367334515948596,
    ]
    assert [*states.q[:, 1], *states.u[:, 1]] == expected


def test_the_equations_are_those_of_heyokas_lagrangian():
    """At some states, with springs, dampers and gravity in both directions: to 1e-30."""
    hy = heyoka()
    reference = ReferenceMotion(
        GENERAL,
        (0.3, -0.4),
        (0.1, 0.2),
        1.0,
        gravity=(1.5, 9.81),
        stiffness=(2.0, 3.0),
        rest=(0.1, -0.2),
        damping=(0.4, 0.5),
    )
    variables = hy.make_vars("q1", "q2", "v1", "v2")
    rates = [right for _, right in reference._equations(hy, variables, False)]
    number = reference._number
    chain = GENERAL.convert(number)
    (q1, q2), (v1, v2) = variables[:2], variables[2:]
    (a1, b1), (a2, b2) = chain.centre
    first = (a1 * hy.cos(q1) - b1 * hy.sin(q1), a1 * hy.sin(q1) + b1 * hy.cos(q1))
    second = (
        chain.L1 * hy.cos(q1) + a2 * hy.cos(q2) - b2 * hy.sin(q2),
        chain.L1 * hy.sin(q1) + a2 * hy.sin(q2) + b2 * hy.cos(q2),
    )
    half = number(1) / number(2)
    T = half * chain.I_C1 * v1 * v1 + half * chain.I_C2 * v2 * v2
    V = half * number(2.0) * (q1 - number(0.1)) * (q1 - number(0.1))
    V = V + half * number(3.0) * (q2 - q1 - number(-0.2)) * (q2 - q1 - number(-0.2))
    D = half * number(0.4) * v1 * v1 + half * number(0.5) * (v2 - v1) * (v2 - v1)
    for mass, place in zip(chain.mass, (first, second), strict=True):
        for x, g in zip(place, (1.5, 9.81), strict=True):
            rate = hy.diff(x, q1) * v1 + hy.diff(x, q2) * v2
            T, V = T + half * mass * rate * rate, V - mass * number(g) * x
    theirs = [right for _, right in hy.lagrangian(T - V, [q1, q2], [v1, v2], D)]
    ours, lagrangian = (
        hy.cfunc(system, vars=variables, fp_type=hy.real128) for system in (rates, theirs)
    )
    random = np.random.default_rng(7)
    for _ in range(20):
        state = np.array([number(x) for x in random.uniform(-3, 3, 4)])
        for mine, other in zip(ours(state), lagrangian(state), strict=True):
            assert abs(mine - other) < 1e-30 * max(1.0, abs(float(other)))


def test_torques_are_followed_from_piece_to_piece():
    """A balanced chain without gravity: the moments are the torques', and all is a polynomial."""
    chain = Chain((1.0, 1.0), (1.0, 1.0), ((0.5, 0.0), (0.0, 0.0)), (0.75, 0.5))
    torques = ((0.0, (2.0, 0.0), (0.0, 0.0)), (1.0, (0.0, 0.5), (4.0, 0.0)))
    reference = ReferenceMotion(
        chain, (0.0, 0.0), (0.0, 0.0), 2.0, gravity=(0.0, 0.0), torques=torques
    )
    expected = reference.states([0.0, 0.5, 1.0, 1.5, 2.0])
    # du1 = 1, then (4 s − 1/2)/2 with s = t − 1; du2 = 0, then 1.
    assert expected.u[0] == pytest.approx([0, 0.5, 1, 1 + 0.25 - 0.125, 1 + 1 - 0.25], abs=1e-15)
    assert expected.u[1] == pytest.approx([0, 0, 0, 0.5, 1], abs=1e-15)
    assert expected.q[1] == pytest.approx([0, 0, 0, 0.125, 0.5], abs=1e-15)


def test_an_elastic_floor_conserves_energy():
    """Bars that fall on a stiff floor and fly off: D is a little below it, and the energy stays."""
    y, k = 1.2, 1e8
    reference = ReferenceMotion(BARS, (0.3, -0.2), (0.0, 0.0), 0.7, presses=k, floor=y)
    expected = reference.states(np.linspace(0.0, 0.7, 8))
    q, u = expected.q, expected.u
    M12 = np.cos(q[1] - q[0]) / 2
    T = (4 / 3 * u[0] ** 2 + u[1] ** 2 / 3) / 2 + M12 * u[0] * u[1]
    V = -9.81 * (1.5 * np.sin(q[0]) + 0.5 * np.sin(q[1]))
    depth = np.maximum(np.sin(q[0]) + np.sin(q[1]) - y, 0.0)
    E = T + V + k / 2 * depth**2
    assert np.abs(E - E[0]).max() < 1e-12
    free = replace(reference, presses=0.0, _made={}).states([0.0, 0.7])
    assert np.abs(free.q[:, -1] - q[:, -1]).max() > 0.1
    assert depth.max() < 1e-3


def test_growth_is_that_of_the_unstable_pose():
    """From upright rest of a pendulum an error grows as cosh(w t), and its rate as w sinh(w t)."""
    chain = Chain((0.5, 0.5), (1.0, 1.0), ((1.0, 0.0), (0.0, 0.0)), (0.0, 0.1))
    reference = ReferenceMotion(chain, (0.0, 0.0), (0.0, 0.0), 2.0, gravity=(-9.81, 0.0))
    w = math.sqrt(9.81)
    expected = [1.0] + [
        (w * w * math.sinh(w * t) / w + w / w * math.cosh(w * t)) for t in (1.0, 2.0)
    ]
    # The start's u is moved as well, by as much: u = w sinh(w t) + cosh(w t).
    assert reference.growth([0.0, 1.0, 2.0]) == pytest.approx(expected, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("stiff-spring", 2),
        pytest.param("spin", 2, marks=pytest.mark.slow),
        pytest.param("chaos", 2, marks=pytest.mark.slow),
    ],
)
def test_stored_references_are_reproduced(name, count):
    """Without the longest, zero-gravity, which conserves energy and momentum."""
    made = stored_references.computed(name, count)
    expected, growth = stored_references.stored(name)
    assert expected.t.tolist() == stored_references.times(name).tolist()
    for key, kept in (("q", expected.q), ("u", expected.u)):
        assert np.array(made[key]).tolist() == kept[:, :count].tolist()
    assert made["growth"] == pytest.approx(growth[:count].tolist(), rel=1e-6)
