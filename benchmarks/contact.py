"""The cost of contact, and the convergence of compliant contact to rigid contact.

`uv run python -m benchmarks.contact` measures 10 s of a chain of uniform bars over a floor, with
about 50 impacts, against the same chain without the floor; the difference between the rebound from
floors of increasing stiffness and the rigid law's; and the restitution of a yielding floor. With
`--plot FILE` the last two are drawn to an .svg or .png file.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
import time
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import quad
from scipy.optimize import brentq

from twolink.chain import Chain
from twolink.contact.elastoplastic import Material
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.surface import Surface
from twolink.environment import load_of_machine
from twolink.limits import UNLIMITED
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.motion import motion_run
from twolink.viz.plots.rigid_limit import Limit, Restitution, contact_plot
from twolink.viz.plots.style import save

ROUNDS = 15
TIMES = np.linspace(0.0, 10.0, 501)
FALL = Scene(
    chain=Chain.uniform_bars(), q=(0.3, -0.2), u=(0.0, 0.0), duration=10.0, effects=(Gravity(),)
)
FLOOR = Surface((0.0, 1.2), (0.0, -1.0), restitution=0.9, name="floor")

POSE = (0.3, 1.1)
HEIGHT = math.sin(POSE[0]) + math.sin(POSE[1])
LAWS = {
    "kelvin-voigt": ("Kelvin-Voigt", Fraction(1, 2), "N/m"),
    "hertz": ("Hertz", Fraction(2, 5), "N/m$^{3/2}$"),
}
DECADES = range(5, 12)

# The whole mass, 1 kg, is in D. The ball is made of steel, the floor of aluminium.
POINT = Chain(
    mass=(1e-12, 1.0), length=(1.0, 1.0), centre=((0.5, 0.0), (1.0, 0.0)), inertia=(1e-14, 1e-14)
)
YIELDING = CompliantSurface(
    (0.0, HEIGHT), (0.0, -1.0), "elasto-plastic", radius=0.02, modulus=(2.1e11, 7e10),
    poisson=(0.3, 0.33), strength=(1e9, 1e8),
)  # fmt: skip
MATERIAL = Material(1 / ((1 - 0.3**2) / 2.1e11 + (1 - 0.33**2) / 7e10), 0.02, 1e8, 0.33)
SPEEDS = tuple(float(v) for v in np.geomspace(3e-4, 2.0, 16))


def main() -> None:
    """Measure, print all tables, and draw the plot if requested."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--plot", type=Path, help="draw the limit to this .svg or .png file")
    arguments.add_argument("--theme", default="light", help="light or dark")
    asked = arguments.parse_args()
    print_cost()
    limits = [limit(law) for law in LAWS]
    print_limits(limits)
    given_back = restitution()
    print_restitution(given_back)
    if asked.plot is not None:
        save(contact_plot(limits, given_back, asked.theme), asked.plot)


def print_cost() -> None:
    """Print the cost of a scene with impacts against the same scene without the floor."""
    scenes = {"free": FALL, "over the floor": replace(FALL, effects=(*FALL.effects, FLOOR))}
    times: dict[str, list[float]] = {name: [] for name in scenes}
    runs = {}
    for _ in range(ROUNDS + 1):
        for name, scene in scenes.items():
            start = time.process_time()
            runs[name] = motion_run(scene, TIMES, formulation="lagrange", limits=UNLIMITED)
            times[name].append(time.process_time() - start)
    title = f"10 s in one run of the integrator, without compiling, median of {ROUNDS}"
    table = Table(title=f"{title}, processor time")
    table.add_column("scene")
    for column in ("impacts", "steps", "ms", "ratio", "spread"):
        table.add_column(column, justify="right")
    first = statistics.median(times["free"][1:])
    for name, taken in times.items():
        median, spread = statistics.median(taken[1:]), max(taken[1:]) / min(taken[1:])
        run = runs[name]
        table.add_row(
            name, f"{len(run.log)}", f"{run.steps}", f"{median * 1e3:.2f}", f"{median / first:.2f}",
            f"{spread:.2f}",
        )  # fmt: skip
    Console(width=100).print(table)
    print(f"load of the machine: {load_of_machine()}; Python {sys.version}")


def limit(law: str) -> Limit:
    """Return the convergence of a compliant law's rebound to that of the rigid law."""
    stiffness = tuple(10.0**exponent for exponent in DECADES)
    misses = tuple(miss(law, k) for k in stiffness)
    rate = -float(np.polyfit(np.log(stiffness[-4:]), np.log(misses[-4:]), 1)[0])
    name, expected, unit = LAWS[law]
    return Limit(name, unit, stiffness, misses, rate, expected)


