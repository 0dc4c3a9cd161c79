"""The same effects in every engine: `uv run --extra engines python -m benchmarks.same_effects`.

One motion for each effect: the chain of two bars falls for a second with a spring, a damper, an
armature, dry friction, a joint stop or a surface. Every installed engine that has such an element,
or a law of its own in its place, runs it with its default method at three finer and finer
parameters. The table has the largest difference of an angle (rad) at the end from the exact
motion: it falls if the engine's motion converges to this law, and levels off if the engine has
another one. For stops and surfaces it also has the ratio of the normal speeds 5 ms after and
before the first impact at the finest step, beside the exact one.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from twolink import Chain, Scene, Trajectory, kinematics, simulate
from twolink.effects import (
    Effect,
    Gravity,
    JointDamping,
    JointFriction,
    JointSpring,
    JointStop,
    MotorInertia,
    Surface,
)
from twolink.engines.registry import SIMULATORS
from twolink.engines.simulation_engine import ApproximatingEngine, Prepared, SimulationEngine
from twolink.errors import EngineError

DURATION = 1.0
# Parameters of methods with a step (s) and of methods with a tolerance.
STEPS, TOLERANCES = (1e-2, 1e-3, 1e-4), (1e-4, 1e-7, 1e-10)

# Time (s) before and after an impact at which speeds are compared.
BESIDE = 5e-3

FLOOR = (0.0, 1.2), (0.0, -1.0)
EFFECTS: dict[str, Effect] = {
    "spring": JointSpring((20.0, 10.0), (0.5, 0.2)),
    "damper": JointDamping((1.0, 0.5)),
    "armature": MotorInertia(inertia=(0.2, 0.1), ratio=(1.0, 1.0), carried=False),
    "dry friction, slips": JointFriction((2.5, 0.6)),
    "dry friction, sticks": JointFriction((20.0, 6.0)),
    "joint stop, e = 0": JointStop("A", upper=1.2),
    "joint stop, e = 0.5": JointStop("A", upper=1.2, restitution=0.5),
    "surface, e = 0": Surface(*FLOOR),
    "surface, e = 0.5": Surface(*FLOOR, restitution=0.5),
    "surface, e = 0, μ = 0.3": Surface(*FLOOR, friction=0.3),
}


class Row(NamedTuple):
    """The differences (rad) of an engine at its three parameters, and ratios of normal speeds.

    Without differences, the engine has no such element.
    """

    effect: str
    engine: SimulationEngine
    differences: tuple[float, ...] = ()
    rebound: tuple[float, float] | None = None


def scene_with(effect: Effect) -> Scene:
    """Return the falling chain with gravity and an effect."""
    chain = Chain.uniform_bars(mass=(1.0, 1.0), length=(1.0, 1.0))
    return Scene(
        chain=chain, q=(0.3, -0.4), u=(0.0, 0.0), duration=DURATION, effects=(Gravity(9.81), effect)
    )


def row_of(engine: SimulationEngine, name: str) -> Row:
    """Return the differences of an engine's motion with an effect from the exact one."""
    scene = scene_with(EFFECTS[name])
    exact = simulate(scene, accuracy=1e-12, samples=2)
    method = engine.methods[0]
    try:
        if isinstance(engine, ApproximatingEngine):
            run = engine.prepared(scene, method.name, approximate=True)
        else:
            run = engine.prepared(scene, method.name)
        settings = STEPS if method.parameter == "step" else TOLERANCES
        times = np.array([0.0, DURATION])
        ends = [run(setting, times).q[:, -1] for setting in settings]
        rebound = rebounds(run, settings[-1], exact) if exact.impacts else None
    except EngineError:
        return Row(name, engine)
    differences = tuple(float(np.abs(end - exact.q[:, -1]).max()) for end in ends)
    return Row(name, engine, differences, rebound)


def rebounds(run: Prepared, setting: float, exact: Trajectory) -> tuple[float, float]:
    """Return the ratios of speeds across the first impact, of an engine and the exact one."""
    impact = exact.impacts[0].time
    times = np.array([0.0, impact - BESIDE, impact + BESIDE])
    found = run(setting, times)
    known = exact.at(times)
    return _ratio(exact.scene, found.q, found.u), _ratio(exact.scene, *known)


def _ratio(scene: Scene, q: np.ndarray, u: np.ndarray) -> float:
    """Return minus the ratio of the last two speeds of the limited coordinate."""
    stop = isinstance(scene.effects[-1], JointStop)
    v = (
        u[0]
        if stop
        else np.array(kinematics.velocity(scene.chain, tuple(q), tuple(u), scene.chain.D)[1])
    )
    return float(-v[-1] / v[-2])


def rows() -> Iterator[Row]:
    """Yield a row for each effect and installed engine."""
    for name in EFFECTS:
        for engine in SIMULATORS:
            if not engine.missing():
                yield row_of(engine, name)


def main() -> None:
    """Print the table."""
    table = Table("effect", "engine", "coarse", "middle", "fine", "rebound", "exact", box=None)
    methods: dict[str, str] = {}
    for row in rows():
        if row.differences:
            method = row.engine.methods[0]
            methods[row.engine.name] = f"{row.engine.name} by {method.name} ({method.parameter})"
            errors = [f"{difference:.0e}" for difference in row.differences]
            ratios = (
                [f"{round(ratio, 3) + 0.0:.3f}" for ratio in row.rebound]
                if row.rebound
                else ["", ""]
            )
            table.add_row(row.effect, row.engine.name, *errors, *ratios)
    page = Console(width=100)
    page.print(table)
    page.print(f"Steps {STEPS} s, tolerances {TOLERANCES}; rad at {DURATION:g} s.")
    page.print("; ".join(methods.values()) + ".", soft_wrap=True)


if __name__ == "__main__":
    main()
