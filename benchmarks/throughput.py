"""Trajectories per second at equal measured error, of a sweep and of other programs.

`benchmarks.ensembles` prints the table. All methods run the same random starts, and the error of
each is that of the final state against runs of `simulate` whose error is measured. Each method has
a number that makes it finer, such as a time step; the coarsest one that reaches the error, in a
quantile of the starts, is timed, in turn with the other methods. Compilation counts for none.
"""

from __future__ import annotations

import importlib.util
import math
import os
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import warp_kernel
from twolink.engines.approximation import approximate_model
from twolink.engines.joint_model import JOINTS
from twolink.engines.mujoco_engine import robot_of
from twolink.ensembles.chunk import rows_of
from twolink.ensembles.compiled import FORMULATION
from twolink.ensembles.ensemble import Ensemble
from twolink.ensembles.file import ensemble_of
from twolink.ensembles.run import sweep
from twolink.integration.precisions import PRECISIONS
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.smooth.equations import EQUATIONS

Array = NDArray[np.float64]

ERROR = 1e-6

SCENE = Scene.load("free_fall")
"""The chain of two uniform bars, for 10 s."""

# The required error of the references, far below that of the methods.
_REFERENCE = 1e-9

# A method that takes longer (s) is timed once.
_SLOW, _ROUNDS = 3.0, 4

# Values of a number that are tried; a method that needs more is left out.
_TRIES = 12

# Runs that a bare call integrates at once: in one register of AVX-512, the least cost of unrolled
# code.
_WIDTH = 8

# Accuracies of sweeps whose true errors may suffice, though the bounds on them are larger.
_COARSER = [10.0**-k for k in range(1, 7)]

# Steps of MuJoCo between which its states are not kept.
_AT_ONCE = 1000


def asked(count: int, keep: dict[str, Any], accuracy: float = ERROR) -> Ensemble:
    """Return a sweep of random poses; the first are the same for any count."""
    around = {"low": -1.5, "high": 4.6}
    axes = [{"parameter": f"start.q.{k}", "uniform": around} for k in (0, 1)]
    runs = {"draws": count, "accuracy": accuracy}
    return ensemble_of(
        {"scene": "free_fall", "axes": axes, "runs": runs, "keep": keep}, "<benchmark>", Path()
    )


def starts(count: int) -> Array:
    """Return q and u of random poses, shape (4, n)."""
    final = asked(count, {})
    return np.concatenate(final.family.starts(final.values(0, count)))


def bare(order: int, lanes: int = _WIDTH) -> Any:
    """Return heyoka's batch integrator of the same equations."""
    q1, q2, x1, x2 = heyoka().make_vars("q1", "q2", "x1", "x2")
    first, second = EQUATIONS[FORMULATION].rates(
        SCENE.moving_chain, SCENE.effects, (q1, q2), (x1, x2), heyoka().time
    )
    return heyoka().taylor_adaptive_batch(
        list(zip((q1, q2, x1, x2), (*first, *second), strict=True)),
        np.zeros((4, lanes)),
        tol=PRECISIONS["double"].step_tolerance(order),
        compact_mode=lanes > heyoka().recommended_simd_size(),
    )


def propagated(integrator: Any, given: Array) -> Array:
    """Return the ends of momenta, shape (4, n), by a bare call for each group of lanes."""
    lanes, found = integrator.state.shape[1], np.empty_like(given)
    for k in range(0, given.shape[1], lanes):
        count = given[:, k : k + lanes].shape[1]
        integrator.state[:, :count] = given[:, k : k + lanes]
        integrator.set_time(0.0)
        integrator.propagate_until(SCENE.duration)
        found[:, k : k + lanes] = integrator.state[:, :count]
    return found


def with_momenta(states: Array) -> Array:
    """Return (q, p) of (q, u), shape (4, n)."""
    q1, q2, u1, u2 = states
    return np.array([q1, q2, *EQUATIONS["momenta"].from_speeds(SCENE.chain, (q1, q2), (u1, u2))])


def with_speeds(states: Array) -> Array:
    """Return (q, u) of (q, p), shape (4, n)."""
    q1, q2, p1, p2 = states
    return np.array([q1, q2, *EQUATIONS["momenta"].to_speeds(SCENE.chain, (q1, q2), (p1, p2))])


def references(given: Array) -> tuple[Array, Array]:
    """Return the ends of starts, shape (4, n), and their measured errors, shape (n,)."""
    found, errors = np.empty_like(given), np.empty(given.shape[1])
    for k, (q1, q2, u1, u2) in enumerate(given.T.tolist()):
        scene = Scene(SCENE.chain, (q1, q2), (u1, u2), SCENE.duration, SCENE.effects)
        run = simulate(scene, accuracy=_REFERENCE, samples=2)
        found[:, k], errors[k] = [*run.q[:, -1], *run.u[:, -1]], run.error
    return found, errors


