"""The event loop: from mode to mode, by DOP853 with all conditions watched on a fine grid."""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq, minimize_scalar

from tests.judge.equations import Contact, Friction, System, dot, solve_mass
from tests.judge.impact import Strike, settled, strike_all, without_speeds
from tests.judge.modes import (
    SLIPS,
    ZERO_GAP,
    JudgeGivesUp,
    Motion,
    State,
    next_mode,
    rest_margin,
    sign_of_speed,
)

# Points of a step at which all conditions are looked at.
GRID = 16
# Bounces that are over within this time (s) are not followed.
ZENO = 1e-7
MOST_EVENTS = 20_000
# Events that follow each other in less than this time (s) without end mean that the judge errs.
AT_ONCE = 1e-13


@dataclass(frozen=True)
class JudgeRun:
    """q (rad) and u (rad/s) at the wanted times, shape (2, n); modes and impacts as they came."""

    q: np.ndarray
    u: np.ndarray
    events: list[tuple[float, dict[str, State]]]
    impacts: list[Strike]


def judge(scene, times, max_step=0.01):
    """Return the motion of a scene at times (s), ascending; raise JudgeGivesUp if it cannot."""
    return _Run(System(scene), scene, np.asarray(times, dtype=float), max_step).result()


class _Run:
    """A motion on its way: time, state and mode, and its log."""

    def __init__(self, system, scene, times, max_step):
        self.system, self.times, self.max_step = system, times, max_step
        self.t, self.end = 0.0, float(times[-1])
        self.q, self.u = tuple(map(float, scene.q)), tuple(map(float, scene.u))
        self.samples = np.full((4, len(times)), np.nan)
        self.filled = 0
        self.events, self.impacts = [], []
        for element in system.elements:
            if isinstance(element, Contact) and element.gap(self.q) < -ZERO_GAP:
                raise ValueError(f"the scene starts inside: {element.name}")

    def result(self):
        """Return the whole run."""
        self._fill(self.t, lambda _: np.array([*self.q, *self.u]))
        self._go_on()
        stalled = 0
        while self.t < self.end:
            begun = self.t
            self._follow_mode()
            stalled = stalled + 1 if self.t - begun < AT_ONCE else 0
            if stalled > 20 or len(self.events) > MOST_EVENTS:
                raise JudgeGivesUp("events without end")
        return JudgeRun(self.samples[:2], self.samples[2:], self.events, self.impacts)

    def _fill(self, until, state):
        """Keep the states at the times up to one."""
        while self.filled < len(self.times) and self.times[self.filled] <= until:
            self.samples[:, self.filled] = state(self.times[self.filled])
            self.filled += 1

    def _go_on(self):
        """Resolve impacts, let bounces that are over at once come to rest, and take a mode."""
        for _ in range(100):
            self.u, strikes = strike_all(self.system, self.t, self.q, self.u)
            self.impacts += strikes
            self.u = settled(self.system, self.q, self.u)
            self.mode = next_mode(self.system, self.t, self.q, self.u)
            self.motion = Motion(self.system, self.mode, self.q)
            if not any([self._captured(i) for i in self._rebounding()]):
                break
        names = self.system.names
        self.events.append((self.t, dict(zip(names, self.mode.states, strict=True))))

    def _rebounding(self):
        """Return the contacts that are touched and left."""
        return [
            i
            for i, element in enumerate(self.system.elements)
            if isinstance(element, Contact)
            and abs(element.gap(self.q)) <= ZERO_GAP
            and sign_of_speed(element.direction.row(self.q), self.u) > 0
        ]

    def _captured(self, index):
        """Return whether a rebound is over at once, and then set it to rest.

        Under an acceleration −a the bounces from a speed v last 2v/a, e times that, and so on. Each
        bounce's friction is that of a contact which slides on: so is the loss of speed.
        """
        contact = self.system.elements[index]
        row = contact.direction.row(self.q)
        du, _, _ = self.motion.solve(self.t, self.q, self.u)
        back = -(dot(row, du) + contact.direction.drift(self.q, self.u))
        speed, e = dot(row, self.u), contact.restitution
        if back <= 0 or e >= 1 or 2 * speed / back / (1 - e) > ZENO:
            return False
        force = row
        if contact.tangent is not None and not contact.guided:
            t = contact.tangent.row(self.q)
            s = -contact.kinetic * sign_of_speed(t, self.u)
            force = row[0] + s * t[0], row[1] + s * t[1]
        response = solve_mass(self.system.mass_matrix(self.q), force)
        size = -speed / dot(row, response)
        u = self.u[0] + size * response[0], self.u[1] + size * response[1]
        self.u = without_speeds([row], tuple(map(float, u)))
        return True

    def _follow_mode(self):
        """Follow a mode to its end, or to the last time."""
        if self.mode.rest:
            self._rest()
            return
        solver = DOP853(
            self._rates, self.t, [*self.q, *self.u], self.end,
            rtol=1e-12, atol=1e-13, max_step=self.max_step,
        )  # fmt: skip
        previous = None
        while True:
            if solver.step() is not None and solver.status == "failed":
                raise JudgeGivesUp("the integration failed")
            piece = _Piece(solver.t_old, solver.t, solver.dense_output(), previous)
            event = piece.first_event(self.motion)
            self._fill(event[0] if event else solver.t, piece)
            if event is not None:
                self._take_up(event[0], piece(event[0]), event[1])
                return
            if solver.status == "finished":
                self._take_up(solver.t, solver.y, None, go_on=False)
                return
            previous = piece

    def _rates(self, t, y):
        du, _, _ = self.motion.solve(t, y[:2].tolist(), y[2:].tolist())
        return np.array([y[2], y[3], du[0], du[1]])

    def _rest(self):
        """Stay at rest until nothing holds the chain any more."""
        until, slips = self.end, False
        if self.system.depends_on_time:
            until, slips = self._end_of_rest()
        self._fill(until, lambda _: np.array([*self.q, 0.0, 0.0]))
        self.t = until
        if slips:
            self._go_on()

    def _end_of_rest(self):
        def margin(t):
            return rest_margin(self.system, self.mode, t, self.q)

        grid = np.arange(self.t, self.end + 0.002, 0.002)
        grid[-1] = self.end
        before = self.t
        for t in grid[1:].tolist():
            if margin(t) < 0:
                if margin(before) <= 0:
                    return before, True
                return brentq(margin, before, t, xtol=1e-15, rtol=1e-15), True
            before = t
        return self.end, False

    def _take_up(self, t, y, label, go_on=True):
        """Go on at a time from a state, after the condition of this label has failed."""
        self.t = float(t)
        self.q, self.u = tuple(map(float, y[:2])), tuple(map(float, y[2:]))
        if not go_on:
            return
        if label[0] == "painleve":
            raise JudgeGivesUp("painleve")
        elements, states = self.system.elements, self.mode.states
        contacts = [i for i in self.motion.held if isinstance(elements[i], Contact)]
        if label[0] == "open":
            contacts.append(label[1])
        for _ in range(3):
            for i in contacts:
                self.q = _without_gap(elements[i], self.q)
        still = [elements[i].direction.row(self.q) for i in self.motion.held]
        if label[0] == "slips":
            element = elements[label[1]]
            along = element.direction if isinstance(element, Friction) else element.tangent
            still.append(along.row(self.q))
            assert states[label[1]] in SLIPS
        self.u = without_speeds(still, self.u)
        self._go_on()


