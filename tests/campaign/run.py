"""Running many scenes in worker processes; one that takes too long is killed and replaced."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection, wait
from typing import Any

import numpy as np

from tests.campaign.comparisons import COMPARISONS
from tests.campaign.judge import CRASH, Judged, judge
from tests.processes import computed

# Scenes a worker does before it is replaced: compiled code takes memory.
_SCENES_A_WORKER = 150

# Limits of waiting, in units of those of computing.
_ASLEEP = 10

# Time limit (s) of the checks of a scene.
_CHECKS = 300.0


@dataclass(frozen=True)
class Campaign:
    """A seed, a kind of scenes, time limits, and the shares of scenes that are compared.

    Limits are seconds of computing, so that other work on the machine does not change the outcome;
    a process that waits is ended after `_ASLEEP` times as many. `judge` judges one scene in a
    worker process, so it must be picklable.
    """

    seed: int
    limit: float = 60.0
    shares: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(COMPARISONS, 0.1))
    comparison_limit: float = 120.0
    judge: Callable[..., Judged] = judge
    draw: str = "any"

    def comparisons(self, index: int) -> tuple[str, ...]:
        """Return the comparisons of a scene: always the same ones of a seed."""
        drawn = np.random.default_rng([self.seed, index, 1]).random(len(COMPARISONS))
        return tuple(
            name for name, x in zip(COMPARISONS, drawn, strict=True) if x < self.shares[name]
        )

    def seconds(self, stage: str) -> float:
        """Return the time limit (s) of a stage."""
        limits = {"simulate": self.limit, "check": _CHECKS}
        limits |= dict.fromkeys(COMPARISONS, self.comparison_limit)
        # The start of a worker includes imports.
        return limits.get(stage, 120.0)


class Worker:
    """A process that judges scenes, and its last report."""

    def __init__(self, campaign: Campaign) -> None:
        context = multiprocessing.get_context("spawn")
        self.campaign = campaign
        self.pipe, other = context.Pipe()
        self.process = context.Process(target=_work, args=(campaign, other), daemon=True)
        self.process.start()
        other.close()
        self.done = 0
        self.index: int | None = None
        self.known: Judged | None = None
        self.deadlines = 0.0, 0.0

    def begin(self, index: int) -> None:
        """Hand over a scene."""
        self.index, self.known = index, None
        self._expect("start")
        self.pipe.send(index)

    def heard(self) -> Judged | None:
        """Return the judgement if it is there; note a stage that begins."""
        try:
            stage: str
            judged: Judged
            stage, judged = self.pipe.recv()
        except (EOFError, OSError):
            self.process.join(5)
            return self._ended(f"the process died with exit code {self.process.exitcode}")
        if stage == "done":
            self.done, self.index = self.done + 1, None
            return judged
        self.known = judged
        self._expect(stage)
        return None

    def _expect(self, stage: str) -> None:
        """Set the ends of a stage that begins: in seconds of computing, and by the clock."""
        limit = self.campaign.seconds(stage)
        self.deadlines = self._computed() + limit, time.monotonic() + _ASLEEP * limit

    def _computed(self) -> float:
        """Return the seconds that the process has computed, 0 if it has ended."""
        try:
            return computed(self.process.pid or 0)
        except OSError:
            return 0.0

    def late(self) -> Judged | None:
        """Return the partial judgement of a scene that has taken too long, and end the process."""
        work, clock = self.deadlines
        if self.index is None or (self._computed() < work and time.monotonic() < clock):
            return None
        if self.known is None:
            return self._ended("drawing the scene has not ended in time")
        known, limit = self.known, self.campaign.limit
        self._kill()
        return known if known.seconds else replace(known, seconds=limit)

    def _ended(self, how: str) -> Judged:
        assert self.index is not None
        known = self.known or Judged(self.index, CRASH, 0.0)
        self._kill()
        earlier = known.wrong if known.seconds else ()
        return replace(known, outcome=CRASH, wrong=(("crash", how), *earlier))

    def _kill(self) -> None:
        self.process.kill()
        self.process.join()
        self.done = _SCENES_A_WORKER

    def close(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.join()
        self.pipe.close()


def _work(campaign: Campaign, pipe: Connection) -> None:
    """Judge scenes as they come in, until the pipe is closed."""

    def report(stage: str, judged: Any) -> None:
        pipe.send((stage, judged))

    while True:
        try:
            index = pipe.recv()
        except EOFError:
            return
        comparisons = campaign.comparisons(index)
        judged = campaign.judge(
            campaign.seed, index, draw=campaign.draw, comparisons=comparisons, report=report
        )
        report("done", judged)


def judged_scenes(
    campaign: Campaign, indices: list[int], workers: int, progress: Callable[[str], None]
) -> Iterator[Judged]:
    """Yield the judgement of each scene, as they are done."""
    waiting = list(reversed(indices))
    crew = [Worker(campaign) for _ in range(min(workers, len(indices)))]
    try:
        left = len(indices)
        for worker in crew:
            worker.begin(waiting.pop())
        while left:
            ready = wait([worker.pipe for worker in crew if worker.index is not None], timeout=0.5)
            for place, worker in enumerate(crew):
                if worker.index is None:
                    continue
                judged = worker.heard() if worker.pipe in ready else worker.late()
                if judged is None:
                    continue
                left -= 1
                yield judged
                crew[place] = _next(worker, campaign, waiting)
            progress(f"{len(indices) - left} of {len(indices)} scenes")
    finally:
        for worker in crew:
            worker.close()


def _next(worker: Worker, campaign: Campaign, waiting: list[int]) -> Worker:
    """Hand the next scene to a worker, or to a new one in its place, and return it."""
    worker.index = None
    if not waiting:
        return worker
    if worker.done >= _SCENES_A_WORKER:
        worker.close()
        worker = Worker(campaign)
    worker.begin(waiting.pop())
    return worker
