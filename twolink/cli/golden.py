"""The command `twolink golden`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from twolink.cli.terminal import check_folder, say


def golden(
    out: Annotated[Path, typer.Option(help="Write the vectors into this folder.")],
    suite: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Only this suite. May be repeated.")
    ] = None,
) -> None:
    """Write the test vectors of the conformance kit.

    JSON files with certified values and derived bounds, their schemas, checksums, and a page that
    defines every field.
    """
    check_folder("--out", out)
    from twolink.conformance.golden import write_golden

    count = write_golden(out, suite)
    say(f"{out}: {count} files")
