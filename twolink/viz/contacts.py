"""Marks of contacts and friction at points and joints while they last."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from twolink import kinematics
from twolink.contact.coordinates import JointCoordinate, PointCoordinate
from twolink.contact.elements import ContactElement
from twolink.contact.states import ContactState
from twolink.effects import contact_elements
from twolink.simulation.hybrid.mode import Mode
from twolink.viz.commands import ROOT, flat_mesh, in_the_plane, transform, visible
from twolink.viz.labels import Drawn, Label, Mark, line_mark, round_mark
from twolink.viz.run import Moments, Run
from twolink.viz.shapes import Array, Shape, arrow, ring
from twolink.viz.themes import Theme

# Above the marks of impacts, which are of the past.
_ORDER = 80

# Minimum time (s) on the screen of a contact mark.
_LEAST = 0.25

# Rings about a contact that is held or slips: their radii relative to half of a bar's width.
_HELD_RING, _SLIPPING_RING = (1.5, 2.3), (1.6, 1.95)

# An arrow of friction begins and ends so far from the contact, relative to half of a bar's width.
_ARROW = (2.4, 6.4)
_ARROW_MIDDLE = sum(_ARROW) / 2
_ARROW_HEAD = 1.65

_HELD, _SLIPPING, _PUSHED = "held", "slipping", ("pushed-on", "pushed-back")
_WORDS = {
    ContactState.STICKS: "sticks",
    ContactState.CLOSED: "rests",
    ContactState.FORWARD: "slips",
    ContactState.BACKWARD: "slips",
    ContactState.PRESSED_FORWARD: "pressed",
    ContactState.PRESSED_BACKWARD: "pressed",
}


def mode_at(run: Run, time: float) -> Mode | None:
    """Return the mode of a run at a time (s), or None if the whole run is smooth."""
    events = run.trajectory.events
    index = bisect_right([event.entered for event in events], time) - 1
    return events[max(index, 0)].mode if events else None


def elements_of(run: Run) -> tuple[ContactElement, ...]:
    """Return the frictions and obstacles of a run, in the numbering of its modes."""
    return (
        contact_elements(run.trajectory.scene.effects, run.chain) if run.trajectory.events else ()
    )


def contact_setup(run: Run, size: float, theme: Theme) -> list[bytes]:
    """Return the commands that draw the marks of all contacts, each at the origin of its path.

    Sticking has a thick ring, slipping a thin one; an arrow along the surface is the direction of
    friction. `size` (m) is half of a bar's width.
    """
    found = []
    for number, element in enumerate(elements_of(run)):
        shapes: dict[str, Shape] = {
            _HELD: ring((0, 0), *(size * radius for radius in _HELD_RING)),
            _SLIPPING: ring((0, 0), *(size * radius for radius in _SLIPPING_RING)),
        }
        tangent = tangent_of(element)
        if tangent is not None:
            for name, sense in zip(_PUSHED, (1, -1), strict=True):
                way = sense * np.array(tangent)
                start, end = (part * size * way for part in _ARROW)
                shapes[name] = arrow(start, end, 0.55 * size)
        for name, shape in shapes.items():
            path = f"{_path(number)}/{name}"
            found += [flat_mesh(path, shape, theme.contact, order=_ORDER), visible(path, False)]
    return found


def contact_marks(now: Moments, speed: float, size: float) -> Drawn:
    """Return the marks at a moment, and their labels.

    An instantaneous contact is marked for a minimum time on the screen (`speed`); `size` (m) is
    half of a bar's width. The arrow of friction has its size beside it; an arrow in the text is the
    direction of sliding, in a joint that of the outer link's rotation.
    """
    time = float(now.times[0])
    mode = mode_at(now.run, time)
    commands: list[bytes] = []
    labels: list[Label] = []
    marks: list[Mark] = []
    if mode is None:
        return Drawn(commands, labels, marks)
    for number, (element, state) in enumerate(zip(elements_of(now.run), mode.states, strict=True)):
        place = place_of(element, now)
        tangent = tangent_of(element)
        held = state in (ContactState.STICKS, ContactState.CLOSED)
        just = state is ContactState.OPEN and _just_left(now.run, number, time, _LEAST * speed)
        shown = {_HELD: held, _SLIPPING: just or (not held and state is not ContactState.OPEN)}
        if tangent is not None:
            # Friction opposes sliding.
            shown |= dict(zip(_PUSHED, (state.direction < 0, state.direction > 0), strict=True))
        commands.append(transform(_path(number), in_the_plane(place, 0.0)))
        commands += [visible(f"{_path(number)}/{name}", on) for name, on in shown.items()]
        word = "touched" if just else _WORDS.get(state)
        if word is not None and state.slips:
            word = f"{word} {_sliding(element, state.direction)}"
        if shown[_HELD] or shown[_SLIPPING]:
            ring_now = _HELD_RING if shown[_HELD] else _SLIPPING_RING
            marks.append(round_mark(place, size * ring_now[1]))
        if tangent is not None and state.direction:
            way = -state.direction * np.array(tangent)
            tail, head = (place + part * size * way for part in _ARROW)
            marks.append(line_mark(tail, head, _ARROW_HEAD * size))
            labels.append(_friction_label(now, number, element, place, way, size))
        if word is not None:
            labels.append(_contact_label(now, element, place, word))
    return Drawn(commands, labels, marks)


def _friction_label(
    now: Moments, number: int, element: ContactElement, place: Array, way: Array, size: float
) -> Label:
    """Return the size of a friction beside its arrow, which goes one way from a place."""
    # Inside the surface, and away from the letter of the point.
    aside = way - np.array(_away(element))
    words = _friction_in_words(now, number)
    return [words, *(place + _ARROW_MIDDLE * size * way), *aside, "friction"]


def _contact_label(now: Moments, element: ContactElement, place: Array, word: str) -> Label:
    """Return the state of a contact in a word, beside its place or the letter of its joint."""
    at_joint = joint_labels(now).get(getattr(element.principal, "joint", ""))
    if at_joint is not None:
        return [word, *at_joint[1:5], "contact", 1]
    return [word, *place.tolist(), *_away(element), "contact"]


def _sliding(element: ContactElement, direction: int) -> str:
    """Return the arrow of the sliding of an element, +1 or −1, as seen in the picture."""
    tangent = tangent_of(element)
    if tangent is not None:
        return _arrow_of(direction * np.array(tangent))
    coordinate = element.tangent
    assert isinstance(coordinate, JointCoordinate)
    # Angles grow from x towards y, which points down: clockwise.
    return "↻" if direction * coordinate.sense > 0 else "↺"


def _arrow_of(vector: Array) -> str:
    """Return the arrow of a direction (x, y), y downward."""
    eighth = round(float(np.arctan2(vector[1], vector[0])) / (np.pi / 4)) % 8
    return "→↘↓↙←↖↑↗"[eighth]


def _friction_in_words(now: Moments, number: int) -> str:
    """Return the name of the friction force, with its size where that is known."""
    size = now.run.friction(number, float(now.times[0]))
    return "friction" if size is None else f"friction {float(f'{size:.3g}'):g} N"


def _just_left(run: Run, number: int, time: float, lasting: float) -> bool:
    """Return whether an obstacle was touched within a duration (s) before a time (s)."""
    events = run.trajectory.events
    last = bisect_right([event.entered for event in events], time) - 1
    ended = [later.entered for later in events[1 : last + 1]]
    return any(
        event.mode.states[number] is not ContactState.OPEN and end > time - lasting
        for event, end in zip(events, ended, strict=False)
    )


def joint_labels(now: Moments) -> dict[str, Label]:
    """Return the letters A, B and D, each offset from the links that meet there.

    The letter of D is below a surface along which an arrow of friction is drawn.
    """
    ways = [np.array([np.cos(q), np.sin(q)]) for q in now.q[:, 0]]
    at_elbow = ways[0] - ways[1]
    if np.hypot(*at_elbow) < 0.5:
        # A stretched chain: beside both links, on the upper side.
        across = np.array([ways[0][1], -ways[0][0]])
        at_elbow = across if across[1] < 0 else -across
    aside = {"A": -ways[0], "B": at_elbow / np.hypot(*at_elbow), "D": ways[1]}
    mode = mode_at(now.run, float(now.times[0]))
    for element, state in zip(
        elements_of(now.run), () if mode is None else mode.states, strict=False
    ):
        normal = element.normal
        if state.direction and isinstance(normal, PointCoordinate) and normal.point == "D":
            aside["D"] = -np.array(normal.vector)
    return {
        name: [name, *now.point(name)[0].tolist(), *way.tolist(), "joint"]
        for name, way in aside.items()
    }


def place_of(element: ContactElement, now: Moments) -> Array:
    """Return the position of a friction or an obstacle at a moment (m)."""
    direction = element.principal
    if isinstance(direction, JointCoordinate):
        return now.point(direction.joint)[0]
    assert isinstance(direction, PointCoordinate)
    point = direction.of(now.run.chain)
    q1, q2 = float(now.q[0, 0]), float(now.q[1, 0])
    return np.array(kinematics.position(now.run.chain, (q1, q2), point))


def tangent_of(element: ContactElement) -> tuple[float, float] | None:
    """Return the unit vector along which a point slides, or None for a joint."""
    along = element.tangent
    return along.vector if isinstance(along, PointCoordinate) else None


def _away(element: ContactElement) -> tuple[float, float]:
    """Return the direction from a point to its label: out of a surface, or upwards."""
    if isinstance(element.normal, PointCoordinate):
        return element.normal.vector
    return (0.7, -0.7)


def _path(number: int) -> str:
    return f"{ROOT}/contact{number}"
