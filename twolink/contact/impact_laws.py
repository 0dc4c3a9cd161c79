"""Rigid impact of one point with friction, in the space of impulses (Routh's construction).

While a point is struck nothing moves, and velocities change linearly with the normal impulse p:

    dv_n/dp = G_nn + s G_nt,    dv_t/dp = G_nt + s G_tt,

where G = J M⁻¹ Jᵀ and s = dΛ_t/dp is −μ or +μ while the point slides forward or backward, and what
keeps v_t at 0 while it sticks. A slide that comes to rest sticks if friction can hold it, and else
reverses. So there are at most two phases, and every law of restitution ends them in closed form:
Poisson's when the impulse of restitution is e times that of compression, Stronge's when the normal
force has given back e² of the work it has taken, `newton-routh` when v_n is −e times what it was
(W. J. Stronge, Impact Mechanics, 2000, chapters 3 and 5).

`newton` is the older rule that books give under this name (T. R. Kane and D. A. Levinson, Dynamics,
1985): it asks v_n to become −e times what it was, and Coulomb's law of the impulse as a whole. The
point sticks if that impulse is in the cone, and else slides to the end as it does then. With
friction it can create energy. Numbers may be of any real kind.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from twolink.arithmetic import Scalar, sqrt

LAWS = ("newton", "newton-routh", "poisson", "stronge")


class Response(NamedTuple):
    """G = J M⁻¹ Jᵀ of a point: the velocities (m/s) that unit impulses along n and t give it."""

    nn: Scalar
    nt: Scalar
    tt: Scalar


class Impulse(NamedTuple):
    """Normal and tangential impulse (N s, or N m s at a joint), and how the point slid."""

    normal: Scalar
    tangential: Scalar
    regime: str


class _Phase(NamedTuple):
    """A stretch of the impulse: its length in p, s on it, and the slopes of v_n and v_t."""

    length: Scalar
    s: Scalar
    normal_slope: Scalar


def smooth_impulse(normal_speed: Scalar, response: Scalar, restitution: Scalar) -> Impulse:
    """Return the impulse without friction: then all three laws are one."""
    return Impulse(-(1 + restitution) * normal_speed / response, 0 * normal_speed, "frictionless")


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

    Any point of link 1 is such. It slides in while it is compressed, and out, against friction the
    other way, while the impulse is given back. Where μ |lever| ≥ 1 friction wedges it, and it
    stays.
    """
    slip = friction * abs(lever)
    inward, outward = response * (1 + slip), response * (1 - slip)
    brake = friction if lever > 0 else -friction
    compression = -normal_speed / inward
    if outward <= 0 or restitution == 0:
        return Impulse(compression, brake * compression, "sticks")
    if law == "newton":
        # Coulomb's law of the impulse as a whole, as the point slides at the end.
        whole = -(1 + restitution) * normal_speed / outward
        return Impulse(whole, -brake * whole, "slides back")
    given_back = {
        "newton-routh": -restitution * normal_speed / outward,
        "poisson": restitution * compression,
        "stronge": restitution * compression * sqrt(inward / outward),
    }[law]
    return Impulse(compression + given_back, brake * (compression - given_back), "slides back")


def rough_impulse(
    normal_speed: Scalar,
    tangential_speed: Scalar,
    response: Response,
    *,
    friction: Scalar,
    restitution: Scalar,
    law: str,
    determinant: Scalar | None = None,
) -> Impulse:
    """Return the impulse on a point that comes in at `normal_speed` ≤ 0 (m/s).

    `determinant` is that of G, where it is known better than as a difference: (det J)²/det M.

    At 0, which an impact without collision has (Painlevé), friction alone drives the compression.
    """
    G = response
    det = G.nn * G.tt - G.nt * G.nt if determinant is None else determinant
    if law == "newton":
        return _newtons_impulse(normal_speed, tangential_speed, G, det, friction, restitution)
    phases, regime = _phases(tangential_speed, G, det, friction)
    ends = {"newton-routh": _newtons_end, "poisson": _poissons_end, "stronge": _stronges_end}
    return _summed(phases, regime, ends[law](phases, normal_speed, restitution))


