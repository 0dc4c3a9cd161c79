"""One scene simulated and judged: its outcome, its violations, its time."""

from __future__ import annotations

import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tests.campaign.checks import violations
from tests.campaign.comparisons import COMPARISONS
from tests.campaign.draw import DRAWS
from tests.campaign.printing import Printed
from twolink import Scene, simulate
from twolink.errors import TwolinkError

OK, NOT_MET, OUT_OF_RANGE, REFUSED = "ok", "not met", "out of range", "refused"
CUT_SHORT, VIOLATION, CRASH, HANG = "cut short", "violation", "crash", "hang"
# Beyond these the laws of contact have no motion, and say so: a dent that is too deep for the
# elasto-plastic law, a chain that a rigid surface wedges where no finite force stops it, a rest by
# a grip that no load determines, a folded chain that turns about an end whose forces they do not
# determine, and Newton's law of restitution where it would multiply the energy by more than a
# million.
_RANGES = (
    "elasto-plastic", "is wedged", "such a rest is not simulated", "such motions are not simulated",
    "beyond the range of its law", "range of their laws",
)  # fmt: skip
OUTCOMES = (OK, NOT_MET, OUT_OF_RANGE, REFUSED, CUT_SHORT, VIOLATION, CRASH, HANG)


@dataclass(frozen=True)
class Judged:
    """The judgement of a scene: `wrong` has the names of failed checks with their sentences.

    `seconds` is the computing time of the simulation of a motion of `duration` (s), `remark` the
    sentence of a refusal or a note, and `compared_with` describes the outcomes of comparisons.
    """

    index: int
    outcome: str
    seconds: float
    wrong: tuple[tuple[str, str], ...] = ()
    remark: str = ""
    compared_with: tuple[str, ...] = ()
    duration: float = 0.0


def judge(
    seed: int,
    index: int,
    *,
    draw: str,
    comparisons: Sequence[str],
    report: Callable[[str, Any], None],
) -> Judged:
    """Return the judgement of a scene; `report` takes each stage and the judgement before it.

    `draw` is the kind of scene, one of `DRAWS`.
    """
    try:
        scene = DRAWS[draw](seed, index)
        scene.to_toml()
    except Exception:
        return Judged(index, CRASH, 0.0, (("draw", traceback.format_exc(limit=-3)),))
    judged, trajectory = _simulated(scene, index, report)
    if trajectory is None or not trajectory.met:
        return judged
    for name in comparisons:
        before = judged.compared_with
        report(name, replace(judged, compared_with=(*before, f"{name}: timed out")))
        with Printed():
            rng = np.random.default_rng([seed, index, *name.encode()])
            wrong, remark = COMPARISONS[name](trajectory, rng)
        outcome = VIOLATION if wrong else judged.outcome
        judged = replace(
            judged, outcome=outcome, wrong=(*judged.wrong, *wrong), compared_with=(*before, remark)
        )
    return judged


def _simulated(scene: Scene, index: int, report: Callable[[str, Any], None]) -> tuple[Judged, Any]:
    """Simulate a scene and check its trajectory, which is returned if there is one."""
    late = Judged(index, HANG, 0.0, (("hang", "simulate has not ended in time"),))
    report("simulate", replace(late, duration=scene.duration))
    started = time.process_time()
    trajectory, outcome, remark = None, OK, ""
    with Printed() as printed:
        try:
            trajectory = simulate(scene)
        except TwolinkError as error:
            remark = " ".join(str(error).split())
            outcome = OUT_OF_RANGE if _is_out_of_range(remark) else REFUSED
        except Exception as error:
            outcome, remark = CRASH, f"{type(error).__name__}: {str(error)[:300]}"
    seconds = time.process_time() - started
    wrong = [("printed", printed.text[:300])] if printed.text else []
    if trajectory is not None:
        report(
            "check", Judged(index, CRASH, seconds, (("check", "checks have not ended in time"),))
        )
        wrong += _checked(trajectory) if trajectory.t[-1] > 0 else []
        if not trajectory.met:
            outcome = CUT_SHORT if trajectory.failure else NOT_MET
            remark = " ".join(trajectory.notes)
            if trajectory.failure and _is_out_of_range(trajectory.failure):
                outcome = OUT_OF_RANGE
    outcome = VIOLATION if wrong and outcome != CRASH else outcome
    if outcome == CRASH:
        wrong = [("crash", remark), *wrong]
    found = Judged(index, outcome, seconds, tuple(wrong), remark, duration=scene.duration)
    return found, trajectory


def _is_out_of_range(sentence: str) -> bool:
    return any(word in sentence for word in _RANGES)


def _checked(trajectory: Any) -> list[tuple[str, str]]:
    """Return the violations of a trajectory; a failure of the checks is one, too."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return violations(trajectory)
    except Exception:
        return [("looking", traceback.format_exc(limit=-4))]
