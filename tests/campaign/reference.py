"""A trajectory against a far more accurate run of other equations."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.random import Generator

from tests.campaign.seen import Seen
from tests.campaign.verdict import worst
from twolink import simulate
from twolink.errors import TwolinkError

ACCURACY, FORMULATION = 1e-14, "kane"

# In a note that says this, two motions are right, and two runs may take one each.
_CHOICE = "leave a choice"


def compared(trajectory: Any, _: Generator) -> tuple[list[tuple[str, str]], str]:
    """Return where a trajectory's error is above the reported one, and a remark."""
    try:
        reference = simulate(trajectory.scene, accuracy=ACCURACY, formulation=FORMULATION)
    except TwolinkError as error:
        return [], f"no reference: {error}"
    except Exception as error:
        return [("reference crash", f"{type(error).__name__}: {str(error)[:200]}")], "crash"
    if leaves_a_choice(trajectory, reference):
        return [], "not compared: the laws of contact leave a choice"
    return parting(trajectory, reference), f"reference to {reference.error:.1g}"


def leaves_a_choice(*runs: Any) -> bool:
    """Return whether a note of a run says that the laws admit another motion."""
    return any(_CHOICE in note for run in runs for note in run.notes)


def parting(trajectory: Any, reference: Any) -> list[tuple[str, str]]:
    """Return where a trajectory differs from a reference by more than the errors of both.

    Times so near to an impact that they may be before or after it are left out, and those from
    which on the reference does not hold.
    """
    seen = Seen(trajectory)
    unsure = reference.error
    until = min(seen.until, float(reference.t[-1]))
    if not (reference.met or unsure <= trajectory.accuracy / 10):
        until, unsure = min(until, _known_until(reference)), reference.accuracy
        if reference.holds_until <= 0:
            return []
    found = []
    for where, every in (("at samples", trajectory.t), ("between samples", seen.t)):
        times = every[(every <= until) & _beside_no_impact(every, trajectory, reference)]
        if len(times) == 0:
            continue
        ours, theirs = np.concatenate(trajectory.at(times)), np.concatenate(reference.at(times))
        off = np.abs(ours - theirs).max(axis=0)
        rounding = 4 * np.spacing(np.abs(theirs).max(axis=0))
        allowed = trajectory.error + unsure + rounding
        said = worst(seen, "the error", off, allowed, "is", t=times)
        if said:
            found.append((f"reported error {where}", f"{said}; reported {trajectory.error:.2g}"))
    return found


def _known_until(reference: Any) -> float:
    return float(reference.holds_until)


def _beside_no_impact(times: Any, *runs: Any) -> Any:
    """Return which times (s) are no nearer to any impact than twice the accuracy of a run.

    Times between the last impact seen and the end of bounces that die away are excluded too.
    """
    allowed = 2 * max(run.accuracy for run in runs)
    clear = np.ones(len(times), dtype=bool)
    for run in runs:
        struck = [(impact.time, impact.time) for impact in run.impacts]
        struck += [(e.entered, e.time) for e in run.events if e.entered < e.time]
        for first, last in struck:
            near = np.searchsorted(times, [first - allowed, last + allowed])
            clear[near[0] : near[1]] = False
    return clear
