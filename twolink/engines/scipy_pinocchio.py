"""SciPy's integrators with Pinocchio's ABA: the usual combination of both packages."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np

from twolink.engines.contract import Array
from twolink.engines.joint_model import JOINTS, JointModel, joint_model
from twolink.engines.messages import Method, Model
from twolink.engines.pinocchio_engine import PinocchioEngine
from twolink.engines.simulation_engine import (
    EngineRun,
    Prepared,
    captured_warnings,
)
from twolink.engines.urdf_reading import UrdfReadingEngine
from twolink.errors import EngineError
from twolink.scene import Scene

_EVENTS = "solve_ivp integrates smooth equations; events and modes would have to be added"
_REASONS = dict.fromkeys(
    ("joint_friction", "joint_stop", "surface", "compliant_surface", "end_force"), _EVENTS
)
_EXPRESSES = frozenset(
    {"torque", "stiffness", "damping", "armature", "waves", "samples", "drive", "push"}
)


class ScipyOverPinocchio(UrdfReadingEngine):
    """`scipy.integrate.solve_ivp` over `pinocchio.aba`; see `SimulationEngine`.

    The parameter is used for rtol and atol. Values between steps are SciPy's dense output.
    """

    name = "SciPy over Pinocchio"
    methods = (
        Method(name="DOP853", order=8, parameter="tolerance"),
        Method(name="RK45", order=5, parameter="tolerance"),
        Method(name="Radau", order=5, parameter="tolerance"),
        Method(name="LSODA", order=None, parameter="tolerance"),
    )
    packages = (("pin", "pinocchio"), ("scipy", "scipy"))
    extra = None
    expresses = _EXPRESSES
    reasons = _REASONS

    def _prepared(self, scene: Scene, method: str) -> Prepared:
        """Return a function that runs a scene; the model is built once."""
        from scipy import integrate

        solve: Any = integrate.solve_ivp
        begin = perf_counter()
        model = joint_model(scene)
        rates = _rates(model)
        start = [*model.theta, *model.theta_speed]
        setup = perf_counter() - begin

        def run(tolerance: float, times: Array) -> EngineRun:
            span = (float(times[0]), float(times[-1]))
            with captured_warnings() as warnings:
                begin = perf_counter()
                found = solve(
                    rates, span, start, method=method, t_eval=times, rtol=tolerance, atol=tolerance
                )
                seconds = perf_counter() - begin
            if not found.success:
                raise EngineError(f"SciPy's {method} stopped: {found.message}")
            q = np.array(JOINTS.absolute_angles((found.y[0], found.y[1])))
            u = np.array(JOINTS.absolute_speeds((found.y[2], found.y[3])))
            return EngineRun(q, u, seconds, setup, int(found.nfev), None, tuple(warnings))

        return run

    def _read(self, model: Model) -> PinocchioEngine:
        """Return Pinocchio with the URDF."""
        found = PinocchioEngine()
        found.load(model)
        return found


def _rates(model: JointModel) -> Callable[[float, Array], Array]:
    """Return the rates of joint angles and speeds, by ABA."""
    import pinocchio

    robot = _robot(pinocchio, model)
    data, aba, together = robot.createData(), pinocchio.aba, np.concatenate
    if not model.uses - {"armature"}:
        nothing = np.zeros(2)

        def free(_: float, x: Array) -> Array:
            return together([x[2:], aba(robot, data, x[:2], x[2:], nothing)])

        return free
    torque = _torque(model)

    def driven(t: float, x: Array) -> Array:
        return together([x[2:], aba(robot, data, x[:2], x[2:], torque(t, x))])

    return driven


def _robot(pinocchio: Any, model: JointModel) -> Any:
    """Return Pinocchio's model with an angle, not cosine and sine, as coordinate of each joint."""
    limits = '"revolute"><limit effort="1" velocity="1"/>'
    text = model.chain.to_urdf().replace('"continuous">', limits)
    try:
        robot = pinocchio.buildModelFromXML(text)
    except (ValueError, RuntimeError) as error:
        raise EngineError(f"Pinocchio rejects the chain: {error}") from error
    robot.gravity.linear = np.array(model.gravity_in_space)
    robot.armature = np.array(model.armature)
    return robot


def _torque(model: JointModel) -> Callable[[float, Array], Array]:
    """Return the torques in the joints (N m) as a function of time and state."""
    constant, k, c = (np.array(x) for x in (model.torque, model.stiffness, model.damping))
    rest = np.array(model.rest)

    def steady(_: float, x: Array) -> Array:
        return np.asarray(constant - k * (x[:2] - rest) - c * x[2:])

    with_waves = _with_waves(model, steady) if model.waves else steady
    if not model.samples:
        return with_waves
    sampled = model.sampled()
    return lambda t, x: np.asarray(with_waves(t, x) + sampled(t))


def _with_waves(
    model: JointModel, steady: Callable[[float, Array], Array]
) -> Callable[[float, Array], Array]:
    place = np.zeros((2, len(model.waves)))
    for column, wave in enumerate(model.waves):
        place[wave.joint, column] = wave.amplitude
    frequency = np.array([wave.frequency for wave in model.waves])
    phase = np.array([wave.phase for wave in model.waves])
    return lambda t, x: np.asarray(steady(t, x) + place @ np.sin(frequency * t + phase))
