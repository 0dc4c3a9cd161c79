"""heyoka with its own `lagrangian()` and its own choice of order and step."""

from __future__ import annotations

import math
from time import perf_counter
from typing import Any

import numpy as np

from twolink.arithmetic import Pair
from twolink.engines.contract import Array
from twolink.engines.joint_model import JointModel, joint_model
from twolink.engines.messages import Method
from twolink.engines.simulation_engine import EngineRun, EquationsEngine, Prepared
from twolink.errors import EngineError
from twolink.optional import heyoka
from twolink.scene import Scene

_EVENTS = "heyoka detects events, but the motion between and after them would be this library's"
_REASONS = dict.fromkeys(
    ("joint_friction", "joint_stop", "surface", "compliant_surface", "end_force"), _EVENTS
) | {
    "end_drag": "its dissipation function depends on speeds alone",
    "samples": "its series are smooth; runs from sample to sample would have to be added",
}
_EXPRESSES = frozenset({"torque", "stiffness", "damping", "armature", "waves", "drive", "push"})


class HeyokaLagrangian(EquationsEngine):
    """heyoka's `taylor_adaptive` on its `lagrangian()`; see `SimulationEngine`.

    The parameter is the tolerance of a step, which also sets the order. `taylor` is heyoka's
    default; `taylor, odd order` takes the next finer tolerance with an odd order. From rest at the
    horizontal only every fourth coefficient of the series in t is non-zero. If the last two
    coefficients vanish, as for an order that is a multiple of four, the step size is unlimited and
    one step goes to the end.
    """

    name = "heyoka"
    methods = (
        Method(name="taylor", order=None, parameter="tolerance"),
        Method(name="taylor, odd order", order=None, parameter="tolerance"),
    )
    packages = (("heyoka", "heyoka"),)
    extra = None
    expresses = _EXPRESSES
    reasons = _REASONS

    def _prepared(self, scene: Scene, method: str) -> Prepared:
        """Return a function that runs a scene, compiled once for each tolerance."""
        model = joint_model(scene)
        compiled: dict[float, tuple[Any, float]] = {}

        def run(tolerance: float, times: Array) -> EngineRun:
            if method != "taylor":
                tolerance = _of_odd_order(tolerance)
            if tolerance not in compiled:
                compiled[tolerance] = _compiled(model, tolerance)
            integrator, setup = compiled[tolerance]
            integrator.state[:] = [*model.q, *model.u]
            integrator.time = 0.0
            begin = perf_counter()
            outcome, _, _, steps, _, states = integrator.propagate_grid(times)
            seconds = perf_counter() - begin
            if outcome != heyoka().taylor_outcome.time_limit:
                raise EngineError(f"heyoka stopped at {integrator.time:.6g} s: {outcome.name}")
            found = np.array(states).T
            return EngineRun(found[:2], found[2:], seconds, setup, None, int(steps))

        return run

    def _accelerations(self, model: JointModel) -> Pair:
        """Return du (rad/s²) at the start of a model, by the compiled form of `lagrangian()`."""
        return _accelerations(model)


def _compiled(model: JointModel, tolerance: float) -> tuple[Any, float]:
    """Return an integrator and its build time (s)."""
    begin = perf_counter()
    integrator = heyoka().taylor_adaptive(_equations(model)[1], [0.0] * 4, tol=tolerance)
    return integrator, perf_counter() - begin


def _equations(model: JointModel) -> tuple[list[Any], Any]:
    """Return heyoka's variables and its Euler–Lagrange equations of the energies."""
    hy = heyoka()
    q1, q2, v1, v2 = variables = hy.make_vars("q1", "q2", "v1", "v2")
    T, V, D = _kinetic_energy(hy, model, variables), _potential_of_gravity(hy, model, q1, q2), 0.0
    for joint, (angle, speed) in enumerate(((q1, v1), (q2 - q1, v2 - v1))):
        if model.armature[joint]:
            T = T + model.armature[joint] / 2 * speed * speed
        if model.damping[joint]:
            D = D + model.damping[joint] / 2 * speed * speed
        if model.torque[joint]:
            V = V - model.torque[joint] * angle
        if model.stiffness[joint]:
            V = V + model.stiffness[joint] / 2 * (angle - model.rest[joint]) ** 2.0
        for wave in model.waves:
            if wave.joint == joint:
                V = V - wave.amplitude * hy.sin(wave.frequency * hy.time + wave.phase) * angle
    return variables, hy.lagrangian(T - V, [q1, q2], [v1, v2], hy.expression(0.0) + D)


def _kinetic_energy(hy: Any, model: JointModel, variables: list[Any]) -> Any:
    """Return T (J) of both links; a mass centre on the axis adds no sine term."""
    q1, q2, v1, v2 = variables
    chain = model.chain
    (a1, b1), (a2, b2) = chain.centre
    first = chain.I_C1 + chain.m1 * (a1**2 + b1**2) + chain.m2 * chain.L1**2
    second = chain.I_C2 + chain.m2 * (a2**2 + b2**2)
    ahead = a2 * hy.cos(q2 - q1)
    if b2:
        ahead = ahead - b2 * hy.sin(q2 - q1)
    return first / 2 * v1 * v1 + second / 2 * v2 * v2 + chain.m2 * chain.L1 * v1 * v2 * ahead


def _potential_of_gravity(hy: Any, model: JointModel, q1: Any, q2: Any) -> Any:
    """Return V (J) of gravity: each link's angle with the mass moment that it carries."""
    chain, (gx, gy), V = model.chain, model.gravity, 0.0
    (a1, b1), (a2, b2) = chain.centre
    along = (chain.m1 * a1 + chain.m2 * chain.L1, chain.m2 * a2)
    across = (chain.m1 * b1, chain.m2 * b2)
    for q, a, b in zip((q1, q2), along, across, strict=True):
        for g, towards, beside in ((gx, hy.cos(q), -hy.sin(q)), (gy, hy.sin(q), hy.cos(q))):
            V = V - g * a * towards if g else V
            V = V - g * b * beside if g and b else V
    return V


def _accelerations(model: JointModel) -> tuple[float, float]:
    hy = heyoka()
    variables, equations = _equations(model)
    rates = [right for left, right in equations if left in variables[2:]]
    function = hy.cfunc(rates, vars=variables)
    du1, du2 = function(np.array([*model.q, *model.u]), time=0.0)
    return float(du1), float(du2)


def _of_odd_order(tolerance: float) -> float:
    """Return a tolerance, equal or finer, for which heyoka uses an odd order.

    heyoka uses the smallest order p ≥ 1 − log(tolerance)/2; the result is well inside its interval.
    """
    order = math.ceil(1 - math.log(tolerance) / 2)
    return tolerance if order % 2 else math.exp(-2 * order + 0.4)
