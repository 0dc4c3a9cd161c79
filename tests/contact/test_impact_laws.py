"""Impacts of one point, against small steps, exact paths, published figures and the energy.

None of it repeats the phases of `twolink.contact.impact_laws`. The small steps have no cases;
the exact path only asks at every corner which friction Coulomb's law allows, and the laws of
restitution are put to it as they are worded, not as they are solved.
"""

import math
from fractions import Fraction
from typing import Any, NamedTuple

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mpmath.libmp import to_rational

from tests.conftest import SEED
from twolink import lagrange
from twolink.chain import Chain
from twolink.contact.impact_laws import (
    LAWS,
    Impulse,
    Response,
    guided_impulse,
    rough_impulse,
    smooth_impulse,
)
from twolink.loads import Force

# The laws that end an impact on its path; Newton's older one looks at the whole impulse.
PATH_LAWS = ("newton-routh", "poisson", "stronge")


DIGITS = 50
EPSILON = {
    float: np.finfo(float).eps,
    np.longdouble: float(np.finfo(np.longdouble).eps),
    mpmath.mpf: 10.0 ** (1 - DIGITS),
    Fraction: 0,
}
"""The relative round-off of one operation, in each kind of number."""

ROUNDINGS = 8
"""Bound on the error of an impulse, in roundings of the sum of its terms' sizes."""


class Blow(NamedTuple):
    """The data of an impact."""

    normal_speed: Any
    tangential_speed: Any
    response: Response
    friction: Any
    restitution: Any

    def to(self, number) -> "Blow":
        v_n, v_t, G, mu, e = self
        return Blow(number(v_n), number(v_t), Response(*map(number, G)), number(mu), number(e))

    def impulse(self, law: str) -> Impulse:
        v_n, v_t, G, mu, e = self
        return rough_impulse(v_n, v_t, G, friction=mu, restitution=e, law=law)

    def after(self, impulse: Impulse) -> tuple[Any, Any]:
        """Return the normal and the tangential speed that an impulse leaves."""
        (v_n, v_t, G, *_), (normal, tangential, _) = self, impulse
        return (
            v_n + G.nn * normal + G.nt * tangential,
            v_t + G.nt * normal + G.tt * tangential,
        )

    def gain(self, impulse: Impulse) -> Any:
        """Return the change of kinetic energy: an impulse times the mean speed it acts at."""
        after = self.after(impulse)
        return (
            impulse.normal * (self.normal_speed + after[0]) / 2
            + impulse.tangential * (self.tangential_speed + after[1]) / 2
        )

    def jams(self) -> bool:
        """Return whether sliding friction presses the point in harder than its push lifts it."""
        sigma = (self.tangential_speed > 0) - (self.tangential_speed < 0)
        return bool(self.response.nn < sigma * self.friction * self.response.nt)


# The exact path.


class Corner(NamedTuple):
    """Where an impact stands: impulses so far, speeds, and the work the normal force has done."""

    normal: Any
    tangential: Any
    normal_speed: Any
    tangential_speed: Any
    work: Any


def coulomb(v_t, G: Response, mu):
    """Return the friction per normal impulse that Coulomb's law allows from here on.

    Full friction is against the sliding; at rest, against the sliding it leaves. There is no
    such thing if the point sticks.
    """
    for sigma in (1, -1):
        if sigma * v_t > 0 or (v_t == 0 and sigma * (G.nt - sigma * mu * G.tt) > 0):
            return -sigma * mu
    return -G.nt / G.tt


def path(blow: Blow, end) -> list[Corner]:
    """Return the corners up to the normal impulse `end`: the start, each speed's zeros, the end."""
    v_n, v_t, G, mu, _ = blow
    corners = [Corner(0 * end, 0 * end, v_n, v_t, 0 * end)]
    while corners[-1].normal < end:
        p, tangential, v_n, v_t, work = corners[-1]
        s = coulomb(v_t, G, mu)
        slopes = G.nn + s * G.nt, G.nt + s * G.tt
        to_rest = [-v / k for v, k in zip((v_n, v_t), slopes, strict=True) if v * k < 0]
        step = min([end - p, *to_rest])
        rise = slopes[0] * step
        corners.append(
            Corner(
                p + step,
                tangential + s * step,
                v_n + rise,
                v_t + slopes[1] * step,
                work + (v_n + rise / 2) * step,
            )
        )
    return corners


