"""The table of a campaign: how many scenes ended how, which checks failed, how long it took."""

from __future__ import annotations

from collections import Counter
from statistics import median

from tests.campaign.judge import (
    CRASH,
    CUT_SHORT,
    HANG,
    NOT_MET,
    OUTCOMES,
    REFUSED,
    VIOLATION,
    Judged,
)

# Number of refusals, in this number of scenes, that is no failure of the campaign.
_REFUSED, _OF = 5, 2000

# Scenes of at most this many seconds of motion that take longer to compute (s) are named.
_SHORT, _LONG = 3.0, 10.0


def is_good(results: list[Judged]) -> bool:
    """Return whether nothing is wrong, and few scenes are refused."""
    counts = Counter(judged.outcome for judged in results)
    bad = counts[VIOLATION] + counts[CRASH] + counts[HANG]
    return bad == 0 and (counts[REFUSED] + counts[CUT_SHORT]) * _OF <= _REFUSED * max(
        len(results), _OF
    )


def report(results: list[Judged], command: str) -> str:
    """Return the table, and each scene that is not well with one command to repeat it."""
    lines = [f"{len(results)} scenes", ""]
    counts = Counter(judged.outcome for judged in results)
    lines += [f"  {name:<13}{counts[name]:>6}" for name in OUTCOMES]
    failed = Counter(name for judged in results for name in {name for name, _ in judged.wrong})
    if failed:
        lines += ["", "scenes by violated check"]
        lines += [f"  {name:<34}{count:>6}" for name, count in failed.most_common()]
    remarks = [remark for judged in results for remark in judged.compared_with]
    compared = Counter(remark.split(" to ")[0].split(":")[0] for remark in remarks)
    if compared:
        lines += ["", "comparisons"]
        lines += [f"  {name:<34}{count:>6}" for name, count in compared.most_common()]
    lines += ["", *_times(results)]
    for judged in sorted(results, key=lambda judged: judged.index):
        lines += _details(judged, command)
    return "\n".join(lines)


def _times(results: list[Judged]) -> list[str]:
    seconds = [judged.seconds for judged in results] or [0.0]
    slowest = sorted(results, key=lambda judged: -judged.seconds)[:5]
    slow = [judged for judged in results if judged.seconds > _LONG and judged.duration <= _SHORT]
    return [
        f"seconds to simulate: median {median(seconds):.2f}, most {max(seconds):.1f}",
        "slowest: " + ", ".join(f"{judged.index} ({judged.seconds:.1f} s)" for judged in slowest),
        f"motions of at most {_SHORT:g} s that take above {_LONG:g} s: {len(slow)}"
        + "".join(f", {judged.index} ({judged.seconds:.1f} s)" for judged in slow),
    ]


def _details(judged: Judged, command: str) -> list[str]:
    """Return the lines on a scene that is not ok."""
    if judged.outcome in (VIOLATION, CRASH, HANG):
        lines = [f"  {name}: {sentence}" for name, sentence in judged.wrong]
        return ["", f"{judged.outcome}: {command} --only {judged.index}", *lines]
    if judged.outcome in (REFUSED, NOT_MET, CUT_SHORT):
        return ["", f"{judged.outcome}: {command} --only {judged.index}", f"  {judged.remark}"]
    return []
