"""diffrax: its solvers in JAX, compiled as a whole, in float64.

diffrax knows differential equations and no mechanics. It is given Lagrange's text of this library,
evaluated on JAX's tracers; solvers, step sizes and compiled code are its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from twolink import lagrange
from twolink.arithmetic import Pair
from twolink.chain import Chain, Rotor
from twolink.effects import Effect, breaks, nonsmooth, smooth_loads
from twolink.effects.gravity import Gravity
from twolink.effects.joint_torque import JointTorque
from twolink.engines.joint_model import JointModel, effect_name
from twolink.engines.peer import Peer, PeerMethod, PeerRun, Prepared
from twolink.engines.protocol import Array
from twolink.errors import EngineError
from twolink.scene import Scene


class Diffrax(Peer):
    """diffrax; see `twolink.engines.peer.Peer`.

    The knob is rtol and atol of its `PIDController`. Values between steps are diffrax's dense
    output. The first run for a number of samples compiles, which is counted as set-up.
    """

    name = "diffrax"
    methods = (
        PeerMethod("Tsit5", 5, "tolerance"),
        PeerMethod("Dopri8", 8, "tolerance"),
        PeerMethod("Kvaerno5", 5, "tolerance"),
    )
    packages = (("diffrax", "diffrax"), ("jax", "jax"))

    def cannot(self, scene: Scene) -> str | None:
        """Return why it cannot express a scene; None if it can."""
        for effect in scene.effects:
            if nonsmooth((effect,), scene.equipped):
                return (
                    f"{self.name} cannot express {effect_name(effect)}: it integrates smooth "
                    "equations; what happens after an event would have to be written anew"
                )
        if breaks(scene.effects):
            return (
                f"{self.name} cannot express sampled_torque: its fields are smooth, and each kink "
                "would have to be told to its step control"
            )
        return None

    def _prepared(self, scene: Scene, method: str) -> Prepared:
        """Return what runs a scene; it is compiled once for each number of samples."""
        import jax

        start = np.array([*scene.q, *scene.u], dtype=float)
        compiled: dict[int, tuple[Any, float]] = {}

        def run(tolerance: float, times: Array) -> PeerRun:
            with jax.enable_x64(True):
                given = [jax.numpy.asarray(x) for x in (start, times, float(tolerance))]
                if len(times) not in compiled:
                    begin = perf_counter()
                    solve = jax.jit(_solve(scene, method)).lower(*given).compile()
                    compiled[len(times)] = solve, perf_counter() - begin
                solve, setup = compiled[len(times)]
                begin = perf_counter()
                states, result, steps = jax.block_until_ready(solve(*given))
                seconds = perf_counter() - begin
            found = np.asarray(states).T
            _check(result)
            return PeerRun(found[:2], found[2:], seconds, setup, None, int(steps))

        return run

    def _accelerations(self, model: JointModel) -> Pair:
        """Return du (rad/s²) at the start of a model, by Lagrange's text compiled by JAX."""
        import jax

        with jax.enable_x64(True):
            state = jax.numpy.asarray(np.array([*model.q, *model.u], dtype=float))
            rates = jax.jit(_field(_with_rotors(model), _effects(model)))(0.0, state, None)
        return float(rates[2]), float(rates[3])


def _effects(model: JointModel) -> tuple[Effect, ...]:
    """Return the effects of a state: its gravity, and the torques of its motors."""
    size = model.size
    pull = (Gravity(size, model.gravity),) if size else ()
    return (*pull, JointTorque(model.torque))


def _with_rotors(model: JointModel) -> Chain:
    """Return the chain with the armature of its joints as rotors that turn as these do."""
    first, second = model.armature
    rotors = (Rotor(first, (1.0, 0.0)), Rotor(second, (-1.0, 1.0)))
    return replace(model.chain, rotors=tuple(rotor for rotor in rotors if rotor.inertia))


def _field(chain: Chain, effects: tuple[Effect, ...]) -> Callable[[Any, Any, Any], Any]:
    """Return the vector field of a chain under effects, as diffrax takes it."""
    from jax import numpy as jnp

    def field(t: Any, y: Any, _: Any) -> Any:
        q, u = (y[0], y[1]), (y[2], y[3])
        loads = smooth_loads(effects, chain, q, u, t)
        return jnp.stack([*u, *lagrange.forward_dynamics(chain, q, u, loads)])

    return field


def _solve(scene: Scene, method: str) -> Callable[[Any, Any, Any], Any]:
    """Return the function that is compiled: from start, times and tolerance to states."""
    import diffrax

    field = _field(scene.equipped.convert(float), scene.effects)
    term, solver = diffrax.ODETerm(field), getattr(diffrax, method)()

    def solve(start: Any, times: Any, tolerance: Any) -> Any:
        solution = diffrax.diffeqsolve(
            term,
            solver,
            t0=times[0],
            t1=times[-1],
            dt0=None,
            y0=start,
            saveat=diffrax.SaveAt(ts=times),
            stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance),
            max_steps=None,
            throw=False,
        )
        return solution.ys, solution.result, solution.stats["num_steps"]

    return solve


def _check(result: Any) -> None:
    """Raise `EngineError` with diffrax's own words unless it succeeded."""
    import diffrax

    if result != diffrax.RESULTS.successful:
        raise EngineError(f"diffrax gives up: {diffrax.RESULTS[result]}")
