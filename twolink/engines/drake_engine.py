"""Drake: its `Simulator` on a continuous `MultibodyPlant`, with its own integrators."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from twolink.engines.contract import Array
from twolink.engines.faults import ModelRefusedError
from twolink.engines.joint_model import JOINTS, JointModel, Samples, joint_model
from twolink.engines.messages import Method, Model
from twolink.engines.simulation_engine import (
    EngineRun,
    Prepared,
    stretches,
)
from twolink.engines.urdf_reading import UrdfReadingEngine, check_joints, each
from twolink.errors import EngineError
from twolink.scene import Scene

_DISCRETE = "friction in a continuous plant is regularised, without sticking"
_REASONS = {
    "joint_friction": "its joints have no dry friction",
    "joint_stop": "its joint limits are springs and dampers, and act only in discrete plants",
    "surface": "its contacts are compliant, and it has no coefficient of restitution",
    "compliant_surface": "its contact law is k x (1 + d dx/dt), none of the scene's three laws",
    "end_force": _DISCRETE,
    "drive": "it rejects negative damping",
    "push": "it rejects negative stiffness",
}
_EXPRESSES = frozenset({"torque", "stiffness", "damping", "armature", "waves", "samples"})

# It integrates the plant named "plant", and asks for contacts in each step.
_CENIC = "cenic"

# Its longest step with error control stays at the default of 0.1 s.
_ERROR_CONTROLLED = (
    ("runge_kutta3", 3),
    ("runge_kutta5", 5),
    ("bogacki_shampine3", 3),
    ("radau3", 3),
    (_CENIC, 1),
)
_FIXED = (
    ("runge_kutta2", 2),
    ("runge_kutta3", 3),
    ("runge_kutta5", 5),
    ("bogacki_shampine3", 3),
    ("radau3", 3),
    ("radau1", 1),
    ("implicit_euler", 1),
    ("semi_explicit_euler", 1),
    (_CENIC, 1),
)


class Drake(UrdfReadingEngine):
    """Drake; see `SimulationEngine`.

    The parameter of a method with error control is Drake's `accuracy`; a method named "…, fixed
    step" takes equal steps. `cenic` is Convex Error-controlled Numerical Integration for Contact
    (V. Kurtz and A. Castro, arXiv 2511.08771, 2025), of order 1.
    """

    name = "Drake"
    methods = (
        *(
            Method(name=name, order=order, parameter="tolerance")
            for name, order in _ERROR_CONTROLLED
        ),
        *(
            Method(name=f"{name}, fixed step", order=order, parameter="step")
            for name, order in _FIXED
        ),
    )
    packages = (("drake", "pydrake"),)
    expresses = _EXPRESSES
    reasons = _REASONS

    def _prepared(self, scene: Scene, method: str) -> Prepared:
        """Return a function that runs a scene; plant and simulator are built once."""
        chosen = next(each for each in self.methods if each.name == method)
        begin = perf_counter()
        model = joint_model(scene)
        controlled = chosen.parameter == "tolerance"
        scheme = method.partition(",")[0]
        built = _built(model, queries=scheme == _CENIC)
        setup = perf_counter() - begin

        def run(parameter: float, times: Array) -> EngineRun:
            begin = perf_counter()
            simulator = _simulator(built, model, scheme, parameter, controlled)
            integrator = simulator.get_mutable_integrator()
            sizes = [size for _, size in stretches(times, parameter)] if not controlled else []
            preparing = perf_counter() - begin
            found = np.empty((len(times), 4))
            context = simulator.get_context()
            found[0] = context.get_continuous_state_vector().CopyToVector()
            begin = perf_counter()
            with _failing_as("Drake stopped"):
                for index, time in enumerate(times[1:].tolist(), start=1):
                    if sizes:
                        integrator.set_maximum_step_size(sizes[index - 1])
                    simulator.AdvanceTo(time)
                    found[index] = context.get_continuous_state_vector().CopyToVector()
            seconds = perf_counter() - begin
            q = np.array(JOINTS.absolute_angles((found[:, 0], found[:, 1])))
            u = np.array(JOINTS.absolute_speeds((found[:, 2], found[:, 3])))
            return EngineRun(
                q,
                u,
                seconds,
                setup + preparing,
                int(integrator.get_num_derivative_evaluations()),
                int(integrator.get_num_steps_taken()),
            )

        return run

    def _read(self, model: Model) -> _ReadChain:
        """Return the chain of a URDF, by Drake's parser."""
        return _ReadChain(model)


