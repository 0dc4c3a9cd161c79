"""All peers: other people's engines on our scenes, one adapter an engine.

    for peer in PEERS:
        if not peer.missing() and not peer.cannot(scene):
            run = peer.prepared(scene, peer.methods[0].name)
            motion = run(1e-3, times)

No engine is imported before it is asked to do something.
"""

from __future__ import annotations

from twolink.engines.diffrax import Diffrax
from twolink.engines.drake import Drake
from twolink.engines.heyoka_lagrangian import HeyokaLagrangian
from twolink.engines.mujoco import Mujoco
from twolink.engines.peer import NearestPeer, Peer, PeerMethod, PeerRun, Prepared
from twolink.engines.pybullet import Pybullet
from twolink.engines.scipy_pinocchio import ScipyOverPinocchio
from twolink.engines.sympy_code import SympyCode
from twolink.errors import EngineError

__all__ = ["PEERS", "NearestPeer", "Peer", "PeerMethod", "PeerRun", "Prepared", "peer_named"]

PEERS: tuple[Peer, ...] = (
    HeyokaLagrangian(),
    ScipyOverPinocchio(),
    Mujoco(),
    Drake(),
    Diffrax(),
    Pybullet(),
    SympyCode(),
)


def peer_named(name: str) -> Peer:
    """Return the peer of a name, in letters of any case; `EngineError` names all that there are."""
    for peer in PEERS:
        if peer.name.casefold() == name.casefold():
            return peer
    allowed = ", ".join(peer.name for peer in PEERS)
    raise EngineError(f"engine is '{name}'; allowed are {allowed}")
