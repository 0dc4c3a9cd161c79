"""Contact forces over time, with shaded modes, and impulses of impacts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.transforms import offset_copy
from numpy.typing import NDArray

from twolink.contact.states import ContactState
from twolink.errors import ParameterError
from twolink.simulation import Trajectory
from twolink.simulation.forces import ContactForce
from twolink.simulation.hybrid.mode import Impact
from twolink.viz.plots.moments import Array, moments, spans, time_axis
from twolink.viz.plots.style import Palette, figure, label_lines, palette_of, plain, stroke

# Each state has a band of the theme, and a hatching that is visible in grey.
_BANDS: dict[ContactState, tuple[int, str]] = {
    ContactState.FORWARD: (0, "///"),
    ContactState.BACKWARD: (1, "\\\\\\"),
    ContactState.STICKS: (2, ""),
    ContactState.PRESSED_FORWARD: (3, "//"),
    ContactState.PRESSED_BACKWARD: (3, "\\\\"),
    ContactState.CLOSED: (4, ""),
}

# If all contacts are shorter than this part of the run, one is also shown close up.
_SHORT = 0.02
# Impulses below this part of the largest have no visible stem.
_VISIBLE = 1e-2
# Points between stems of impacts at the same instant.
_BESIDE = 6.0


@dataclass(frozen=True)
class Phase:
    """The state of one friction or obstacle from one time (s) to another."""

    start: float
    end: float
    state: ContactState


@dataclass(frozen=True)
class _Row:
    """A row of the figure: height, whether its axis is time, and its drawing function."""

    height: float
    over_time: bool
    draw: Callable[[Axes], None]


def contact(trajectory: Trajectory, theme: str = "light") -> Figure:
    """Return a plot of the force (N, N m) of each friction and obstacle over time (s).

    States are shaded. Impulses (N s, N m s) have a separate row, and short contacts are also shown
    close up. Raises `ParameterError` for a motion with neither friction nor obstacles.
    """
    palette = palette_of(theme)
    if not trajectory.events:
        raise ParameterError(
            f"'{trajectory.scene.title}' must have friction or an obstacle for a contact plot"
        )
    shown = moments(trajectory)
    forces = trajectory.contact_forces(shown.t if shown.known_between else None)
    rows: list[_Row] = []
    for index, force in enumerate(forces):
        rows += _rows(trajectory, palette, shown.t, index, force)
    made, axes = figure(
        palette,
        f"{trajectory.scene.title}: contact and friction",
        rows=len(rows),
        size=(7.2, 0.9 + sum(row.height for row in rows)),
        height_ratios=[row.height for row in rows],
    )
    for each, row in zip(axes, rows, strict=True):
        row.draw(each)
    over_time = [each for each, row in zip(axes, rows, strict=True) if row.over_time]
    if over_time:
        time_axis(over_time, trajectory, palette)
    label_lines(*axes)
    return made


def phases(trajectory: Trajectory, index: int) -> list[Phase]:
    """Return the states of the friction or obstacle of this number, in order."""
    found: list[Phase] = []
    for span in spans(trajectory):
        state = span.mode.states[index]
        if found and found[-1].state is state:
            found[-1] = Phase(found[-1].start, span.end, state)
        else:
            found.append(Phase(span.start, span.end, state))
    return found


def _rows(
    trajectory: Trajectory, palette: Palette, times: Array, index: int, force: ContactForce
) -> list[_Row]:
    """Return the rows of one friction or obstacle."""
    known = phases(trajectory, index)
    impacts = [impact for impact in trajectory.impacts if impact.index == index]
    touching = [phase for phase in known if phase.state is not ContactState.OPEN]
    rows: list[_Row] = []
    if touching or not impacts:
        rows.append(_Row(2.2, True, lambda axes: _draw_forces(axes, palette, times, force, known)))
    duration = float(trajectory.t[-1])
    if touching and max(phase.end - phase.start for phase in touching) < _SHORT * duration:
        rows.append(
            _Row(1.9, False, lambda axes: _draw_close_up(axes, palette, times, force, touching))
        )
    if impacts:
        rows.append(_Row(1.6, True, lambda axes: _draw_impulses(axes, palette, force, impacts)))
    return rows


def _draw_forces(
    axes: Axes, palette: Palette, times: Array, force: ContactForce, known: list[Phase]
) -> None:
    """Draw the force of one friction or obstacle over its states."""
    _shade(axes, palette, known)
    _title(axes, palette, _in_words(force.name))
    axes.axhline(0, color=palette.faint, linewidth=0.8)
    if force.tangential is None or not force.tangential.any():
        label = "torque" if force.unit == "N m" else "force"
        axes.plot(times, force.normal, label=label, **stroke(palette, 0))
    else:
        axes.plot(times, force.normal, label="normal", **stroke(palette, 0))
        axes.plot(times, force.tangential, label="friction", **stroke(palette, 1))
    axes.set_ylabel(f"{'torque' if force.unit == 'N m' else 'force'} ({force.unit})")


def _draw_close_up(
    axes: Axes, palette: Palette, times: Array, force: ContactForce, touching: list[Phase]
) -> None:
    """Draw the first contact close up."""
    first, until = touching[0], touching[0].end
    for phase in touching[1:]:
        if phase.start > until:
            break
        until = phase.end
    inside = (times >= first.start) & (times < until)
    milliseconds = (times[inside] - first.start) * 1e3
    close = ContactForce(
        force.name,
        force.unit,
        force.normal[inside],
        None if force.tangential is None else force.tangential[inside],
    )
    during = [
        Phase((p.start - first.start) * 1e3, (p.end - first.start) * 1e3, p.state)
        for p in touching
        if p.end <= until
    ]
    _draw_forces(axes, palette, milliseconds, close, during)
    _title(axes, palette, f"the first contact, from {first.start:.6g} s")
    axes.set_xlabel("time since then (ms)")
    axes.set_xlim(0, (until - first.start) * 1e3)


def _draw_impulses(
    axes: Axes, palette: Palette, force: ContactForce, impacts: list[Impact]
) -> None:
    """Draw a stem for each impact, with its normal and friction impulses.

    Impacts at one instant are side by side.
    """
    kinds = {"normal": [impact.normal_impulse for impact in impacts]}
    if any(impact.tangential_impulse for impact in impacts):
        kinds["friction"] = [impact.tangential_impulse for impact in impacts]
    axes.axhline(0, color=palette.faint, linewidth=0.8)
    times = np.array([impact.time for impact in impacts])
    sizes = np.abs([impact.normal_impulse for impact in impacts])
    places = _places_at_instants(times, sizes > _VISIBLE * sizes.max())
    for number, (name, values) in enumerate(kinds.items()):
        impulses = np.array(values)
        _draw_stems(axes, palette, (number, name), times, impulses, places)
        tallest = int(np.argmax(np.abs(impulses)))
        axes.annotate(
            name,
            (times[tallest], impulses[tallest]),
            xytext=(6 + _BESIDE * places.max(), 0),
            textcoords="offset points",
            va="center",
            color=palette.ink,
            fontsize=9,
            bbox={"facecolor": palette.paper, "edgecolor": "none", "alpha": 0.8, "pad": 0.8},
        )
    least, most = (f([0.0, *(v for values in kinds.values() for v in values)]) for f in (min, max))
    axes.set_ylim(least - 0.15 * (most - least), most + 0.15 * (most - least))
    count = f"{len(impacts)} impact{'s' if len(impacts) > 1 else ''}"
    together = " (those at one instant are side by side)" if places.any() else ""
    _title(axes, palette, f"{_in_words(force.name)}: {count}{together}")
    axes.set_ylabel(f"impulse ({force.unit} s)")


def _draw_stems(
    axes: Axes,
    palette: Palette,
    kind: tuple[int, str],
    times: Array,
    impulses: Array,
    places: NDArray[np.intp],
) -> None:
    """Draw the stems of one kind of impulse, by its number and name; those at one place beside."""
    number, name = kind
    colour = stroke(palette, number)["color"]
    for place in range(max(places) + 1):
        own = places == place
        aside = offset_copy(
            axes.transData, axes.get_figure(root=True), x=_BESIDE * place, units="points"
        )
        axes.vlines(times[own], 0, impulses[own], color=colour, linewidth=1.1, transform=aside)
        axes.plot(
            times[own], impulses[own], "os"[number], color=colour, markersize=4,
            label=f"_{name}", markerfacecolor=colour if number == 0 else palette.paper,
            clip_on=False, transform=aside,
        )  # fmt: skip


def _places_at_instants(times: Array, visible: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return, for increasing times, how many visible ones before each are at the same instant.

    It is 0 for impulses too small to be seen, which are drawn at their time.
    """
    places = np.zeros(len(times), dtype=np.intp)
    own = times[visible]
    places[visible] = np.arange(len(own)) - np.searchsorted(own, own, side="left")
    return places