@dataclass
class Method:
    """A way to make the runs, and the numbers that make it finer and finer, with their unit.

    `run` maps starts (q, u), shape (4, n), and such a number to the ends. The first `runs` of the
    starts are timed, but errors are those of all references.
    """

    name: str
    run: Callable[[Array, Any], Array]
    numbers: list[Any]
    unit: str
    runs: int
    number: Any = None
    errors: Array = field(default_factory=lambda: np.empty(0))
    wall: float = math.inf
    processor: float = math.inf

    def found(self, given: Array, truth: Array, quantile: float) -> bool:
        """Set the coarsest number whose error suffices, and return whether one does."""
        for number in self.numbers[:_TRIES]:
            apart = np.abs(self.run(given, number) - truth).max(axis=0)
            self.number, self.errors = number, np.nan_to_num(apart, nan=math.inf)
            if np.quantile(self.errors, quantile) <= ERROR:
                return True
        return False

    def timed(self, given: Array) -> None:
        """Make the runs, and note the least wall and processor time of a run (s)."""
        if math.isfinite(self.wall) and self.wall * self.runs > _SLOW:
            return
        walls, processor = perf_counter(), process_time()
        self.run(given[:, : self.runs], self.number)
        self.processor = min(self.processor, (process_time() - processor) / self.runs)
        self.wall = min(self.wall, (perf_counter() - walls) / self.runs)


def methods(few: int, many: int) -> Iterator[Method]:
    """Yield the methods that are installed; those that are fast are timed on many starts."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
    final = {"final": True}

    def stored(given: Array, accuracy: float) -> Array:
        with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(cores) as executor:
            one = asked(given.shape[1], final, accuracy)
            made = sweep(one, Path(folder) / "a.zarr", executor=executor)
            return np.concatenate([made.array("q").T, made.array("u").T])

    def kept(given: Array, accuracy: float) -> Array:
        rows = rows_of(asked(given.shape[1], final, accuracy), 0, given.shape[1])
        return np.concatenate([rows.arrays["q"].T, rows.arrays["u"].T])

    integrators: dict[int, Any] = {}

    def bare_call(given: Array, order: int) -> Array:
        one = integrators.setdefault(order, integrators.get(order) or bare(order))
        return with_speeds(propagated(one, with_momenta(given)))

    yield Method(f"sweep with its store, {cores} threads", stored, [ERROR], "accuracy", many)
    yield Method("sweep in memory, 1 thread", kept, [ERROR], "accuracy", many)
    yield Method("coarser sweep, 1 thread", kept, _COARSER, "accuracy", many)
    # From rest an order that is a multiple of four may give an unbounded step.
    orders = [order for order in range(6, 21) if order % 4]
    yield Method("bare batch call, 1 thread", bare_call, orders, "order", many)
    halved = [SCENE.duration / 10_000 / 2.0**k for k in range(_TRIES)]
    if _installed("mujoco"):
        name = f"MuJoCo rollout, RK4, {cores} threads"
        yield Method(name, _rollout(cores), halved, "step (s)", few)
    if _installed("diffrax"):
        tolerances = [10.0 ** (-8 - k / 2) for k in range(_TRIES)]
        yield Method("diffrax vmap, Dopri8", _diffrax(), tolerances, "tolerance", few)
    if _installed("warp"):
        for device in warp_kernel.devices():
            run = _warp(device)
            numbers = [100 * 2**k for k in range(_TRIES)]
            count = few if device == "cpu" else many
            yield Method(f"Warp kernel, DOP853, {device}", run, numbers, "steps", count)


def _installed(name: str) -> bool:
    return importlib.util.find_spec(name) is not None


def _rollout(threads: int) -> Callable[[Array, float], Array]:
    """Return MuJoCo's rollout over threads, in parts of which the last states alone are kept."""
    import mujoco
    from mujoco import rollout

    robot = robot_of(mujoco, approximate_model(SCENE))
    robot.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    full = mujoco.mjtState.mjSTATE_FULLPHYSICS
    size = mujoco.mj_stateSize(robot, full)
    data = [mujoco.MjData(robot) for _ in range(threads)]

    def run(given: Array, step: float) -> Array:
        robot.opt.timestep = step
        q, u = (given[0], given[1]), (given[2], given[3])
        states = np.zeros((given.shape[1], size))
        # The time comes first.
        states[:, 1:3] = np.transpose(JOINTS.joint_angles(q))
        states[:, 3:5] = np.transpose(JOINTS.joint_speeds(u))
        left = round(SCENE.duration / step)
        with rollout.Rollout(nthread=threads) as pool:
            while left:
                count = min(left, _AT_ONCE)
                states = pool.rollout(robot, data, states, nstep=count)[0][:, -1]
                left -= count
        theta, speeds = states[:, 1:3].T, states[:, 3:5].T
        pairs = (
            JOINTS.absolute_angles((theta[0], theta[1])),
            JOINTS.absolute_speeds((speeds[0], speeds[1])),
        )
        return np.concatenate([np.array(pair) for pair in pairs])

    return run


