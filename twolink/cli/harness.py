"""The command `twolink harness`."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from twolink.cli.terminal import check_target, say


class Language(StrEnum):
    """The languages of the skeletons, as the command line names them."""

    c = "c"
    cpp = "cpp"
    js = "js"
    octave = "octave"


_SUFFIXES = {Language.octave: "m"}


def harness(
    language: Annotated[
        Language, typer.Argument(metavar="LANGUAGE", help="Language of the skeleton.")
    ],
    out: Annotated[
        Path | None, typer.Option(help="Write to this file. Default: engine with the suffix.")
    ] = None,
) -> None:
    """Write the skeleton of an engine for `twolink conform`.

    It is a whole engine of at most 150 lines: a planar chain in closed form. Its first lines say
    how to build it.
    """
    from twolink.data import harness_path
    from twolink.files import atomic_write

    name = f"engine.{_SUFFIXES.get(language, language.value)}"
    target = Path(name) if out is None else out
    check_target("--out", target)
    with atomic_write(target) as temporary:
        temporary.write_bytes((harness_path() / name).read_bytes())
    say(target)
