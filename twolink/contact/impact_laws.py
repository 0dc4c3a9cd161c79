"""Rigid impact of one point with friction, in the space of impulses (Routh's construction).

During an impact positions are constant, and velocities are linear in the normal impulse p:

    dv_n/dp = G_nn + s G_nt,    dv_t/dp = G_nt + s G_tt,

with G = J M⁻¹ Jᵀ. The ratio s = dΛ_t/dp is −μ or +μ while the point slides forward or backward,
and the value that keeps v_t = 0 while it sticks. A slide that comes to rest sticks if friction can
hold it, and reverses otherwise. So there are at most two phases, and each law of restitution
determines their end in closed form: Poisson's where the impulse of restitution is e times that of
compression, Stronge's where the normal force has returned e² of the work it has absorbed,
`newton-routh` where v_n is −e times its initial value (W. J. Stronge, Impact Mechanics, 2000,
chapters 3 and 5).

`newton` is the textbook rule of this name (T. R. Kane and D. A. Levinson, Dynamics, 1985): v_n
becomes −e times its initial value, and the total impulse obeys Coulomb's law. The point sticks if
that impulse is inside the friction cone; otherwise it slides at the end. With friction this rule
can create energy. Numbers may be of any real kind.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Any, NamedTuple

from twolink.arithmetic import Scalar, sqrt

LAWS = ("newton", "newton-routh", "poisson", "stronge")


class Regime(StrEnum):
    """How a point slides during an impact; the value is its description.

    `BOUNCES_DIE_AWAY` is that of one impact in place of all bounces beyond a Zeno limit.
    """

    FRICTIONLESS = "frictionless"
    STICKS = "sticks"
    SLIDES = "slides"
    SLIDES_BACK = "slides back"
    SLIDES_THEN_STICKS = "slides, then sticks"
    SLIDES_THEN_BACK = "slides, then slides back"
    BOUNCES_DIE_AWAY = "bounces die away"

    @property
    def ends_sticking(self) -> bool:
        """Whether the point sticks at the end."""
        return self is Regime.STICKS or self is Regime.SLIDES_THEN_STICKS


# The regime of an impact that slides first, by that of its second phase.
_AFTER_A_SLIDE = {
    Regime.STICKS: Regime.SLIDES_THEN_STICKS,
    Regime.SLIDES_BACK: Regime.SLIDES_THEN_BACK,
}


class Response(NamedTuple):
    """G = J M⁻¹ Jᵀ of a point: the velocities (m/s) that unit impulses along n and t give it."""

    nn: Scalar
    nt: Scalar
    tt: Scalar


class Impulse(NamedTuple):
    """Normal and tangential impulse (N s, or N m s at a joint), and how the point slid."""

    normal: Scalar
    tangential: Scalar
    regime: Regime


class _Phase(NamedTuple):
    """A stretch of the impulse: its length in p, s on it, and the slope of v_n.

    `begins` is v_n at its beginning, where that is known.
    """

    length: Scalar
    s: Scalar
    normal_slope: Scalar
    begins: Scalar | None = None


def smooth_impulse(normal_speed: Scalar, response: Scalar, restitution: Scalar) -> Impulse:
    """Return the impulse without friction, for which all laws agree."""
    return Impulse(
        -(1 + restitution) * normal_speed / response, 0 * normal_speed, Regime.FRICTIONLESS
    )


def guided_impulse(
    normal_speed: Scalar,
    response: Scalar,
    lever: Scalar,
    *,
    friction: Scalar,
    restitution: Scalar,
    law: str,
) -> Impulse:
    """Return the impulse on a point that can move along one line only: v_t = `lever` · v_n.

    Points of link 1 are of this kind. The point slides one way during compression and the other
    way during restitution. With μ |lever| ≥ 1 friction jams it, and it does not rebound.
    """
    slip = friction * abs(lever)
    inward, outward = response * (1 + slip), response * (1 - slip)
    brake = friction if lever > 0 else -friction
    compression = -normal_speed / inward
    if outward <= 0 or restitution == 0:
        return Impulse(compression, brake * compression, Regime.STICKS)
    if law == "newton":
        # Coulomb's law for the total impulse, with the direction of sliding at the end.
        whole = -(1 + restitution) * normal_speed / outward
        return Impulse(whole, -brake * whole, Regime.SLIDES_BACK)
    given_back = {
        "newton-routh": -restitution * normal_speed / outward,
        "poisson": restitution * compression,
        "stronge": restitution * compression * sqrt(inward / outward),
    }[law]
    return Impulse(compression + given_back, brake * (compression - given_back), Regime.SLIDES_BACK)


def rough_impulse(
    normal_speed: Scalar,
    tangential_speed: Scalar,
    response: Response,
    *,
    friction: Scalar,
    restitution: Scalar,
    law: str,
    determinant: Scalar | None = None,
    stopping: tuple[Scalar, Scalar] | None = None,
) -> Impulse:
    """Return the impulse on a point that approaches at `normal_speed` ≤ 0 (m/s).

    At 0, in an impact without collision (Painlevé), friction alone drives the compression. The
    caller may know some numbers without cancellation: `determinant` is det G = (det J)²/det M, and
    `stopping` are the normal and the tangential impulse that bring the point to rest.
    """
    G = response
    det = G.nn * G.tt - G.nt * G.nt if determinant is None else determinant
    if law == "newton":
        speeds = normal_speed, tangential_speed
        stops = _stopping(speeds, G, det) if stopping is None else stopping
        return _newtons_impulse(speeds, G, det, stops, friction, restitution)
    phases, regime = _phases(tangential_speed, G, det, friction)
    if stopping is not None and regime[1] in (Regime.STICKS, Regime.SLIDES_THEN_STICKS):
        first, then = phases
        if first.length is not None:
            # Near a straight pose, v0 + slope · length cancels. The stopping impulse gives this
            # speed without that.
            begins = (first.length - stopping[0]) * then.normal_slope
            phases = first, then._replace(begins=begins)
    ends = {"newton-routh": _newtons_end, "poisson": _poissons_end, "stronge": _stronges_end}
    return _summed(phases, regime, ends[law](phases, normal_speed, restitution))


def _summed(phases: tuple[_Phase, _Phase], regime: tuple[Regime, Regime], p: Scalar) -> Impulse:
    """Return the impulse with normal part p and the tangential part that the phases give."""
    first, second = phases
    early = p if first.length is None or p <= first.length else first.length
    tangential = first.s * early + second.s * (p - early)
    slid = first.length is None or p <= first.length
    return Impulse(p, tangential, regime[0] if slid else regime[1])


def _stopping(speeds: tuple[Scalar, Scalar], G: Response, det: Scalar) -> tuple[Scalar, Scalar]:
    """Return the normal and the tangential impulse that bring a point to rest."""
    v_n, v_t = speeds
    return (G.nt * v_t - G.tt * v_n) / det, (G.nt * v_n - G.nn * v_t) / det


def _newtons_impulse(
    speeds: tuple[Scalar, Scalar],
    G: Response,
    det: Scalar,
    stops: tuple[Scalar, Scalar],
    mu: Scalar,
    e: Scalar,
) -> Impulse:
    """Return the impulse that reverses v_n to −e v_n, with Coulomb's law for the total impulse."""
    v_n, v_t = speeds
    needed = -(1 + e) * v_n
    # Sticking: both velocities are known, and so are both impulses.
    back = -e * v_n / det
    normal, sticking = stops[0] + G.tt * back, stops[1] - G.nt * back
    if normal >= 0 and abs(sticking) <= mu * normal:
        return Impulse(normal, sticking, Regime.STICKS)
    for sigma in (1, -1) if v_t > 0 else (-1, 1):
        slope = G.nn - sigma * mu * G.nt
        if slope > 0:
            normal = needed / slope
            tangential = -sigma * mu * normal
            # Both impulses give this v_n. v_t after sticking is zero, so that v_t here is det/G_nn
            # times the difference of the tangential impulses.
            if sigma * (tangential - sticking) >= 0:
                turns = v_t != 0 and (v_t > 0) != (sigma > 0)
                return Impulse(normal, tangential, Regime.SLIDES_BACK if turns else Regime.SLIDES)
    # If the surface jams the point no such impulse exists; integrate the phases instead.
    phases, regime = _phases(v_t, G, det, mu)
    return _summed(phases, regime, _newtons_end(phases, v_n, e))