def remainder(law: str, blow: Blow, end):
    """Return by how much a law of restitution is missed if the impact ends at `end`, and its unit.

    The unit is the sum of the sizes of all terms of speed or work: the scale of round-off.
    """
    corners = path(blow, end)
    last, e, G = corners[-1], blow.restitution, blow.response
    speed = -blow.normal_speed + G.nn * end + abs(G.nt) * blow.friction * end
    if law == "newton-routh":
        return last.normal_speed + e * blow.normal_speed, speed
    if law == "poisson":
        return path(blow, end / (1 + e))[-1].normal_speed, speed
    return last.work - (1 - e * e) * min(corner.work for corner in corners), speed * end


def exact(number) -> Fraction:
    """Return the rational number that a number of any kind is."""
    if isinstance(number, mpmath.mpf):
        return Fraction(*map(int, to_rational(number._mpf_)))
    if isinstance(number, np.longdouble):
        return Fraction(*map(int, number.as_integer_ratio()))
    return Fraction(number)


def assert_lawful(blow: Blow, law: str, number=float) -> None:
    """Check an impulse against the exact path of the same blow, to the rounding of its numbers."""
    with mpmath.workdps(DIGITS):
        blow = blow.to(number)
        impulse = blow.impulse(law)
    rounding = ROUNDINGS * Fraction(EPSILON[number])
    blow, p = blow.to(exact), exact(impulse.normal)
    corners = path(blow, p)
    start, last = corners[0], corners[-1]
    missed, unit = remainder(law, blow, p)
    assert abs(missed) <= rounding * unit
    G, mu = blow.response, blow.friction
    friction = (mu + abs(G.nt) / G.tt) * p
    assert abs(exact(impulse.tangential) - last.tangential) <= rounding * friction
    assert last.normal_speed >= -rounding * (G.nn + mu * abs(G.nt)) * p

    # The regime follows from the path, wherever rounding does not decide it.
    turned = next((c.normal for c in corners if c.tangential_speed == 0), None)
    if start.tangential_speed != 0 and turned is not None and turned >= p * (1 - rounding):
        return
    first = [] if start.tangential_speed == 0 else ["slides"]
    then = [] if turned is None else ["sticks" if last.tangential_speed == 0 else "slides back"]
    assert impulse.regime == ", then ".join(first + then)
    assert impulse.regime.ends_sticking == (then == ["sticks"])


def eighths(low: int, high: int) -> st.SearchStrategy[float]:
    """Floats of few bits, so that ties happen."""
    return st.integers(8 * low, 8 * high).map(lambda count: count / 8)


@st.composite
def blows(draw: st.DrawFn) -> Blow:
    """Impacts with any positive-definite G, at all angles, at rest along the surface too."""
    nn, tt = (draw(eighths(0, 8).filter(bool)) for _ in range(2))
    nt = draw(eighths(-8, 8))
    assume(nt * nt < nn * tt)
    v_n = -draw(eighths(0, 2).filter(bool))
    mu, e = draw(eighths(0, 2)), draw(eighths(0, 1))
    return Blow(v_n, draw(eighths(-4, 4)), Response(nn, nt, tt), mu, e)


@st.composite
def jams(draw: st.DrawFn) -> Blow:
    """Painlevé's case: it slides on the surface, v_n = 0, and friction presses it in."""
    blow = draw(blows())
    _, v_t, G, _, e = blow
    assume(v_t != 0 and G.nt != 0)
    jamming = G.nn / abs(G.nt) + draw(eighths(0, 2).filter(bool))
    return Blow(0.0, math.copysign(v_t, G.nt), G, jamming, e)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "law"),
    [
        (number, law)
        for number in EPSILON
        for law in PATH_LAWS
        if (number, law) != (Fraction, "stronge")
    ],
    ids=lambda value: getattr(value, "__name__", value),
)
@given(blow=st.one_of(blows(), jams()))
def test_every_law_is_kept_in_every_kind_of_number(number, law, blow):
    """In fractions exactly; Stronge's root leaves the rationals, and is held to 48 digits."""
    assert_lawful(blow, law, number)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("law", PATH_LAWS)