def _without_gap(contact, q):
    """Return the q nearest to one at which a contact is touched."""
    row, gap = contact.direction.row(q), contact.gap(q)
    step = -gap / dot(row, row)
    return float(q[0] + step * row[0]), float(q[1] + step * row[1])


class _Piece:
    """One step of the integration, with the polynomial that it left."""

    def __init__(self, start, stop, polynomial, previous):
        self.start, self.stop, self.polynomial = start, stop, polynomial
        self.is_first = previous is None
        grid = np.linspace(start, stop, GRID + 1)
        # The last point before the step is kept too, for minima at its beginning.
        self.before = previous
        self.grid = grid[1:] if self.is_first else np.concatenate([previous.grid[-2:-1], grid])
        if not self.is_first:
            previous.before = None

    def __call__(self, t):
        """Return the state at a time, or the states at several, shape (4, n)."""
        times = np.asarray(t)
        if self.before is None:
            return self.polynomial(times)
        early = times < self.start
        if times.ndim == 0:
            return self.before.polynomial(times) if early else self.polynomial(times)
        found = self.polynomial(times)
        if early.any():
            found[:, early] = self.before.polynomial(times[early])
        return found

    def first_event(self, motion):
        """Return the time and the label of the first condition that fails, or None."""

        def values(label, t):
            y = self(t)
            return motion.watched(t, y[:2], y[2:])[label][0]

        y = self(self.grid)
        found = []
        for label, (value, noise) in motion.watched(self.grid, y[:2], y[2:]).items():
            t = self._first_failure(lambda t, label=label: values(label, t), value, noise)
            if t is not None:
                found.append((t, label))
        return min(found) if found else None

    def _first_failure(self, function, value, noise):
        """Return when a function of time becomes negative, or None."""
        value = np.broadcast_to(value, self.grid.shape)
        below = np.nonzero(value < -noise)[0]
        minimum = self._negative_minimum(function, value, noise)
        last = below[0] if len(below) else None
        if minimum is not None and (last is None or minimum[0] < self.grid[last]):
            return brentq(function, minimum[1], minimum[0], xtol=1e-15, rtol=1e-15)
        if last is None:
            return None
        positive = np.nonzero(value[:last] > 0)[0]
        if len(positive):
            left = self.grid[positive[-1]]
        else:
            left = self._positive_before(function, self.grid[last])
            if left is None:
                return self.start
        return brentq(function, left, self.grid[last], xtol=1e-15, rtol=1e-15)

    def _positive_before(self, function, t):
        """Return a time early in the step at which a function that starts at 0 is positive."""
        for k in range(1, 40):
            earlier = self.start + (t - self.start) * 0.5**k
            if function(earlier) > 0:
                return earlier
        return None

    def _negative_minimum(self, function, value, noise):
        """Return the time of a minimum between grid points that is negative, and its left end."""
        for k in range(1, len(value) - 1):
            left, here, right = value[k - 1 : k + 2]
            is_low = left >= here <= right and left > 0 and here >= -noise
            if is_low and here < 2 * (left + right - 2 * here) + noise:
                ends = self.grid[k - 1], self.grid[k + 1]
                least = minimize_scalar(
                    function, bounds=ends, method="bounded", options={"xatol": 1e-12}
                )
                if least.fun < -noise and function(ends[0]) > 0:
                    return least.x, ends[0]
        return None