def _phases(
    v_t: Scalar, G: Response, det: Scalar, mu: Scalar
) -> tuple[tuple[_Phase, _Phase], tuple[Regime, Regime]]:
    """Return the two phases of an impact; the first has length None if it does not end."""
    after, then = _from_rest(G, det, mu)
    if v_t == 0:
        # At rest from the start: the first phase is empty.
        return (_Phase(0 * G.nn, after.s, after.normal_slope), after), (then, then)
    sigma = 1 if v_t > 0 else -1
    s = -sigma * mu
    tangential_slope = G.nt + s * G.tt
    stops = sigma * tangential_slope < 0
    length: Any = -v_t / tangential_slope if stops else None
    first = _Phase(length, s, G.nn + s * G.nt)
    return (first, after), (Regime.SLIDES, _AFTER_A_SLIDE[then])


def _from_rest(G: Response, det: Scalar, mu: Scalar) -> tuple[_Phase, Regime]:
    """Return the phase after the point has come to rest along the surface."""
    if abs(G.nt) <= mu * G.tt:
        s = -G.nt / G.tt
        # Near a straight pose G.nn + s G.nt is a small difference.
        return _Phase(None, s, det / G.tt), Regime.STICKS
    s = -mu if G.nt > 0 else mu
    return _Phase(None, s, G.nn + s * G.nt), Regime.SLIDES_BACK