def print_limits(limits: list[Limit]) -> None:
    """Print the convergence of rebounds to the rigid law's, with the measured rates."""
    table = Table(title="Rebound at 1 m/s, sliding at 3 m/s with friction 0.1, without loss")
    table.add_column("law")
    for column in ("stiffness (SI)", "difference to the rigid law (m/s)", "rate", "expected rate"):
        table.add_column(column, justify="right")
    for found in limits:
        for place, (stiffness, missed) in enumerate(
            zip(found.stiffness, found.misses, strict=True)
        ):
            rate = math.log10(found.misses[place - 1] / missed) if place else math.nan
            measured = f"{rate:.3f}" if place else ""
            row = f"{stiffness:.0e}", f"{missed:.2e}", measured, str(found.expected)
            table.add_row(found.law, *row)
        table.add_row(found.law, "last four", "", f"{found.rate:.3f}", str(found.expected))
    Console(width=100).print(table)


def restitution() -> Restitution:
    """Return the restitution of a yielding floor, simulated and by the areas of its law."""
    deepest = [float(brentq(_short_of, 1e-9, 0.01, args=(v,), xtol=1e-18)) for v in SPEEDS]
    given = [work_of_restitution(depth) for depth in deepest]
    computed = [math.sqrt(2 * work) / v for work, v in zip(given, SPEEDS, strict=True)]
    yields = math.sqrt(2 * work_of_compression(MATERIAL.yield_depth))
    return Restitution(
        "1 kg of steel on aluminium",
        SPEEDS,
        tuple(rebound(v) / v for v in SPEEDS),
        tuple(computed),
        yields,
    )


def _short_of(depth: float, speed: float) -> float:
    return work_of_compression(depth) - speed * speed / 2


def work_of_compression(depth: float) -> float:
    """Return the work (J) of a first compression to a depth (m)."""
    edges = [0.0, *(d for d in (MATERIAL.flow_depth,) if d < depth), depth]
    parts = (
        quad(MATERIAL.compression, low, high, epsabs=0, epsrel=1e-12)[0]
        for low, high in pairwise(edges)
    )
    return float(sum(parts))


def work_of_restitution(depth: float) -> float:
    """Return the work (J) restored from a maximal depth (m)."""
    stays = MATERIAL.residual(depth) if depth > MATERIAL.yield_depth else 0.0
    return float(2 / 5 * MATERIAL.compression(depth) * (depth - stays))


def rebound(speed: float) -> float:
    """Return the speed (m/s) at which D leaves a yielding floor."""
    J = np.array([[math.cos(q) for q in POSE], [-math.sin(q) for q in POSE]])
    u1, u2 = np.linalg.solve(J, [speed, 0.0]).tolist()
    start = replace(
        FALL, chain=POINT, q=POSE, u=(u1, u2), duration=0.02, effects=(YIELDING,), accuracy=1e-10
    )
    return -float(simulate(start).velocity(POINT.D)[1, -1])


def print_restitution(found: Restitution) -> None:
    """Print the restitution of all speeds, simulated and computed."""
    table = Table(title=f"A yielding floor: {found.material}")
    for column in ("speed (m/s)", "restitution, simulated", "by the law's areas", "difference"):
        table.add_column(column, justify="right")
    for v, measured, computed in zip(found.speeds, found.measured, found.computed, strict=True):
        table.add_row(
            f"{v:.4g}", f"{measured:.9f}", f"{computed:.9f}", f"{abs(measured - computed):.1e}"
        )
    Console(width=100).print(table)


def miss(law: str, stiffness: float) -> float:
    """Return the difference of D's speeds after a compliant and after a rigid contact."""
    J = np.array([[-math.cos(q) for q in POSE], [-math.sin(q) for q in POSE]])
    u1, u2 = np.linalg.solve(J, [-1.0, 3.0]).tolist()
    place = (0.0, HEIGHT), (0.0, -1.0)
    start = replace(FALL, q=POSE, u=(u1, u2), duration=0.3, effects=(), accuracy=1e-10)
    rigid = simulate(replace(start, effects=(Surface(*place, restitution=1.0, friction=0.1),)))
    soft = simulate(
        replace(start, effects=(CompliantSurface(*place, law, stiffness, friction=0.1),))  # type: ignore[arg-type]
    )
    leaves = next(event.time for event in soft.events if str(event.mode) == "moves freely")
    q, u = soft.at(leaves)
    after = np.array([[-math.cos(x) for x in q[:, 0]], [-math.sin(x) for x in q[:, 0]]]) @ u[:, 0]
    return float(np.abs(after - J @ rigid.impacts[0].u[1]).max())


if __name__ == "__main__":
    main()