def test_every_law_is_kept_at_general_values(law, random):
    for _ in range(400):
        assert_lawful(general_blow(random), law)


def general_blow(random: np.random.Generator) -> Blow:
    """Return an impact whose G is of any size and shape, a tenth of them without sliding."""
    nn, tt = 10 ** random.uniform(-2, 2, 2)
    nt = random.uniform(-0.99, 0.99) * math.sqrt(nn * tt)
    v_n, v_t = -random.exponential() * nn, random.normal() * tt * (random.random() > 0.1)
    mu, e = random.uniform(0, 2), random.uniform(0, 1)
    return Blow(v_n, v_t, Response(nn, nt, tt), mu, e).to(float)


def test_kinds_of_number_agree_to_the_rounding_of_floats(random):
    """From the same floats; where p hangs on a difference, that takes its share of the digits."""
    for _ in range(200):
        blow = general_blow(random)
        _, _, G, mu, _ = blow
        lost = G.nn * (1 + mu) ** 2 / (G.nn - G.nt * G.nt / G.tt)
        for law in PATH_LAWS:
            one = blow.impulse(law)
            extended = blow.to(np.longdouble).impulse(law)
            with mpmath.workdps(DIGITS):
                truth = blow.to(mpmath.mpf).impulse(law)
                assert isinstance(extended.normal, np.longdouble)
                assert isinstance(truth.normal, mpmath.mpf)
            assert one.regime == extended.regime == truth.regime
            for number, impulse in ((float, one), (np.longdouble, extended)):
                allowed = ROUNDINGS * EPSILON[number] * lost * truth.normal * (1 + mu)
                assert abs(exact(impulse.normal) - exact(truth.normal)) <= exact(allowed)
                assert abs(exact(impulse.tangential) - exact(truth.tangential)) <= exact(allowed)


# Small steps.


