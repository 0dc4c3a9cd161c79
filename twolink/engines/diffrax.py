"""diffrax: its solvers in JAX, compiled as a whole, in float64.

diffrax knows differential equations and no mechanics. It is given Lagrange's text of this library,
evaluated on JAX's tracers; solvers, step sizes and compiled code are its own.
"""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np

from twolink import lagrange
from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.effects import breaks, nonsmooth, smooth_loads
from twolink.effects.gravity import Gravity
from twolink.effects.joint_torque import JointTorque
from twolink.engines.joint_model import effect_name
from twolink.engines.peer import Installed, PeerMethod, PeerRun, Prepared, check_method
from twolink.engines.protocol import Array
from twolink.errors import EngineError
from twolink.scene import Scene

_SOLVERS = {"Tsit5": "Tsit5", "Dopri8": "Dopri8", "Kvaerno5": "Kvaerno5"}


class Diffrax:
    """diffrax; see `twolink.engines.peers.Peer`.

    The knob is rtol and atol of its `PIDController`. Values between steps are diffrax's dense
    output. The first run for a number of samples compiles, which is counted as set-up.
    """

    name = "diffrax"
    methods = (
        PeerMethod("Tsit5", 5, "tolerance"),
        PeerMethod("Dopri8", 8, "tolerance"),
        PeerMethod("Kvaerno5", 5, "tolerance"),
    )
    _installed = Installed(name, (("diffrax", "diffrax"), ("jax", "jax")))

    def missing(self) -> str | None:
        """Return the sentence that it is not installed; None if it is."""
        return self._installed.missing()

    def version(self) -> str:
        """Return the versions of diffrax and of JAX."""
        return self._installed.version()

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
                f"{self.name} cannot express sampled_torque: its equations would have kinks, "
                "and its steps would reach over them"
            )
        return None

    def prepared(self, scene: Scene, method: str) -> Prepared:
        """Return what runs a scene; it is compiled once for each number of samples."""
        self._installed.check()
        check_method(self.name, self.methods, method)
        sentence = self.cannot(scene)
        if sentence:
            raise EngineError(sentence)
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

    def accelerations(
        self,
        chain: Chain,
        q: Pair,
        u: Pair,
        *,
        gravity: Pair = (0.0, 9.81),
        torque: Pair = (0.0, 0.0),
    ) -> Pair:
        """Return du (rad/s²) at a state, by Lagrange's text compiled by JAX."""
        self._installed.check()
        import jax

        size = float(np.hypot(*gravity))
        pull = (Gravity(size, gravity),) if size else ()
        scene = Scene(chain, q, u, 1.0, (*pull, JointTorque(torque)))
        with jax.enable_x64(True):
            state = jax.numpy.asarray(np.array([*q, *u], dtype=float))
            rates = jax.jit(_field(scene))(0.0, state, None)
        return float(rates[2]), float(rates[3])


def _field(scene: Scene) -> Callable[[Any, Any, Any], Any]:
    """Return the vector field of a scene, as diffrax takes it."""
    from jax import numpy as jnp

    chain = scene.equipped.convert(float)

    def field(t: Any, y: Any, _: Any) -> Any:
        q, u = (y[0], y[1]), (y[2], y[3])
        loads = smooth_loads(scene.effects, chain, q, u, t)
        return jnp.stack([*u, *lagrange.forward_dynamics(chain, q, u, loads)])

    return field


def _solve(scene: Scene, method: str) -> Callable[[Any, Any, Any], Any]:
    """Return the function that is compiled: from start, times and tolerance to states."""
    import diffrax

    term, solver = diffrax.ODETerm(_field(scene)), getattr(diffrax, _SOLVERS[method])()

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
