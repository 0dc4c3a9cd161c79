"""diffrax: its solvers in JAX, in float64, with the whole run compiled.

diffrax solves differential equations and has no mechanics. It integrates this library's Lagrange
formulation, traced by JAX; solvers, step-size control and compiled code are diffrax's.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from time import perf_counter
from typing import Any

import numpy as np

from twolink import lagrange
from twolink.arithmetic import Pair
from twolink.chain import Chain, Rotor
from twolink.effects import Effect, contact_elements, discontinuities, smooth_loads
from twolink.effects.gravity import Gravity
from twolink.engines.contract import Array
from twolink.engines.joint_model import JointModel, effect_name
from twolink.engines.messages import Method
from twolink.engines.simulation_engine import EngineRun, EquationsEngine, Prepared
from twolink.errors import EngineError
from twolink.loads import motor_loads
from twolink.scene import Scene


class Diffrax(EquationsEngine):
    """diffrax; see `SimulationEngine`.

    The parameter is rtol and atol of its `PIDController`. Values between steps are diffrax's dense
    output. The first run for each number of samples compiles; that time counts as set-up.
    """

    name = "diffrax"
    methods = (
        Method(name="Tsit5", order=5, parameter="tolerance"),
        Method(name="Dopri8", order=8, parameter="tolerance"),
        Method(name="Kvaerno5", order=5, parameter="tolerance"),
    )
    packages = (("diffrax", "diffrax"), ("jax", "jax"))

    def unsupported(self, scene: Scene) -> str | None:
        """Return why the engine cannot express a scene, or None if it can."""
        for effect in scene.effects:
            if contact_elements((effect,), scene.moving_chain):
                return (
                    f"{self.name} cannot express {effect_name(effect)}: it integrates smooth "
                    "equations; event handling would have to be added to it"
                )
        if discontinuities(scene.effects):
            return (
                f"{self.name} cannot express sampled_torque: its fields are smooth, and each kink "
                "would have to be passed to its step-size control"
            )
        return None

    def _prepared(self, scene: Scene, method: str) -> Prepared:
        """Return a function that runs a scene, compiled once for each number of samples."""
        import jax

        start = np.array([*scene.q, *scene.u], dtype=float)
        compiled: dict[int, tuple[Any, float]] = {}

        def run(tolerance: float, times: Array) -> EngineRun:
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
            return EngineRun(found[:2], found[2:], seconds, setup, None, int(steps))

        return run

    def _accelerations(self, model: JointModel) -> Pair:
        """Return du (rad/s²) at the start of a model, by JAX's code of the Lagrange formulation."""
        import jax

        with jax.enable_x64(True):
            state = jax.numpy.asarray(np.array([*model.q, *model.u, *model.torque], dtype=float))
            first, second = _rates(_with_rotors(model), model.gravity)(state)
        return float(first), float(second)


@lru_cache(maxsize=32)
def _rates(chain: Chain, gravity: Pair) -> Callable[[Any], Any]:
    """Return du of angles, speeds and motor torques, shape (6,), compiled once for all states."""
    import jax

    size = math.hypot(*gravity)
    pull = (Gravity(size, gravity),) if size else ()

    def rates(state: Any) -> Any:
        q, u, torque = (state[0], state[1]), (state[2], state[3]), (state[4], state[5])
        loads = (*smooth_loads(pull, chain, q, u), *motor_loads(*torque))
        return lagrange.forward_dynamics(chain, q, u, loads)

    return jax.jit(rates)


def _with_rotors(model: JointModel) -> Chain:
    """Return the chain with the joints' armature as rotors of the same speed."""
    first, second = model.armature
    rotors = (Rotor(first, (1.0, 0.0)), Rotor(second, (-1.0, 1.0)))
    return replace(model.chain, rotors=tuple(rotor for rotor in rotors if rotor.inertia))


def _field(chain: Chain, effects: tuple[Effect, ...]) -> Callable[[Any, Any, Any], Any]:
    """Return the vector field of a chain under effects, in diffrax's signature."""
    from jax import numpy as jnp

    def field(t: Any, y: Any, _: Any) -> Any:
        q, u = (y[0], y[1]), (y[2], y[3])
        loads = smooth_loads(effects, chain, q, u, t)
        return jnp.stack([*u, *lagrange.forward_dynamics(chain, q, u, loads)])

    return field


def _solve(scene: Scene, method: str) -> Callable[[Any, Any, Any], Any]:
    """Return the function to be compiled: start, times and tolerance to states."""
    import diffrax

    field = _field(scene.moving_chain.convert(float), scene.effects)
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
    """Raise `EngineError` with diffrax's message unless it succeeded."""
    import diffrax

    if result != diffrax.RESULTS.successful:
        raise EngineError(f"diffrax stopped: {diffrax.RESULTS[result]}")