def small_steps(blows: list[Blow], steps: int = 4000) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Return the impulses (p, Λt) of many blows under each law, and how far p may be off.

    Moreau's implicit steps: in each, friction stops the sliding if it is strong enough, and else
    it is all there is. Sticking, turning round and jamming come about by themselves. The error
    is at most part of a step, and friction's change of the normal speed while it reverses.
    """
    rows = [(v_n, v_t, *G, mu, e) for v_n, v_t, G, mu, e in blows]
    v_n, v_t, nn, nt, tt, mu, e = np.array(rows).T
    approach, firmness = v_n, nn - nt * nt / tt
    # No impulse takes longer, since until then the kinetic energy of the contact has not grown;
    # Newton's may, by at most the rebound's impulse against the least resistance.
    energy = (tt * v_n**2 - 2 * nt * v_n * v_t + nn * v_t**2) / (nn * tt - nt * nt)
    step = (2 * np.sqrt(energy / firmness) - v_n / firmness) / steps
    normal_speeds, tangentials = [v_n], [0 * v_n]
    for _ in range(steps):
        s = np.clip(-(v_t / step + nt) / tt, -mu, mu)
        v_n = v_n + (nn + s * nt) * step
        v_t = v_t + (nt + s * tt) * step
        normal_speeds.append(v_n)
        tangentials.append(tangentials[-1] + s * step)
    found = {law: np.empty((len(blows), 2)) for law in PATH_LAWS}
    for i, (speeds, impulses) in enumerate(
        zip(np.transpose(normal_speeds), np.transpose(tangentials), strict=True)
    ):
        p = step[i] * np.arange(steps + 1)
        work = np.append(0, np.cumsum((speeds[1:] + speeds[:-1]) / 2 * step[i]))
        # The speed falls at first if friction jams, the work until compression ends.
        up, out = np.argmin(speeds), np.argmin(work)
        compressed = np.interp(0, speeds[up:], p[up:])
        for law, end in (
            ("newton-routh", np.interp(-e[i] * approach[i], speeds[up:], p[up:])),
            ("poisson", (1 + e[i]) * compressed),
            ("stronge", np.interp((1 - e[i] ** 2) * work[out], work[out:], p[out:])),
        ):
            found[law][i] = end, np.interp(end, p, impulses)
    return found, step * (1 + 2 * mu * np.abs(nt) / firmness)


def test_small_steps_come_to_the_same_impulse(random):
    blows = [general_blow(random) for _ in range(400)]
    blows += [jammed for blow in blows[:200] if (jammed := blow._replace(normal_speed=0.0)).jams()]
    assert sum(blow.normal_speed == 0 for blow in blows) > 10
    found, allowed = small_steps(blows)
    friction = np.array(
        [blow.friction + abs(blow.response.nt) / blow.response.tt for blow in blows]
    )
    for law in PATH_LAWS:
        p, tangential = np.array([blow.impulse(law)[:2] for blow in blows]).T
        assert np.all(np.abs(found[law][:, 0] - p) <= allowed)
        assert np.all(np.abs(found[law][:, 1] - tangential) <= friction * allowed)
        # The steps are small: their error is a small part of most impulses.
        assert np.median(allowed / p) < 0.005


# Chains.


class Thrown(NamedTuple):
    """Random chains about to strike a wall with D; a row of each array is a chain."""

    M: np.ndarray
    J: np.ndarray
    u: np.ndarray
    friction: np.ndarray
    restitution: np.ndarray


class Struck(NamedTuple):
    """The results of impacts: impulses, speeds, kinetic energies and sliding regimes.

    `added` is the sum of the sizes of all terms of each speed, `work` that of all terms of the
    energy: times the round-off of one operation they bound the error.
    """

    impulse: np.ndarray
    speeds: np.ndarray
    energies: np.ndarray
    regimes: np.ndarray
    added: np.ndarray
    work: np.ndarray


ROUNDING = 100 * EPSILON[float]
"""Those of an impulse, and of the solutions with M, whose condition takes about a digit."""


def through(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return np.einsum("kij,kj->ki", matrices, vectors)


def throw(random: np.random.Generator, count: int) -> Thrown:
    """Draw chains of all shapes, in all poses, at walls of all directions."""
    masses, lengths, inertias = 10 ** random.uniform(-0.5, 0.5, (3, count, 2))
    centres = random.uniform(-1, 1, (count, 2, 2))
    q = random.uniform(-math.pi, math.pi, (count, 2))
    u = random.normal(size=(count, 2))
    walls = random.uniform(-math.pi, math.pi, count)
    M, J = np.empty((2, count, 2, 2))
    for k in range(count):
        chain = Chain(
            *(tuple(x[k].tolist()) for x in (masses, lengths)),
            centres[k].tolist(),
            tuple(inertias[k].tolist()),
        )
        M[k] = lagrange.mass_matrix(chain, q[k])
        along = math.cos(walls[k]), math.sin(walls[k])
        for row, direction in enumerate((along, (-along[1], along[0]))):
            load = (Force(chain.D, direction),)
            J[k, row] = lagrange.generalized_active_force(chain, q[k], load)
    # The wall is on the side to which D moves.
    J[:, 0] *= -np.sign(through(J, u)[:, :1])
    return Thrown(M, J, u, random.uniform(0, 2, count), random.uniform(0, 1, count))


def strike(thrown: Thrown, law: str) -> Struck:
    M, J, u, mu, e = thrown
    G = J @ np.linalg.solve(M, J.transpose(0, 2, 1))
    v = through(J, u)
    rows = np.column_stack([v, G[:, 0, 0], G[:, 0, 1], G[:, 1, 1], mu, e]).tolist()
    impulses = [
        Blow(v_n, v_t, Response(*response), friction, restitution).impulse(law)
        for v_n, v_t, *response, friction, restitution in rows
    ]
    impulse = np.array([found[:2] for found in impulses])
    after = u + np.linalg.solve(M, through(J.transpose(0, 2, 1), impulse)[..., None])[..., 0]
    T, T_after = (np.einsum("ki,kij,kj->k", w, M, w) / 2 for w in (u, after))
    added = np.abs(v) + through(np.abs(G), np.abs(impulse))
    return Struck(
        impulse,
        through(J, after),
        np.stack([T, T_after]),
        np.array([found.regime for found in impulses]),
        added,
        T + np.sum(added * np.abs(impulse), axis=1),
    )


@pytest.fixture(scope="module")
def thrown() -> Thrown:
    return throw(np.random.default_rng(SEED), 10_000)


@pytest.fixture(scope="module")
def struck(thrown) -> dict[str, Struck]:
    return {law: strike(thrown, law) for law in PATH_LAWS}


@pytest.mark.slow
@pytest.mark.parametrize("law", PATH_LAWS)
def test_impulses_of_chains_are_those_of_a_rough_wall(law, thrown, struck):
    """It pushes, friction is in its cone, nothing ends inside, and a sticking point is at rest."""
    normal, tangential = struck[law].impulse.T
    assert np.all(normal >= 0)
    assert np.all(np.abs(tangential) <= thrown.friction * normal * (1 + ROUNDING))
    assert np.all(struck[law].speeds[:, 0] >= -ROUNDING * struck[law].added[:, 0])
    sticks = np.char.endswith(struck[law].regimes, "sticks")
    left = np.abs(struck[law].speeds[:, 1])[sticks]
    assert np.all(left <= ROUNDING * struck[law].added[sticks, 1])
    kinds, counts = np.unique(struck[law].regimes, return_counts=True)
    assert set(kinds) == {"slides", "slides, then sticks", "slides, then slides back"}
    assert counts.min() > 500


@pytest.mark.parametrize("law", ["poisson", "stronge"])
def test_no_chain_gains_energy(law, struck):
    """With Stronge's law by definition: the normal force gives back less than it took.

    Nor with Poisson's in the plane. The path of v_n over p is bent once, where sliding stops. If
    that is in compression, at p_s, the normal force may give back (k2 − k1) p_s²/2 more than it
    took; but this is |G_nt|/G_tt (μ G_tt − |G_nt|) p_s²/2 if it sticks then, and friction took
    μ (μ G_tt − |G_nt|) p_s²/2 ≥ that on the way, since there is sticking only if μ ≥ |G_nt|/G_tt.
    In restitution the same holds with less than p_s; and where sliding turns round, k2 < k1.
    """
    before, after = struck[law].energies
    assert np.all(after - before <= ROUNDING * struck[law].work)
    assert np.any(after < 0.1 * before)


def test_newtons_law_gains_energy(struck):
    """It prescribes the rebound, even if friction has reduced the work of compression."""
    before, after = struck["newton-routh"].energies
    assert np.mean(after - before > ROUNDING * struck["newton-routh"].work) > 0.1
    assert np.max(after / before) > 100


@pytest.mark.parametrize("law", PATH_LAWS)
def test_an_elastic_impact_without_friction_keeps_the_energy(law, thrown):
    one = np.ones_like(thrown.friction)
    struck = strike(thrown._replace(friction=0 * one, restitution=one), law)
    before, after = struck.energies
    assert np.all(np.abs(after - before) <= ROUNDING * struck.work)
    assert np.all(struck.impulse[:, 1] == 0)


# Published figures.


@pytest.fixture(scope="module")
def bars() -> Thrown:
    """Kane and Levinson's impact: the end of two hanging bars comes down on the floor.

    Their angles, 20° and 30°, are from the vertical: q = π/2 − φ. Here y is down, so that the
    floor's normal is −y.
    """
    chain = Chain.uniform_bars()
    q = tuple(math.pi / 2 - math.radians(phi) for phi in (20, 30))
    ends = [(Force(chain.D, direction),) for direction in ((0.0, -1.0), (1.0, 0.0))]
    J = [lagrange.generalized_active_force(chain, q, loads) for loads in ends]
    fields = lagrange.mass_matrix(chain, q), J, (0.1, 0.2), 0.0, 0.0
    return Thrown(*(np.array([field]) for field in fields))


def test_published_arrival(bars):
    ((normal, tangential),) = through(bars.J, bars.u)
    assert round(normal, 8) == -0.13420201
    assert round(tangential, 8) == -0.26717434


def ratio_of_energies(bars: Thrown, law: str, friction: float, restitution: float) -> float:
    case = bars._replace(friction=np.array([friction]), restitution=np.array([restitution]))
    (before,), (after,) = strike(case, law).energies
    return after / before


@pytest.mark.parametrize(
    ("friction", "restitution", "law", "ratio"),
    [
        (0.5, 0.5, "poisson", 0.54508),
        (0.5, 0.5, "stronge", 0.55319),
        (0.5, 0.7, "poisson", 0.57167),
        (0.5, 0.7, "stronge", 0.60009),
        (0.7, 0.5, "poisson", 0.51695),
        (0.7, 0.5, "stronge", 0.52584),
    ],
)
def test_published_energies(bars, friction, restitution, law, ratio):
    """T after the impact to T before it, to every digit given."""
    assert round(ratio_of_energies(bars, law, friction, restitution), 5) == ratio


@pytest.mark.parametrize(
    ("friction", "then"), [(0.5, "slides back"), (0.62, "slides back"), (0.63, "sticks")]
)
def test_published_impact_stops_sliding(bars, friction, then):
    """|G_nt|/G_tt is 0.6234 there."""
    case = bars._replace(friction=np.array([friction]), restitution=np.array([0.5]))
    for law in PATH_LAWS:
        assert strike(case, law).regimes.tolist() == [f"slides, then {then}"]


@pytest.mark.parametrize(
    ("restitution", "published", "on_the_path"), [(0.5, 1.5875, 0.7372), (0.7, 2.7576, 0.9930)]
)
def test_published_gain_is_that_of_friction_put_to_the_whole_impulse(
    bars, restitution, published, on_the_path
):
    """Kane and Levinson's own rule joins Newton's law with friction by where the impact ends.

    It sticks if the whole impulse is then in the cone, and else all friction is against the last
    sliding. Newton's law on Routh's path is another: of this impact it makes no gain.
    """
    assert round(ratio_of_energies(bars, "newton", 0.5, restitution), 4) == published
    assert round(ratio_of_energies(bars, "newton-routh", 0.5, restitution), 4) == on_the_path


def test_newtons_law_of_the_whole_impulse(thrown):
    """It returns −e v_n, keeps Coulomb's law of the impulse, and creates energy now and then."""
    struck = strike(thrown, "newton")
    normal, tangential = struck.impulse.T
    v_n = through(thrown.J, thrown.u)[:, 0]
    w_n, w_t = struck.speeds.T
    size = struck.added[:, 1]
    assert np.all(np.abs(w_n + thrown.restitution * v_n) < 1e-11 * struck.added[:, 0])
    assert np.all(normal >= 0)
    assert np.all(np.abs(tangential) <= thrown.friction * normal * (1 + 1e-12))
    slides = np.abs(w_t) > 1e-9 * size
    against = -np.sign(w_t) * thrown.friction * normal
    np.testing.assert_allclose(tangential[slides], against[slides], rtol=1e-9)
    before, after = struck.energies
    gains = after - before > ROUNDING * struck.work
    assert 0.01 < np.mean(gains) < 0.5


