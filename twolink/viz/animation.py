"""A small animated picture of a motion, one SVG: `python -m twolink.viz.animation SCENE FILE.svg`.

The animation is CSS: it plays in an `img` element and follows the reader's colour scheme. It stands
still where the browser tells the picture that its reader prefers reduced motion.
"""

from __future__ import annotations

import html
import sys
from pathlib import Path

import numpy as np

from twolink import Scene, kinematics, simulate
from twolink.effects.surface import Surface
from twolink.files import atomic_write
from twolink.simulation import Trajectory
from twolink.simulation.hybrid.mode import Impact
from twolink.text import printable
from twolink.viz.framing import box_of
from twolink.viz.shapes import Array
from twolink.viz.themes import DARK, LIGHT, Theme

# Keyframes per second, the pause at the end (s), and pixels per metre.
_RATE, _PAUSE, _SCALE = 30, 1.0, 200

# Points of the path from one keyframe to the next, so that it is smooth.
_FINER = 4

# Impulses below this part of the largest are not marked; a mark fades in this time (s).
_SEEN, _FADES = 0.02, 0.7

# The pose without animation, as a part of the motion.
_POSE = 0.25


def animation(trajectory: Trajectory) -> str:
    """Return the motion as an animated SVG: links, the path of D, surfaces, and impacts.

    All keyframes are states of the trajectory; between them, angles are interpolated linearly.
    """
    chain = trajectory.chain
    times = _times(trajectory)
    fine = np.interp(
        np.arange(_FINER * (len(times) - 1) + 1) / _FINER, np.arange(len(times)), times
    )
    q, _ = trajectory.at(fine)
    L1, L2 = (float(length) for length in chain.length)
    B, D = (
        np.column_stack(kinematics.position(chain, (q[0], q[1]), point))
        for point in (chain.B, chain.D)
    )
    box = box_of(np.concatenate([B, D, [[0.0, 0.0]]]), L1 + L2)
    whole = float(times[-1] - times[0]) + _PAUSE
    share = 100 * (times - times[0]) / whole
    width, height = box.right - box.left, box.bottom - box.top
    title = html.escape(printable(trajectory.scene.title))
    floors = "".join(
        _surface(effect, 2 * (width + height))
        for effect in trajectory.scene.effects
        if isinstance(effect, Surface)
    )
    marks, mark_frames = _impacts(trajectory, whole)
    bar = 0.042 * (L1 + L2)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="{title}" '
        f'viewBox="{box.left:.3f} {box.top:.3f} {width:.3f} {height:.3f}" '
        f'width="{_SCALE * width:.0f}" height="{_SCALE * height:.0f}">\n<title>{title}</title>\n'
        f"<style>\n{_style(whole, bar)}"
        f"{_turning('link1', share, q[0, ::_FINER])}"
        f"{_turning('link2', share, (q[1] - q[0])[::_FINER])}"
        f"{_drawn(share, D)}{mark_frames}</style>\n"
        f'<rect class="paper" x="{box.left:.3f}" y="{box.top:.3f}" width="{width:.3f}" '
        f'height="{height:.3f}"/>\n{floors}{_path(D)}\n{marks}'
        f'<g class="link1"><line class="first" x2="{L1:g}"/><g transform="translate({L1:g})">'
        f'<g class="link2"><line class="second" x2="{L2:g}"/>'
        f'<circle class="end" cx="{L2:g}" r="{0.62 * bar:.4f}"/></g>'
        f'<circle class="pin" r="{0.3 * bar:.4f}"/></g>'
        f'<circle class="pin" r="{0.3 * bar:.4f}"/></g>\n</svg>\n'
    )


def _times(trajectory: Trajectory) -> Array:
    """Return evenly spaced times (s), with those of the impacts among them."""
    start, end = float(trajectory.t[0]), float(trajectory.t[-1])
    even = np.linspace(start, end, round((end - start) * _RATE) + 1)
    return np.union1d(even, [impact.time for impact in _marked(trajectory)])


def _marked(trajectory: Trajectory) -> list[Impact]:
    largest = max((abs(impact.normal_impulse) for impact in trajectory.impacts), default=0.0)
    return [i for i in trajectory.impacts if abs(i.normal_impulse) > _SEEN * largest]


