"""The laws of impact: nothing moves while a contact is struck, and speeds follow its impulse p.

With G = J M⁻¹ Jᵀ of the contact's normal n and tangent t and s = dΛ_t/dp of the tangential impulse,

    dv_n/dp = G_nn + s G_nt,    dv_t/dp = G_nt + s G_tt.

Here the impulse is followed stretch by stretch: to the end of a slide, of compression, or of all.
"""

import math
from dataclasses import dataclass

import numpy as np

from tests.judge.equations import Contact, dot, plus, solve_mass
from tests.judge.modes import ZERO_GAP, JudgeGivesUp, sign_of_speed

# Strikes that answer each other at one instant.
MOST_STRIKES = 1000


@dataclass(frozen=True)
class Strike:
    """An impact at a time (s) on the contact of this name, with u (rad/s) before and after."""

    time: float
    name: str
    before: tuple[float, float]
    after: tuple[float, float]


@dataclass
class _Blow:
    """Where an impact stands: speeds, impulses, and the work that the normal force has taken."""

    v_n: float
    v_t: float
    p: float = 0.0
    p_t: float = 0.0
    taken: float = 0.0
    compressed: float | None = None
    to_give: float = 0.0


def strike_all(system, t, q, u):
    """Return u after all impacts at this instant, and the strikes.

    The one with the most energy of approach is the first, and of equal ones that with the least
    restitution, and then the first by name.
    """
    strikes = []
    for _ in range(MOST_STRIKES):
        approaching = _approaching(system, q, u)
        if not approaching:
            return u, strikes
        energies = {i: energy_of_approach(system, i, q, v) for i, v in approaching.items()}
        equal = [
            i for i, energy in energies.items() if energy > (1 - 1e-9) * max(energies.values())
        ]
        index = min(equal, key=lambda i: (system.elements[i].restitution, system.names[i]))
        after = tuple(map(float, struck(system, index, q, u)))
        strikes.append(Strike(t, system.names[index], u, after))
        u = after
    # They answer each other without end, ever more weakly: in the limit all come to rest.
    contacts = {system.names.index(strike.name) for strike in strikes}
    rows = [system.elements[i].direction.row(q) for i in contacts]
    return without_speeds(rows, u), strikes


def _approaching(system, q, u):
    """Return the normal speeds of the contacts that are touched and run into, by number."""
    found = {}
    for index, element in enumerate(system.elements):
        if isinstance(element, Contact) and abs(element.gap(q)) <= ZERO_GAP:
            row = element.direction.row(q)
            if sign_of_speed(row, u) < 0:
                found[index] = dot(row, u)
    return found


def energy_of_approach(system, index, q, speed):
    """Return v²/(2 G) for a normal speed v and its change G by a unit of normal impulse."""
    n = system.elements[index].direction.row(q)
    return speed * speed / (2 * dot(n, solve_mass(system.mass_matrix(q), n)))


def struck(system, index, q, u):
    """Return u after an impact on a contact."""
    contact, M = system.elements[index], system.mass_matrix(q)
    n = contact.direction.row(q)
    v_n, e = dot(n, u), contact.restitution
    response = solve_mass(M, n)
    if contact.tangent is None:
        after = plus(u, -(1 + e) * v_n / dot(n, response), response)
        return after if e else without_speeds([n], after)
    t = contact.tangent.row(q)
    if abs(n[0] * t[1] - n[1] * t[0]) <= 1e-14 * (abs(n[0] * t[1]) + abs(n[1] * t[0])):
        lever = dot(t, n) / dot(n, n)
        v_after = rebound_on_a_line(v_n, lever, contact)
        after = plus(u, (v_after - v_n) / dot(n, response), response)
        return after if v_after else without_speeds([n], after)
    G = (dot(n, response), dot(t, response), dot(t, solve_mass(M, t)))
    p, p_t, v_n_after, v_t_after = rough_impulse(v_n, dot(t, u), G, contact)
    after = plus(plus(u, p, response), p_t, solve_mass(M, t))
    still = [row for row, v in ((n, v_n_after), (t, v_t_after)) if v == 0]
    return without_speeds(still, after)


def without_speeds(rows, u):
    """Return the u nearest to one that has no speed along some rows; it was small already."""
    rows = [row for row in rows if np.hypot(*row) > 1e-9]
    if not rows:
        return u
    R = np.array([np.array(row) / np.hypot(*row) for row in rows])
    if np.linalg.matrix_rank(R, tol=1e-9) == 2:
        return 0.0, 0.0
    x, y = R[0].tolist()
    return plus(u, -(x * u[0] + y * u[1]), (x, y))