# Thresholds, and where the laws are one.


@pytest.mark.parametrize("law", PATH_LAWS)
@pytest.mark.parametrize("lean", [1, -1])
@pytest.mark.parametrize("sliding", [0.0, -0.25])
def test_the_point_sticks_only_from_the_critical_friction_on(law, lean, sliding):
    """Within 1 % of |G_nt|/G_tt the regime changes, and on it the impulse does not jump."""
    G = Response(2.0, lean * 0.75, 1.5)
    blow = Blow(-1.0, lean * sliding, G, friction=0.5, restitution=0.75)
    before = "slides, then " if sliding else ""
    for friction, then in ((0.495, "slides back"), (0.5, "sticks"), (0.505, "sticks")):
        assert blow._replace(friction=friction).impulse(law).regime == before + then
    just_below = blow._replace(friction=math.nextafter(0.5, 0)).impulse(law)
    assert just_below.regime == before + "slides back"
    assert just_below[:2] == pytest.approx(blow.impulse(law)[:2], rel=1e-14)


@pytest.mark.parametrize("law", PATH_LAWS)
@pytest.mark.parametrize(
    ("v_t", "regime"),
    [(0.75, "slides"), (0.7500001, "slides"), (0.7499999, "slides, then sticks")],
)
@pytest.mark.parametrize("sigma", [1, -1])
def test_sliding_may_end_with_the_impact(law, sigma, v_t, regime):
    """With G = 1, e = μ = 1/2 and v_n = −1 the impulse is 3/2, which stops v_t = 3/4 exactly."""
    blow = Blow(-1.0, sigma * v_t, Response(1.0, 0.0, 1.0), friction=0.5, restitution=0.5)
    impulse = blow.impulse(law)
    assert impulse == (1.5, -sigma * min(v_t, 0.75), regime)
    assert sigma * blow.after(impulse)[1] == max(v_t - 0.75, 0)