def _speed(phases: tuple[_Phase, _Phase], v0: Scalar) -> tuple[Scalar, Scalar]:
    """Return the normal speed at the end of the first phase, and its slope in the second."""
    first, second = phases
    if second.begins is not None:
        return second.begins, second.normal_slope
    return v0 + first.normal_slope * first.length, second.normal_slope


def _impulse_to(phases: tuple[_Phase, _Phase], v0: Scalar, v: Scalar) -> Scalar:
    """Return the impulse p at which the normal speed rises to v ≥ 0."""
    first, _ = phases
    if _rises_in_first(phases, v0, v):
        return (v - v0) / first.normal_slope
    middle, slope = _speed(phases, v0)
    return first.length + (v - middle) / slope


def _rises_in_first(phases: tuple[_Phase, _Phase], v0: Scalar, v: Scalar) -> bool:
    """Return whether the normal speed rises to v in the first phase."""
    first, _ = phases
    if not first.normal_slope > 0:
        return False
    return first.length is None or bool(v <= _speed(phases, v0)[0])


def _newtons_end(phases: tuple[_Phase, _Phase], v0: Scalar, e: Scalar) -> Scalar:
    return _impulse_to(phases, v0, -e * v0)


def _poissons_end(phases: tuple[_Phase, _Phase], v0: Scalar, e: Scalar) -> Scalar:
    return (1 + e) * _impulse_to(phases, v0, 0 * v0)


def _stronges_end(phases: tuple[_Phase, _Phase], v0: Scalar, e: Scalar) -> Scalar:
    """Return p where ∫ v_n dp from the end of compression is −e² times that before it."""
    first, second = phases
    p_c = _impulse_to(phases, v0, 0 * v0)
    if e == 0:
        return p_c
    k1, k2 = first.normal_slope, second.normal_slope
    if _rises_in_first(phases, v0, 0 * v0):
        # Compression absorbs k1 p_c²/2, and restitution may last into the second phase.
        given_back = e * e * k1 * p_c * p_c / 2
        q = e * p_c
        if first.length is None or p_c + q <= first.length:
            return p_c + q
        left = first.length - p_c
        v, rest = k1 * left, given_back - k1 * left * left / 2
        return first.length + 2 * rest / (v + sqrt(v * v + 2 * k2 * rest))
    # The slide ends in compression, which then goes on from the speed `middle` < 0.
    middle, _ = _speed(phases, v0)
    taken = -(v0 + middle) * first.length / 2 + middle * middle / (2 * k2)
    return p_c + e * sqrt(2 * taken / k2)