def _diffrax() -> Callable[[Array, float], Array]:
    """Return diffrax over all starts at once, compiled, each with its own steps."""
    import diffrax
    import jax
    from jax import numpy as jnp

    def field(t: Any, y: Any, _: Any) -> Any:
        first, second = EQUATIONS["momenta"].rates(
            SCENE.moving_chain, SCENE.effects, (y[0], y[1]), (y[2], y[3]), t
        )
        return jnp.stack([*first, *second])

    def solved(start: Any, tolerance: Any) -> Any:
        control = diffrax.PIDController(rtol=tolerance, atol=tolerance)
        found = diffrax.diffeqsolve(
            diffrax.ODETerm(field), diffrax.Dopri8(), 0.0, SCENE.duration, None, start,
            stepsize_controller=control, max_steps=None, adjoint=diffrax.ForwardMode(),
        )  # fmt: skip
        return found.ys[-1]

    solve = jax.jit(jax.vmap(solved, in_axes=(0, None)))

    def run(given: Array, tolerance: float) -> Array:
        with jax.enable_x64(True):
            ends = solve(jnp.asarray(with_momenta(given).T), jnp.asarray(tolerance))
            return with_speeds(np.asarray(ends).T)

    return run


def _warp(device: str) -> Callable[[Array, int], Array]:
    def run(given: Array, steps: int) -> Array:
        momenta = np.ascontiguousarray(with_momenta(given).T)
        return with_speeds(warp_kernel.ends(SCENE, momenta, steps, device).T)

    return run


def compared(few: int, many: int, quantile: float) -> Iterator[str]:
    """Yield the lines of the comparison: errors on `few` starts, fast methods timed on `many`."""
    given = starts(many)
    truth, of_truth = references(given[:, :few])
    worst = f"{np.median(of_truth):.0e} median, {of_truth.max():.0e} at most"
    yield f"{few} starts, 10 s of two uniform bars; errors of the references: {worst}"
    yield f"settings are the coarsest for which {quantile:.0%} of the errors are below {ERROR:g}"
    reached = []
    for method in methods(few, many):
        if method.found(given[:, :few], truth, quantile):
            reached.append(method)
        else:
            left = np.quantile(method.errors, quantile)
            yield f"{method.name} left out: {method.unit} {method.number:.3g} leaves {left:.0e}"
    for method in reached:
        # Code for this number of starts is compiled.
        if method.runs != few:
            method.run(given[:, : method.runs], method.number)
    for _ in range(_ROUNDS):
        for method in reached:
            method.timed(given)
    first = reached[0]
    yield (
        f"{'':32s} {'':>20s} {'error: median':>14s} {'9 of 10':>8s} {'a second':>9s} "
        f"{'CPU µs':>9s} {'wall ×':>8s} {'CPU ×':>8s}"
    )
    for one in reached:
        setting = f"{one.unit} {one.number:.3g}"
        yield (
            f"{one.name:32s} {setting:>20s} {np.median(one.errors):14.1e} "
            f"{np.quantile(one.errors, 0.9):8.0e} {1 / one.wall:9.3g} {one.processor * 1e6:9.4g} "
            f"{one.wall / first.wall:8.3g} {one.processor / first.processor:8.3g}"
        )
    yield from _judged({one.name.partition(",")[0]: one.processor for one in reached})


# Ratios of processor times for one trajectory, that of the second to that of the first.
_MOST, _LEAST = 1.3, 1500.0


def _judged(costs: dict[str, float]) -> Iterator[str]:
    """Yield the ratios that have a target, from the processor time (s) of each method."""
    names = "sweep in memory", "coarser sweep", "bare batch call", "MuJoCo rollout"
    kept, coarser, plain, other = map(costs.get, names)
    if kept and plain:
        ratio, met = kept / plain, "met" if kept / plain <= _MOST else "NOT MET"
        yield f"the sweep costs {ratio:.2f} times the bare call (target: at most {_MOST:g}, {met})"
    if kept and coarser and other:
        ratio, met = other / coarser, "met" if other / coarser >= _LEAST else "NOT MET"
        yield (
            f"MuJoCo's rollout costs {other / kept:.0f} times the sweep, and {ratio:.0f} times the"
            f" coarser one, whose true errors suffice (target: {_LEAST:g}, {met})"
        )
