"""The command `twolink reference`."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twolink.cli.limits import Force, limits_of
from twolink.cli.options import check_unused
from twolink.cli.progress import progress_bar
from twolink.cli.terminal import (
    FAILED,
    check_folder,
    check_target,
    console,
    refuse,
    styled,
    warn,
    write_json,
)
from twolink.errors import SimulationError
from twolink.files import atomic_write, new_folder
from twolink.suffixes import RESULTS
from twolink.text import either, one_line, quoted

if TYPE_CHECKING:
    from twolink.accuracy.enclosed_impact import EnclosedImpact
    from twolink.accuracy.enclosure import Enclosure
    from twolink.accuracy.reference import Reference
    from twolink.scene import Scene


# Digits that are computed, and that are proven, unless others are asked for.
_COMPUTED, _PROVEN = 60, 30

_Scenes = Annotated[
    list[Path], typer.Argument(metavar="SCENE", help="Scenes: their names, or TOML files.")
]
_Digits = Annotated[
    int | None,
    typer.Option(help="Correct digits after the decimal point. Default: 60; 30 with --rigorous."),
]
_Times = Annotated[
    str | None, typer.Option(help="Times in s, separated by commas. Default: the end.")
]
_Fifths = Annotated[bool, typer.Option("--fifths", help="Take the times at each fifth of the run.")]
_Rigorous = Annotated[
    bool, typer.Option("--rigorous", help="Prove intervals that contain the motion.")
]
_Out = Annotated[
    Path | None,
    typer.Option(
        help=f"Write a {either(RESULTS)} file; for several scenes a folder, in which each has both."
    ),
]


def reference(
    context: typer.Context,
    scenes: _Scenes,
    digits: _Digits = None,
    times: _Times = None,
    fifths: _Fifths = False,
    rigorous: _Rigorous = False,
    out: _Out = None,
    force: Force = False,
) -> None:
    """Compute a motion to many digits, verified by a second run.

    The two runs differ in precision, order and equations. With events, 113 bits give up to 28
    digits. --rigorous gives intervals that provably contain the motion and its impacts, by ball
    arithmetic; v and T are the normal speed and the kinetic energy before and after an impact, P
    and Pt its normal and tangential impulses. Exit code 0: all digits are right. 1: fewer, or a
    proof that ends before, as printed. 2: the input was refused.
    """
    _check(context, digits, fifths, rigorous)
    several = len(scenes) > 1 or (out is not None and os.path.isdir(out))
    if several:
        names = [f"{scene.stem}{kind}" for scene in scenes for kind in RESULTS]
        check_folder("--out", out, names=names, inputs=scenes)
    else:
        check_target("--out", out, RESULTS, inputs=scenes)
    asked = _Asked(digits, _times(times), fifths, several, force)
    loaded = _loaded(scenes, several and out is not None)
    asked.check(loaded, rigorous)
    complete = True
    for file, scene in loaded.items():
        found = asked.enclosed(file, scene) if rigorous else asked.computed(file, scene)
        _print(found)
        if out is not None:
            _write(found, out, file.stem if several else None)
        complete &= asked.is_complete(found)
    if not complete:
        raise typer.Exit(FAILED)


@dataclass(frozen=True)
class _Asked:
    """The options for the reference of each scene."""

    digits: int | None
    times: tuple[float, ...] | None
    fifths: bool
    several: bool
    force: bool

    def check(self, scenes: dict[Path, Scene], rigorous: bool) -> None:
        """Refuse times outside the run of a scene, and scenes for which there is no proof."""
        from twolink.accuracy.reference import asked_times

        for file, scene in scenes.items():
            try:
                asked_times(scene, self.times)
                if rigorous:
                    from twolink.accuracy.enclosure import check_enclosed

                    check_enclosed(scene)
            except SimulationError as error:
                refuse(f"{one_line(file, 300)}: {error}")

    def computed(self, file: Path, scene: Scene) -> Reference:
        """Return a scene's reference, or refuse."""
        from twolink.accuracy.reference import reference

        return self._found(file, scene, reference, self._wanted)

    def enclosed(self, file: Path, scene: Scene) -> Enclosure:
        """Return intervals that contain a scene's motion, or refuse."""
        from twolink.accuracy.enclosure import enclosure

        return self._found(file, scene, enclosure, lambda scene: self.digits or _PROVEN)

    def is_complete(self, found: Reference | Enclosure) -> bool:
        """Return whether all digits are there, and a proof has reached the last time."""
        from twolink.accuracy.reference import Reference

        if isinstance(found, Reference):
            return min(found.digits) >= self._wanted(found.scene)
        return found.ended is None

    def _wanted(self, scene: Scene) -> int:
        """Return the digits to ask for: as many as a scene can give, unless it alone is asked."""
        from twolink.accuracy.reference import most_digits

        if self.digits is not None and not self.several:
            return self.digits
        return min(self.digits or _COMPUTED, most_digits(scene))

    def _found(self, file: Path, scene: Scene, compute: Any, wanted: Callable[[Scene], int]) -> Any:
        times = _fifths(scene.duration) if self.fifths else self.times
        with progress_bar() as bar:
            task = bar.add_task("computing", total=1.0)
            return compute(
                scene,
                wanted(scene),
                times,
                limits=limits_of(self.force),
                progress=lambda stage, share: bar.update(
                    task, description=f"{file.stem}: {stage}", completed=share
                ),
            )