@pytest.mark.parametrize(
    ("law", "p"),
    [("newton-routh", 1.0), ("poisson", 0.875), ("stronge", 0.5 + 0.75 / math.sqrt(3))],
)
@pytest.mark.parametrize("sigma", [1, -1])
def test_sliding_may_end_with_the_compression(law, p, sigma):
    """At p_c = 1/2, and then it sticks: v_n rises by 2 per impulse before, and by k = 3/2 after.

    With e = 3/4 Newton adds e/k, Poisson e p_c, and Stronge e √(p_c/k), as the work is p_c/2.
    """
    G = Response(1.75, -sigma * 0.5, 1.0)
    blow = Blow(-1.0, sigma * 0.5, G, friction=0.5, restitution=0.75)
    impulse = blow.impulse(law)
    tangential = sigma * (-0.25 + 0.5 * (p - 0.5))
    assert impulse[:2] == pytest.approx((p, tangential), rel=1e-15)
    assert impulse.regime == "slides, then sticks"


def test_laws_agree_if_normal_and_tangent_are_uncoupled(random):
    """With G_nt = 0 friction does not reach v_n, whether it stops the sliding or not."""
    regimes = set()
    for _ in range(300):
        blow = general_blow(random)
        blow = blow._replace(response=blow.response._replace(nt=0.0))
        assert_laws_are_one(blow)
        regimes.add(blow.impulse("stronge").regime)
    assert regimes == {"slides", "slides, then sticks", "sticks"}