def settled(system, q, u):
    """Return u without the round-off in the speeds of elements at rest."""
    rows = []
    for element in system.elements:
        if isinstance(element, Contact):
            row = element.direction.row(q)
            if abs(element.gap(q)) > ZERO_GAP or sign_of_speed(row, u):
                continue
            rows.append(row)
            along = None if element.guided else element.tangent
        else:
            along = element.direction
        if along is not None and not sign_of_speed(along.row(q), u):
            rows.append(along.row(q))
    return without_speeds(rows, u)


def rebound_on_a_line(v_n, lever, contact):
    """Return the normal speed after an impact on a point that moves along one line only.

    The sliding speed is `lever` v_n: friction resists the way in, and then the way out.
    """
    e, slip = contact.restitution, contact.kinetic * abs(lever)
    if slip >= 1 or e == 0:
        return 0.0
    if contact.law in ("newton", "newton-routh"):
        return -e * v_n
    if contact.law == "poisson":
        # p_c = −v_n / (G (1 + slip)), and v = e p_c G (1 − slip).
        return -e * v_n * (1 - slip) / (1 + slip)
    # v² / (1 − slip) = e² v_n² / (1 + slip).
    return -e * v_n * math.sqrt((1 - slip) / (1 + slip))


def rough_impulse(v_n, v_t, G, contact):
    """Return p and Λ_t (N s) of an impact with friction, and v_n and v_t (m/s) after it."""
    if contact.law == "newton":
        return _kane_levinson(v_n, v_t, G, contact.kinetic, contact.restitution)
    blow = _Blow(v_n, v_t)
    for _ in range(10):
        s = _slope(blow.v_t, G, contact.kinetic)
        k_n, k_t = G[0] + s * G[1], G[1] + s * G[2]
        if blow.v_t == 0 and abs(G[1]) <= contact.kinetic * G[2]:
            k_t = 0.0
        ends = {"stop": -blow.v_t / k_t if blow.v_t * k_t < 0 else math.inf}
        if blow.compressed is None:
            ends["compressed"] = -blow.v_n / k_n if k_n > 0 else math.inf
        else:
            ends["over"] = _left(blow, k_n, v_n, contact)
        end = min(ends, key=ends.get)
        if ends[end] == math.inf:
            raise JudgeGivesUp("an impact without end")
        _follow(blow, ends[end], s, k_n, k_t)
        if end == "stop":
            blow.v_t = 0.0
        elif end == "compressed":
            blow.v_n, blow.compressed = 0.0, blow.p
            blow.to_give = contact.restitution**2 * blow.taken
            if contact.restitution == 0:
                return blow.p, blow.p_t, 0.0, blow.v_t
        else:
            return blow.p, blow.p_t, blow.v_n, blow.v_t
    raise JudgeGivesUp("an impact without end")


def _slope(v_t, G, mu):
    """Return s: against the slide, or holding the point, or against the beginning slide."""
    if v_t != 0:
        return -math.copysign(mu, v_t)
    if abs(G[1]) <= mu * G[2]:
        return -G[1] / G[2]
    return -math.copysign(mu, G[1])


def _left(blow, k_n, v_n0, contact):
    """Return the normal impulse that is left of restitution, if the slope stays as it is."""
    if contact.law == "newton-routh":
        return (-contact.restitution * v_n0 - blow.v_n) / k_n if k_n > 0 else math.inf
    if contact.law == "poisson":
        return (1 + contact.restitution) * blow.compressed - blow.p
    # v_n x + k_n x²/2 = the energy of restitution.
    root = blow.v_n**2 + 2 * k_n * blow.to_give
    if root < 0 or blow.v_n + math.sqrt(root) <= 0:
        return math.inf
    return 2 * blow.to_give / (blow.v_n + math.sqrt(root))


def _follow(blow, x, s, k_n, k_t):
    """Let the normal impulse grow by x."""
    work = blow.v_n * x + k_n * x * x / 2
    if blow.compressed is None:
        blow.taken -= work
    else:
        blow.to_give -= work
    blow.v_n += k_n * x
    blow.v_t += k_t * x
    blow.p += x
    blow.p_t += s * x


def _kane_levinson(v_n, v_t, G, mu, e):
    """Return the impulse after which v_n is −e v_n, by Coulomb's law of the whole impulse."""
    p, p_t = np.linalg.solve([[G[0], G[1]], [G[1], G[2]]], [-(1 + e) * v_n, -v_t]).tolist()
    if p >= 0 and abs(p_t) <= mu * p:
        return p, p_t, -e * v_n, 0.0
    found = []
    for direction in (1.0, -1.0):
        slope = G[0] - direction * mu * G[1]
        if slope > 0:
            p = -(1 + e) * v_n / slope
            after = v_t + (G[1] - direction * mu * G[2]) * p
            if direction * after >= 0:
                found.append((p, -direction * mu * p, -e * v_n, after))
    if len(found) != 1:
        raise JudgeGivesUp("newton's law of impact leaves no impulse, or a choice")
    return found[0]
