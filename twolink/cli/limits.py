"""The option --force, which lifts the limits of time, memory and work."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from twolink.limits import Limits

Force = Annotated[
    bool,
    typer.Option(
        "--force",
        help="Run on, even if it takes more than an hour or more than 4 GB of memory, if a motion "
        "has thousands of modes, or if it takes thousands of steps in 113 bits.",
    ),
]


def limits_of(force: bool) -> Limits:
    """Return the limits of a run; with --force, no limits."""
    from twolink.limits import DEFAULT_LIMITS, UNLIMITED

    return UNLIMITED if force else DEFAULT_LIMITS
