"""How long others take: `uv run --extra engines python -m benchmarks.peers`.

The free chain for 10 s, from a state without symmetry, to an error of at most 1e-8 at the end. For
every method of every peer that is installed the coarsest knob is sought that meets the error, and
so that the next finer one does too: a hit by luck is none. Then it runs in turn with the bare
Taylor integrator, and the medians are compared, set-up apart. Each ratio stands beside the target
that was set for it, met or not.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.simulation import ERROR, EXACT, cheapest_order, taylor
from twolink.engines.peers import PEERS, Peer, PeerMethod, PeerRun, Prepared
from twolink.errors import EngineError
from twolink.scene import Scene
from twolink.shipped import shipped

# So long (s) one run may take; what needs longer is not waited for.
BUDGET = 8.0
# So long (s) the timed runs of a method may take together, and so many there are at most.
TIMING, ROUNDS = 10.0, 15

# How many times as long as Taylor they were expected to take; without a name, all methods.
TARGETS = {
    ("SciPy over Pinocchio", ""): 300.0,
    ("MuJoCo", "RK4"): 1000.0,
    ("Drake", ""): 1000.0,
    ("diffrax", ""): 10.0,
    ("heyoka", ""): 1.5,
}


@dataclass(frozen=True)
class Found:
    """The coarsest knob of a method that meets the error, and its error (rad, rad/s)."""

    peer: Peer
    method: PeerMethod
    run: Prepared
    knob: float
    error: float


class OutOfReach(Exception):  # noqa: N818
    """A method does not meet the error; the words say why."""


def knobs(kind: Literal["step", "tolerance"]) -> Iterator[float]:
    """Yield ever finer knobs: steps (s) halved, tolerances divided by √10."""
    if kind == "step":
        yield from (0.01 * 2.0**-power for power in range(20))
    else:
        yield from (10 ** (-power / 2) for power in range(12, 32))


def error_of(run: PeerRun) -> float:
    """Return the error at the end (rad, rad/s)."""
    return float(np.abs(np.array([*run.q[:, -1], *run.u[:, -1]]) - EXACT).max())


def sought(scene: Scene, peer: Peer, method: PeerMethod) -> Found:
    """Return the coarsest knob of a method that meets the error, as the next finer one does.

    Raises `OutOfReach` where the budget or rounding ends the search.
    """
    if method.order == 1:
        raise OutOfReach("of order 1, it would need some 1e9 steps")
    run, times = peer.prepared(scene, method.name), np.array([0.0, scene.duration])
    met: Found | None = None
    last, growth, least = 0.0, 2.0, float("inf")
    for knob in knobs(method.knob):
        if last * growth > BUDGET:
            if met is not None:
                return met
            raise OutOfReach(f"a run takes more than {BUDGET:g} s; so far {least:.0e} was reached")
        try:
            motion = run(knob, times)
        except EngineError as refusal:
            raise OutOfReach(str(refusal)) from refusal
        growth, last = (motion.seconds / last if last else 2.0), motion.seconds
        error = error_of(motion)
        least = min(least, error)
        if met is not None and error <= ERROR:
            return met
        met = Found(peer, method, run, knob, error) if error <= ERROR else None
    if met is not None:
        return met
    raise OutOfReach(f"a finer tolerance gains nothing; the least error was {least:.0e}")


def medians(scene: Scene, found: Found, order: int) -> tuple[float, float, float]:
    """Return the medians of a peer and of Taylor (s), run in turn, and the peer's spread."""
    times, bare = np.array([0.0, scene.duration]), taylor("momenta", scene, order)
    ours: list[float] = []
    theirs: list[float] = []
    rounds = max(1, min(ROUNDS, int(TIMING / found.run(found.knob, times).seconds)))
    for _ in range(rounds):
        # The first run after something else finds cold caches.
        ours += [bare()[1] for _ in range(3)][1:]
        quick = theirs == [] or statistics.median(theirs) < 0.1
        theirs.append([found.run(found.knob, times).seconds for _ in range(1 + quick)][-1])
    return statistics.median(theirs), statistics.median(ours), max(theirs) / min(theirs)


def target_of(found: Found) -> float | None:
    """Return the target that was set for a method, if one was."""
    for (peer, method), target in TARGETS.items():
        if peer == found.peer.name and method in ("", found.method.name):
            return target
    return None


def row(found: Found, theirs: float, ours: float, spread: float) -> list[str]:
    """Return a row of the table."""
    ratio, target = theirs / ours, target_of(found)
    judged = "" if target is None else f"{target:g} {'met' if ratio >= target else 'NOT MET'}"
    return [
        f"{found.peer.name}: {found.method.name}",
        f"{found.knob:.1e}",
        f"{found.error:.1e}",
        f"{theirs * 1e3:.3f}",
        f"{spread:.2f}{' !' if spread > 2 else ''}",
        f"{ours * 1e3:.3f}",
        f"{ratio:.1f}",
        judged,
    ]


def main() -> None:
    """Measure and print the table, and what is not in it."""
    console = Console(width=120)
    scene = Scene.load(shipped("scenes") / "general.toml")
    order = cheapest_order(scene)
    table = Table(title=f"10 s of the free chain to {ERROR:g}, beside Taylor of order {order}")
    table.add_column("peer: method")
    for column in ("knob", "error", "ms", "spread", "Taylor ms", "ratio", "target"):
        table.add_column(column, justify="right")
    left_out = []
    for peer in PEERS:
        sentence = peer.missing() or peer.cannot(scene)
        left_out += [sentence] if sentence else []
        for method in () if sentence else peer.methods:
            try:
                found = sought(scene, peer, method)
            except OutOfReach as reason:
                left_out.append(f"{peer.name}: {method.name}: {reason}")
            else:
                table.add_row(*row(found, *medians(scene, found, order)))
    console.print(table)
    for sentence in left_out:
        console.print(f"  {sentence}")


if __name__ == "__main__":
    main()