def _shade(axes: Axes, palette: Palette, known: list[Phase]) -> None:
    """Shade the states, with a legend above the axes."""
    keys: dict[ContactState, Patch] = {}
    for phase in known:
        if phase.state is ContactState.OPEN:
            continue
        band, hatch = _BANDS[phase.state]
        style: dict[str, Any] = {
            "facecolor": palette.bands[band],
            "edgecolor": palette.faint,
            "linewidth": 0.0,
        }
        axes.axvspan(phase.start, phase.end, hatch=hatch, zorder=0, **style)
        keys.setdefault(phase.state, Patch(hatch=hatch, label=phase.state.value, **style))
    if keys:
        axes.legend(
            handles=list(keys.values()),
            loc="lower right",
            bbox_to_anchor=(1.0, 1.0),
            ncols=len(keys),
            frameon=False,
            fontsize=9,
            labelcolor=palette.ink,
            borderpad=0,
            borderaxespad=0.2,
            handlelength=1.4,
            columnspacing=1.2,
        )


def _title(axes: Axes, palette: Palette, words: str) -> None:
    axes.set_title(plain(words), loc="left", color=palette.ink, fontsize=10)


def _in_words(name: str) -> str:
    """Return the name of a friction or obstacle; a joint's friction is named by its letter."""
    return f"friction in joint {name}" if name in ("A", "B") else name