def test_laws_are_one_without_friction(random):
    for _ in range(300):
        blow = general_blow(random)._replace(friction=0.0)
        assert_laws_are_one(blow)
        smooth = smooth_impulse(blow.normal_speed, blow.response.nn, blow.restitution)
        assert smooth.regime == "frictionless"
        assert smooth[:2] == pytest.approx(blow.impulse("stronge")[:2], rel=1e-14)


def test_laws_are_one_while_it_slides_one_way(random):
    """And where it does not, they are three."""
    for _ in range(300):
        blow = general_blow(random)
        impulses = [blow.impulse(law) for law in PATH_LAWS]
        if all(impulse.regime == "slides" for impulse in impulses):
            assert_laws_are_one(blow)
        elif blow.tangential_speed != 0:
            assert len({impulse.normal for impulse in impulses}) == 3


def assert_laws_are_one(blow: Blow) -> None:
    first, *others = (blow.impulse(law) for law in PATH_LAWS)
    for other in others:
        assert other[:2] == pytest.approx(first[:2], rel=1e-14)
        assert other.regime == first.regime


# Impact without collision.


@pytest.mark.slow_but_first
@pytest.mark.parametrize("law", PATH_LAWS)
@given(blow=jams())
def test_friction_that_jams_strikes_without_collision(law, blow):
    """Painlevé's case: it needs an impulse at v_n = 0, which stops the sliding and costs energy."""
    impulse = blow.impulse(law)
    assert blow.jams()
    assert impulse.normal > 0
    assert blow.gain(impulse) < 0
    G, p = blow.response, impulse.normal
    v_n, v_t = blow.after(impulse)
    rounding = ROUNDINGS * EPSILON[float] * p
    assert v_n >= -rounding * (G.nn + abs(G.nt) * blow.friction)
    if law == "newton-routh" or blow.restitution == 0:
        # A point that arrives at no speed leaves at none.
        assert v_n <= rounding * (G.nn + abs(G.nt) * blow.friction)
    else:
        assert v_n > 0
    assert v_t == pytest.approx(0, abs=rounding * (abs(G.nt) + G.tt * blow.friction))