def _style(whole: float, bar: float) -> str:
    """Return the colours in both schemes, and the animations with their period (s)."""
    return (
        f"{_colours(LIGHT)}@media (prefers-color-scheme: dark) {{ {_colours(DARK)}}}\n"
        f"line {{ stroke-linecap: round; stroke-width: {bar:.4f}; }}\n"
        f".trail {{ fill: none; stroke-width: {0.25 * bar:.4f}; stroke-dasharray: 1; }}\n"
        f".edge, .hatch {{ stroke-width: {0.25 * bar:.4f}; stroke-linecap: butt; }}\n"
        f".impact {{ fill: none; stroke-width: {0.25 * bar:.4f}; opacity: 0; }}\n"
        f".link1, .link2, .trail, .impact {{ animation: {whole:g}s linear infinite; }}\n"
        "@media (prefers-reduced-motion: reduce) "
        "{ .link1, .link2, .trail, .impact { animation: none !important; } }\n"
    )


def _colours(theme: Theme) -> str:
    return (
        f".paper {{ fill: {theme.background}; }} .first {{ stroke: {theme.links[0]}; }} "
        f".second {{ stroke: {theme.links[1]}; }} .end {{ fill: {theme.end}; }} "
        f".pin {{ fill: {theme.pin}; stroke: {theme.ink}; stroke-width: 0.012; }} "
        f".trail {{ stroke: {theme.end}; }} .edge, .hatch {{ stroke: {theme.surface}; }} "
        f".impact {{ stroke: {theme.impulse}; }}\n"
    )


def _turning(name: str, share: Array, angles: Array) -> str:
    """Return the keyframes of a rotation (rad); with the pose that it has without animation."""
    degrees = np.degrees(angles)
    frames = "".join(
        f"{at:.2f}%{{transform:rotate({angle:.2f}deg)}}"
        for at, angle in zip(share, degrees, strict=True)
    )
    last = f"100%{{transform:rotate({degrees[-1]:.2f}deg)}}"
    pose = degrees[int(_POSE * (len(degrees) - 1))]
    return (
        f".{name} {{ animation-name: {name} !important; transform: rotate({pose:.2f}deg); }}\n"
        f"@keyframes {name}{{{frames}{last}}}\n"
    )


def _drawn(share: Array, D: Array) -> str:
    """Return the keyframes that draw the path of D, finer than they are, up to its place."""
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(D, axis=0).T))])[::_FINER]
    frames = "".join(
        f"{at:.2f}%{{stroke-dashoffset:{1 - part:.4f}}}"
        for at, part in zip(share, length / length[-1], strict=True)
    )
    return (
        ".trail { animation-name: trail !important; }\n"
        f"@keyframes trail{{{frames}100%{{stroke-dashoffset:0}}}}\n"
    )


def _path(D: Array) -> str:
    points = " ".join(f"{x:.3f},{y:.3f}" for x, y in D)
    return f'<polyline class="trail" pathLength="1" points="{points}"/>'


def _surface(effect: Surface, far: float) -> str:
    """Return the edge of a half-plane, and hatches on its inner side."""
    turn = np.degrees(np.arctan2(effect.normal[1], effect.normal[0])) + 90
    x, y = effect.point
    hatches = "".join(f"M{k * 0.1:.1f} 0l-0.06 0.06" for k in range(-int(5 * far), int(5 * far)))
    return (
        f'<g transform="translate({x:g} {y:g}) rotate({turn:g})">'
        f'<line class="edge" x1="{-far:.2f}" x2="{far:.2f}"/>'
        f'<path class="hatch" style="stroke-width:0.012" d="{hatches}"/></g>\n'
    )


def _impacts(trajectory: Trajectory, whole: float) -> tuple[str, str]:
    """Return the rings of the impacts of D, whose area is as the impulse, and their keyframes."""
    marked = _marked(trajectory)
    rings, frames = "", ""
    largest = max((abs(impact.normal_impulse) for impact in marked), default=1.0)
    for number, impact in enumerate(marked):
        q, _ = trajectory.at([impact.time])
        x, y = (
            float(np.ravel(part)[0])
            for part in kinematics.position(trajectory.chain, tuple(q), trajectory.chain.D)
        )
        radius = 0.14 * (abs(impact.normal_impulse) / largest) ** 0.5
        rings += (
            f'<circle class="impact" style="animation-name:impact{number}" cx="{x:.3f}" '
            f'cy="{y:.3f}" r="{radius:.3f}"/>\n'
        )
        at = 100 * (impact.time - float(trajectory.t[0])) / whole
        gone = min(99.9, at + 100 * _FADES / whole)
        frames += (
            f"@keyframes impact{number}{{0%,{at:.2f}%{{opacity:0}}{at + 0.01:.2f}%{{opacity:1}}"
            f"{gone:.2f}%,100%{{opacity:0}}}}\n"
        )
    return rings, frames


def main() -> None:
    """Write the animated picture of a scene, both named on the command line."""
    scene, file = sys.argv[1], Path(sys.argv[2])
    with atomic_write(file) as temporary:
        temporary.write_text(animation(simulate(Scene.load(scene))), encoding="utf-8")


if __name__ == "__main__":
    main()