class _ReadChain:
    """A parsed URDF; see `twolink.engines.urdf_reading.ReadChain`."""

    def __init__(self, model: Model) -> None:
        """Parse a URDF, and weld it to the world. Raises `ModelRefusedError`."""
        try:
            self._plant = plant = _parsed(model.urdf or "", model.gravity)
            plant.Finalize()
        except (RuntimeError, ValueError) as error:
            raise ModelRefusedError(str(error)) from error
        joints: list[Any] = [plant.get_joint(index) for index in plant.GetJointIndices()]
        moving = [joint.name() for joint in joints if joint.num_velocities()]
        named = check_joints(model, plant.num_velocities(), moving)
        chosen = [plant.GetJointByName(name) for name in named]
        if any(joint.type_name() != "revolute" for joint in chosen):
            raise ModelRefusedError("a joint that moves is not revolute")
        self._order = [joint.velocity_start() for joint in chosen]
        self._context = plant.CreateDefaultContext()

    def mass_matrix(self, angles: Array) -> Array:
        """Return `CalcMassMatrix`."""
        return each(self._matrix, angles)

    def forward_dynamics(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """Return the plant's time derivatives, with damping."""
        return each(self._accelerations, angles, speeds, torques)

    def _matrix(self, angles: Array) -> Array:
        self._plant.SetPositions(self._context, self._sorted(angles))
        M = self._plant.CalcMassMatrix(self._context)
        return np.asarray(M[np.ix_(self._order, self._order)])

    def _accelerations(self, angles: Array, speeds: Array, torques: Array) -> Array:
        plant, context = self._plant, self._context
        plant.SetPositions(context, self._sorted(angles))
        plant.SetVelocities(context, self._sorted(speeds))
        port = plant.get_applied_generalized_force_input_port()
        port.FixValue(context, self._sorted(torques))
        rates = plant.EvalTimeDerivatives(context).CopyToVector()
        return np.asarray(rates[2:][self._order])

    def _sorted(self, row: Array) -> Any:
        """Return numbers of both joints in Drake's order."""
        return row[np.argsort(self._order)]


@contextmanager
def _failing_as(outcome: str) -> Iterator[None]:
    """Raise `EngineError`, which begins with the outcome, where Drake fails in the block."""
    try:
        yield
    except (RuntimeError, SystemExit) as error:
        # pydrake exits with the text of an assertion that fails, a signal with a number.
        if isinstance(error, SystemExit) and not isinstance(error.code, str):
            raise
        raise EngineError(f"{outcome}: {error}") from error


@dataclass(frozen=True)
class _Built:
    """The simulated system and the plant in it."""

    system: Any
    plant: Any


def _built(model: JointModel, *, queries: bool = False) -> _Built:
    """Return the plant of a model, in a diagram with torque sources if torques vary with time.

    With `queries`, an empty scene graph answers that there are no contacts.
    """
    from pydrake.geometry import SceneGraph
    from pydrake.systems.framework import DiagramBuilder

    builder = DiagramBuilder()
    with _failing_as("Drake rejects the chain"):
        plant: Any = builder.AddSystem(_plant(model))
    if model.uses & {"torque", "waves", "samples"}:
        _add_torques(builder, plant, model)
    if queries:
        empty: Any = builder.AddSystem(SceneGraph())
        builder.Connect(empty.get_query_output_port(), plant.get_geometry_query_input_port())
    return _Built(builder.Build(), plant)


def _parsed(text: str, gravity: Any) -> Any:
    """Return a continuous plant of a URDF, welded to the world, with gravity (m/s²).

    It has no scene graph, so that shapes are ignored.
    """
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    plant: Any = MultibodyPlant(0.0)
    (instance,) = Parser(plant).AddModelsFromString(text, "urdf")
    joints = [plant.get_joint(index) for index in plant.GetJointIndices(instance)]
    children = {joint.child_body().name() for joint in joints}
    for index in plant.GetBodyIndices(instance):
        body = plant.get_body(index)
        if body.name() not in children:
            plant.WeldFrames(plant.world_frame(), body.body_frame())
    plant.mutable_gravity_field().set_gravity_vector(np.array(gravity))
    return plant


def _plant(model: JointModel) -> Any:
    """Return a finalised continuous plant of a model."""
    from pydrake.multibody.tree import RevoluteSpring

    plant = _parsed(model.chain.to_urdf(), model.gravity_in_space)
    plant.set_name("plant")
    for index, name in enumerate(("joint1", "joint2")):
        joint = plant.GetJointByName(name)
        if model.damping[index]:
            joint.set_default_damping_vector([model.damping[index]])
        if model.stiffness[index]:
            spring = RevoluteSpring(joint, model.rest[index], model.stiffness[index])
            plant.AddForceElement(spring)
        if model.armature[index]:
            motor = plant.AddJointActuator(f"{name}_motor", joint)
            motor.set_default_rotor_inertia(model.armature[index])
            motor.set_default_gear_ratio(1.0)
    plant.Finalize()
    return plant


def _add_torques(builder: Any, plant: Any, model: JointModel) -> None:
    """Wire constant torques, sines and samples to the plant's generalized forces."""
    from pydrake.systems.primitives import Adder, ConstantVectorSource, Sine, TrajectorySource

    total = builder.AddSystem(Adder(1 + len(model.waves) + len(model.samples), 2))
    steady: Any = np.array(model.torque)
    constant = builder.AddSystem(ConstantVectorSource(steady))
    builder.Connect(constant.get_output_port(), total.get_input_port(0))
    for number, wave in enumerate(model.waves, start=1):
        of_joint = np.eye(2)[wave.joint]
        sine = builder.AddSystem(
            Sine(of_joint * wave.amplitude, of_joint * wave.frequency, of_joint * wave.phase)
        )
        builder.Connect(sine.get_output_port(0), total.get_input_port(number))
    for number, samples in enumerate(model.samples, start=1 + len(model.waves)):
        source = builder.AddSystem(TrajectorySource(_trajectory(samples)))
        builder.Connect(source.get_output_port(), total.get_input_port(number))
    builder.Connect(total.get_output_port(), plant.get_applied_generalized_force_input_port())


def _trajectory(samples: Samples) -> Any:
    """Return samples as a Drake trajectory with constant extrapolation at its ends."""
    from pydrake.trajectories import PiecewisePolynomial

    times, values = np.array(samples.times), np.array(samples.values)
    if samples.interpolation == "hold":
        # The last sample is held, too.
        times, values = np.append(times, times[-1] + 1.0), np.c_[values, values[:, -1]]
        return PiecewisePolynomial.ZeroOrderHold(times, values)
    if samples.interpolation == "linear":
        return PiecewisePolynomial.FirstOrderHold(times, values)
    return PiecewisePolynomial.CubicWithContinuousSecondDerivatives(times, values)


def _start(built: _Built, model: JointModel, context: Any) -> None:
    """Set the chain to its initial state."""
    context.SetTime(0.0)
    own = built.plant.GetMyMutableContextFromRoot(context)
    built.plant.SetPositions(own, model.theta)
    built.plant.SetVelocities(own, model.theta_speed)


def _simulator(
    built: _Built, model: JointModel, scheme: str, parameter: float, controlled: bool
) -> Any:
    """Return an initialised simulator at the initial state."""
    from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig

    simulator = Simulator(built.system)
    config = SimulatorConfig(integration_scheme=scheme, use_error_control=controlled)
    if controlled:
        config.accuracy = parameter
    else:
        config.max_step_size = parameter
    _start(built, model, simulator.get_mutable_context())
    with _failing_as("Drake rejects the run"):
        ApplySimulatorConfig(config, simulator)
        simulator.Initialize()
    return simulator