def _fifths(duration: float) -> tuple[float, ...]:
    """Return the ends of the fifths of a duration (s)."""
    # Five fifths may round to more than the duration.
    return *(duration * part / 5 for part in range(1, 5)), duration


def _loaded(files: list[Path], into_one: bool) -> dict[Path, Scene]:
    """Return all scenes before any work is done; refuse two of one name, whose files are one."""
    from twolink.scene import Scene

    stems = [file.stem for file in files]
    twice = next((stem for stem in stems if into_one and stems.count(stem) > 1), None)
    if twice is not None:
        refuse(f"the scenes must have different names; got {quoted(twice)} twice")
    return {file: Scene.load(file) for file in files}


def _check(context: typer.Context, digits: int | None, fifths: bool, rigorous: bool) -> None:
    """Refuse two choices of times, and a number of digits that no scene can have."""
    if fifths:
        check_unused(context, "--fifths", "times")
    if digits is None:
        return
    from twolink.accuracy.enclosure import MOST_LOST
    from twolink.accuracy.reference import MOST_DIGITS

    most = MOST_LOST if rigorous else MOST_DIGITS
    if not 1 <= digits <= most:
        refuse(f"--digits must be a whole number from 1 to {most}; got {digits}")


def _times(text: str | None) -> tuple[float, ...] | None:
    if text is None:
        return None
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        refuse(f"--times must be numbers of seconds, separated by commas; got {quoted(text)}")


def _print(found: Reference | Enclosure) -> None:
    from twolink.accuracy.reference import Reference

    page = console()
    page.print(styled((found.scene.title, "bold")))
    page.print(found.how, soft_wrap=True)
    for index, (time, state) in enumerate(zip(found.times, found.states, strict=True)):
        page.print(f"\n  t = {time!r} s, {found.worth(index)}")
        for name, value, unit in zip(
            ("q1", "q2", "u1", "u2"), map(str, state), ("rad", "rad", "rad/s", "rad/s"), strict=True
        ):
            sign = "" if value.startswith("-") else " "
            # Digits stay in one line, to be copied.
            page.print(
                f"  {name} {sign}{value} {unit}", no_wrap=True, overflow="ignore", crop=False
            )
    page.print()
    for note in found.notes:
        style = None if note in found.scene.notes else "bold red"
        page.print(note, style=style, soft_wrap=True)
    if not isinstance(found, Reference):
        _print_impacts(found)


def _print_impacts(found: Enclosure) -> None:
    """Print the impacts of a proof, and the reason if it ended before the last time."""
    for number, impact in enumerate(found.impacts, 1):
        _print_impact(number, impact)
    if found.ended is not None:
        warn(f"twolink: the proof ends at {found.ended.time:.9g} s: {found.ended.reason}")


def _print_impact(number: int, impact: EnclosedImpact) -> None:
    """Print the intervals of an impact: its time, speeds, impulses and energies."""
    page = console()
    page.print(styled(f"  impact {number}: {impact.name}, {impact.regime}"), soft_wrap=True)
    at_joint = impact.unit == "rad"
    (v, w), (T, rest) = impact.normal_speed, impact.kinetic_energy
    speed, impulse = ("rad/s", "N m s") if at_joint else ("m/s", "N s")
    rows = [("t", impact.time, "s"), ("v-", v, speed), ("v+", w, speed)]
    rows += [("P", impact.normal_impulse, impulse)]
    rows += [] if at_joint else [("Pt", impact.tangential_impulse, impulse)]
    for name, value, unit in [*rows, ("T-", T, "J"), ("T+", rest, "J")]:
        sign = "" if value.centre.startswith("-") else " "
        page.print(f"  {name:2} {sign}{value} {unit}", no_wrap=True, overflow="ignore", crop=False)
    page.print()


def _write(found: Reference | Enclosure, out: Path, stem: str | None) -> None:
    """Write one file of the kind its name says, or both into a folder."""
    targets = [out] if stem is None else [out / f"{stem}{kind}" for kind in RESULTS]
    with nullcontext() if stem is None else new_folder(out):
        for target in targets:
            if target.suffix == ".json":
                write_json(target, found.document())
            else:
                with atomic_write(target) as file:
                    file.write_text(found.csv(), encoding="utf-8")