def _summed(phases: tuple[_Phase, _Phase], regime: tuple[str, str], p: Scalar) -> Impulse:
    """Return the normal impulse p with the tangential impulse that goes with it."""
    first, second = phases
    early = p if first.length is None or p <= first.length else first.length
    tangential = first.s * early + second.s * (p - early)
    slid = first.length is None or p <= first.length
    return Impulse(p, tangential, regime[0] if slid else regime[1])


def _newtons_impulse(
    v_n: Scalar, v_t: Scalar, G: Response, det: Scalar, mu: Scalar, e: Scalar
) -> Impulse:
    """Return the impulse after which v_n is −e v_n, by Coulomb's law of the whole impulse."""
    needed = -(1 + e) * v_n
    # Sticking: both velocities are known, and so are both impulses.
    normal, tangential = (G.tt * needed + G.nt * v_t) / det, (-G.nn * v_t - G.nt * needed) / det
    if normal >= 0 and abs(tangential) <= mu * normal:
        return Impulse(normal, tangential, "sticks")
    for sigma in (1, -1) if v_t > 0 else (-1, 1):
        slope = G.nn - sigma * mu * G.nt
        if slope > 0:
            normal = needed / slope
            tangential = -sigma * mu * normal
            if sigma * (v_t + G.nt * normal + G.tt * tangential) >= 0:
                back = v_t != 0 and (v_t > 0) != (sigma > 0)
                return Impulse(normal, tangential, "slides back" if back else "slides")
    # Only where the surface wedges the point is no impulse left: there it goes by its phases.
    phases, regime = _phases(v_t, G, det, mu)
    return _summed(phases, regime, _newtons_end(phases, v_n, e))


def _phases(
    v_t: Scalar, G: Response, det: Scalar, mu: Scalar
) -> tuple[tuple[_Phase, _Phase], tuple[str, str]]:
    """Return the two phases of an impact; the first has the length `None` if it has no end."""
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
    return (first, after), ("slides", f"slides, then {then}")


def _from_rest(G: Response, det: Scalar, mu: Scalar) -> tuple[_Phase, str]:
    """Return the phase that follows when the point has come to rest along the surface."""
    if abs(G.nt) <= mu * G.tt:
        s = -G.nt / G.tt
        # Near a straight pose G.nn + s G.nt is a small difference.
        return _Phase(None, s, det / G.tt), "sticks"
    s = -mu if G.nt > 0 else mu
    return _Phase(None, s, G.nn + s * G.nt), "slides back"


def _speed(phases: tuple[_Phase, _Phase], v0: Scalar) -> tuple[Scalar, Scalar]:
    """Return the normal speed at the end of the first phase, and its slope in the second."""
    first, second = phases
    return v0 + first.normal_slope * first.length, second.normal_slope


def _impulse_to(phases: tuple[_Phase, _Phase], v0: Scalar, v: Scalar) -> Scalar:
    """Return the impulse p at which the normal speed, rising at last, comes to v ≥ 0."""
    first, _ = phases
    if first.normal_slope > 0:
        p = (v - v0) / first.normal_slope
        if first.length is None or p <= first.length:
            return p
    middle, slope = _speed(phases, v0)
    return first.length + (v - middle) / slope


def _newtons_end(phases: tuple[_Phase, _Phase], v0: Scalar, e: Scalar) -> Scalar:
    return _impulse_to(phases, v0, -e * v0)


def _poissons_end(phases: tuple[_Phase, _Phase], v0: Scalar, e: Scalar) -> Scalar:
    return (1 + e) * _impulse_to(phases, v0, 0 * v0)


def _stronges_end(phases: tuple[_Phase, _Phase], v0: Scalar, e: Scalar) -> Scalar:
    """Return p where ∫ v_n dp from the end of compression is −e² times that up to it."""
    first, second = phases
    p_c = _impulse_to(phases, v0, 0 * v0)
    k1, k2 = first.normal_slope, second.normal_slope
    if k1 > 0 and (first.length is None or p_c <= first.length):
        # Compression takes k1 p_c²/2, and restitution may last into the second phase.
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
