"""The ways of other engines: each method of each peer, with its own knob."""

from __future__ import annotations

from typing import Any

from twolink.accuracy.ways import STEPS, TOLERANCES, Outcome, Way
from twolink.engines.peers import PEERS, Peer, PeerMethod, Prepared
from twolink.scene import Scene


def peer_ways(scene: Scene) -> tuple[tuple[Way, ...], tuple[str, ...]]:
    """Return the ways of the engines that can express a scene, and why the others cannot."""
    ways: list[Way] = []
    left_out: list[str] = []
    for peer in PEERS:
        reason = peer.missing() or peer.cannot(scene)
        if reason:
            left_out.append(f"{peer.name}: {reason}")
        else:
            ways.extend(_way(scene, peer, method) for method in peer.methods)
    return tuple(ways), tuple(left_out)


def _way(scene: Scene, peer: Peer, method: PeerMethod) -> Way:
    ready: list[Prepared] = []

    def run(value: float, times: Any) -> Outcome:
        if not ready:
            # Nothing of an engine is built before its turn.
            ready.append(peer.prepared(scene, method.name))
        found = ready[0](value, times)
        return Outcome(
            q=found.q,
            u=found.u,
            seconds=found.seconds,
            compile_seconds=found.setup_seconds,
            steps=found.steps,
            evaluations=found.evaluations,
            warnings=found.warnings,
        )

    ladder = TOLERANCES if method.knob == "tolerance" else STEPS
    return Way(peer.name, method.name, "", "double", method.order, method.knob, ladder, run)
