"""The command `twolink reference`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twolink.cli.terminal import (
    FAILED,
    check_folder,
    check_target,
    console,
    progress_bar,
    refuse,
    write_json,
)
from twolink.errors import TwolinkError
from twolink.files import written_whole

if TYPE_CHECKING:
    from twolink.accuracy.reference import Reference

_KINDS = (".json", ".csv")


def reference(
    scenes: Annotated[list[Path], typer.Argument(help="Scene files (TOML); see `twolink scenes`.")],
    digits: Annotated[int, typer.Option(help="Right digits after the decimal point.")] = 60,
    times: Annotated[
        str, typer.Option(help="Times in s, separated by commas. Default: the end.")
    ] = "",
    fifths: Annotated[
        bool, typer.Option("--fifths", help="Take the times at each fifth of the run.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Write a .json or .csv file; for several scenes a folder, in which each has both."
        ),
    ] = None,
) -> None:
    """Compute a motion to any number of digits, vouched for by two runs that differ.

    They differ in precision, order and equations. Where a motion has events, 113 bits give fewer
    digits: as many as are asked for, up to 28. Exit code 0: all digits are there. 1: fewer, as
    printed. 2: the input was refused.
    """
    several = len(scenes) > 1 or (out is not None and out.is_dir())
    if several:
        check_folder("--out", out)
    else:
        check_target("--out", out, _KINDS)
    complete = True
    for file in scenes:
        found = _found(file, digits, _times(times), fifths, several)
        _print(found)
        if out is not None:
            _write(found, out, file.stem if several else None)
        complete &= min(found.digits) >= min(digits, _most(found))
    if not complete:
        raise typer.Exit(FAILED)


def _found(
    file: Path, digits: int, times: tuple[float, ...] | None, fifths: bool, several: bool
) -> Reference:
    from twolink.accuracy.reference import most_digits
    from twolink.accuracy.reference import reference as computed
    from twolink.scene import Scene

    try:
        scene = Scene.load(file)
        if fifths:
            times = tuple(scene.duration * part / 5 for part in range(1, 6))
        # A list of scenes gets what each can give; one scene gets what was asked, or a refusal.
        wanted = min(digits, most_digits(scene)) if several else digits
        with progress_bar() as bar:
            task = bar.add_task("computing", total=1.0)
            return computed(
                scene,
                wanted,
                times,
                progress=lambda what, share: bar.update(
                    task, description=f"{file.stem}: {what}", completed=share
                ),
            )
    except TwolinkError as error:
        refuse(str(error))


def _most(found: Reference) -> int:
    from twolink.accuracy.reference import most_digits

    return most_digits(found.scene)


def _times(text: str) -> tuple[float, ...] | None:
    if not text:
        return None
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        refuse(f"--times is '{text}'; allowed are numbers of seconds, separated by commas")


def _print(found: Reference) -> None:
    page = console()
    page.print(f"[bold]{found.scene.title}[/]")
    one, other = found.runs
    page.print(
        f"vouched for by {one.equations} (order {one.order}, {one.bits} bits) and "
        f"{other.equations} (order {other.order}, {other.bits} bits)",
        soft_wrap=True,
    )
    for time, digits, state in zip(found.times, found.digits, found.states, strict=True):
        page.print(f"\n  t = {time!r} s, {digits} digits")
        for name, value, unit in zip(
            ("q1", "q2", "u1", "u2"), state, ("rad", "rad", "rad/s", "rad/s"), strict=True
        ):
            page.print(
                f"  {name} {'' if value.startswith('-') else ' '}{value} {unit}", soft_wrap=True
            )
    page.print()


def _write(found: Reference, out: Path, stem: str | None) -> None:
    """Write one file of the kind its name says, or both into a folder."""
    if stem is not None:
        out.mkdir(parents=True, exist_ok=True)
    targets = [out] if stem is None else [out / f"{stem}{kind}" for kind in _KINDS]
    for target in targets:
        if target.suffix == ".json":
            write_json(target, found.document())
        else:
            with written_whole(target) as file:
                file.write_text(found.csv(), encoding="utf-8")