@pytest.mark.slow_but_first
@pytest.mark.parametrize("law", PATH_LAWS)
@given(blow=jams())
def test_impact_without_collision_is_the_limit_of_collisions(law, blow):
    at_once = blow.impulse(law)
    nearly = blow._replace(normal_speed=-1e-12).impulse(law)
    assert nearly.regime == at_once.regime
    assert nearly[:2] == pytest.approx(at_once[:2], rel=1e-8)


@pytest.mark.parametrize("law", PATH_LAWS)
def test_sliding_that_does_not_jam_needs_no_impulse(law, random):
    for _ in range(300):
        blow = general_blow(random)._replace(normal_speed=0.0)
        if not blow.jams():
            assert blow.impulse(law)[:2] == (0, 0)


def guided_in_steps(lever, friction, restitution, law, steps=200_000):
    """The path of a point on a line, G_nn = 1, coming in at −1, in small steps of the impulse."""
    v, p, tangential, taken, back, squeezed, dp = -1.0, 0.0, 0.0, 0.0, 0.0, None, 2 / steps
    while True:
        s = -friction * np.sign(lever * v)
        dv = (1 + s * lever) * dp
        if v < 0 <= v + dv:
            squeezed = p
            if 1 - friction * abs(lever) <= 0:
                return p, tangential
            v = 0.0
            s = -friction * np.sign(lever)
            dv = (1 + s * lever) * dp
        ends = {
            "newton-routh": v >= restitution,
            "poisson": squeezed is not None and p - squeezed >= restitution * squeezed,
            "stronge": squeezed is not None and back >= restitution**2 * taken,
        }
        if squeezed is not None and ends[law]:
            return p, tangential
        if squeezed is None:
            taken -= (v + dv / 2) * dp
        else:
            back += (v + dv / 2) * dp
        v, p, tangential = v + dv, p + dp, tangential + s * dp


@pytest.mark.slow_but_first
@pytest.mark.parametrize("law", PATH_LAWS)
@pytest.mark.parametrize("lever", [-3.0, -0.4, 0.7, 2.5])
@pytest.mark.parametrize("restitution", [0.0, 0.6])
def test_the_impulse_of_a_guided_point_is_that_of_small_steps(law, lever, restitution):
    found = guided_impulse(-1.0, 1.0, lever, friction=0.5, restitution=restitution, law=law)
    path = guided_in_steps(lever, 0.5, restitution, law)
    assert found[:2] == pytest.approx(path, abs=1e-4)
    speed = -1 + found.normal + lever * found.tangential
    assert (speed == pytest.approx(0, abs=1e-12)) == (found.regime == "sticks")


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("lever", [-1.3, -0.4, 0.7, 1.5])
def test_a_guided_point_is_the_limit_of_a_nearly_singular_response(law, lever):
    """Without wedging; the inertia against motion aside tends to infinity."""
    G = Response(2.0, 2.0 * lever, 2.0 * lever**2 * (1 + 1e-9))
    near = rough_impulse(-0.7, -0.7 * lever, G, friction=0.5, restitution=0.6, law=law)
    found = guided_impulse(-0.7, 2.0, lever, friction=0.5, restitution=0.6, law=law)
    assert found[:2] == pytest.approx(near[:2], rel=1e-7)
