"""A scene in the terms that engines support: a chain, gravity and joint elements.

Engines have joint angles and, per joint, a spring, a damper, a torque and an armature. Effects
composed of these are collected; a PD controller is a spring and a damper.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.coordinates import JointConvention
from twolink.effects import EFFECTS, RotorEffect
from twolink.engines.contract import Array
from twolink.errors import EngineError
from twolink.scene import Scene

# The URDF that the library writes counts θ1 = q1 and θ2 = q2 − q1.
JOINTS = JointConvention()

Numbers = tuple[float, float]
_NONE = (0.0, 0.0)

_GATHERED = {
    "gravity",
    "joint_damping",
    "joint_spring",
    "pd_control",
    "joint_torque",
    "sampled_torque",
}


@dataclass(frozen=True)
class Wave:
    """A torque `amplitude` sin(`frequency` t + `phase`) in joint 0 (A) or 1 (B).

    Units: N m, rad/s and rad.
    """

    joint: int
    amplitude: float
    frequency: float
    phase: float


@dataclass(frozen=True)
class Samples:
    """Sampled torques in the joints A and B: `values` (N m) at increasing `times` (s).

    `interpolation` is "hold", "linear" or "cubic", as in scene files.
    """

    times: tuple[float, ...]
    values: tuple[tuple[float, ...], tuple[float, ...]]
    interpolation: str

    def interpolant(self) -> Callable[[float], Array]:
        """Return the torques (N m, shape (2,)) as a function of time (s), by SciPy's splines."""
        from scipy.interpolate import make_interp_spline

        first, last = self.times[0], self.times[-1]
        if self.interpolation == "hold":
            times, values = np.array(self.times), np.array(self.values)

            def held(t: float) -> Array:
                return values[:, max(0, int(np.searchsorted(times, t, side="right")) - 1)]

            return held
        degree = {"linear": 1, "cubic": 3}[self.interpolation]
        spline = make_interp_spline(self.times, np.array(self.values).T, k=degree)
        return lambda t: np.asarray(spline(min(max(t, first), last)))


@dataclass(frozen=True)
class JointModel:
    """A chain of floats without rotors, its initial state, gravity and elements of joints A and B.

    `q` (rad) and `u` (rad/s) are absolute. `gravity` is along x and y (m/s²). The joint torque is
    `torque` − `stiffness` (θ − `rest`) − `damping` θ̇ (N m, N m/rad, rad, N m s/rad) plus the waves
    and the samples; `armature` is added to the joint's inertia (kg m²).
    """

    chain: Chain
    q: Numbers
    u: Numbers
    gravity: Numbers = _NONE
    torque: Numbers = _NONE
    stiffness: Numbers = _NONE
    rest: Numbers = _NONE
    damping: Numbers = _NONE
    armature: Numbers = _NONE
    waves: tuple[Wave, ...] = ()
    samples: tuple[Samples, ...] = ()

    @property
    def uses(self) -> frozenset[str]:
        """The names of the non-zero fields, and of those with negative numbers.

        The latter are "drive" for damping and "push" for stiffness.
        """
        names = ("torque", "stiffness", "damping", "armature", "waves", "samples")
        signs = {"drive": self.damping, "push": self.stiffness}
        negative = (name for name, numbers in signs.items() if min(numbers) < 0)
        return frozenset(name for name in names if any(getattr(self, name))).union(negative)

    def sampled(self) -> Callable[[float], Array]:
        """Return the torques of all samples (N m, shape (2,)) as a function of time (s)."""
        parts = [samples.interpolant() for samples in self.samples]
        return lambda t: np.sum([part(t) for part in parts], axis=0)

    @property
    def theta(self) -> Numbers:
        """The initial joint angles (rad)."""
        return JOINTS.joint_angles(self.q)

    @property
    def theta_speed(self) -> Numbers:
        """The initial joint speeds (rad/s)."""
        return JOINTS.joint_speeds(self.u)

    @property
    def size(self) -> float:
        """The magnitude of gravity (m/s²)."""
        return float((self.gravity[0] ** 2 + self.gravity[1] ** 2) ** 0.5)

    @property
    def gravity_in_space(self) -> tuple[float, float, float]:
        """Gravity in the URDF's world frame, z up (m/s²)."""
        return (self.gravity[0], 0.0, -self.gravity[1])


def at_state(chain: Chain, q: Pair, u: Pair, gravity: Pair, torque: Pair) -> JointModel:
    """Return the model of a chain in a state (rad, rad/s) under gravity (m/s²) and torques (N m).

    Raises `EngineError` for rotors that engines do not support.
    """
    plain, armature = without_rotors(chain)
    return JointModel(
        plain, _floats(q), _floats(u), _floats(gravity), _floats(torque), armature=armature
    )


def joint_model(scene: Scene) -> JointModel:
    """Return the model of a scene. Raises `EngineError` for an unsupported effect."""
    chain, armature = without_rotors(scene.moving_chain)
    model = JointModel(chain, _floats(scene.q), _floats(scene.u), armature=armature)
    for effect in scene.effects:
        name = effect_name(effect)
        if name in _GATHERED:
            model = _with(model, name, effect)
        elif not isinstance(effect, RotorEffect):
            raise EngineError(f"{name} is neither gravity nor a joint element")
    return model


def why_not(
    scene: Scene, engine: str, expresses: frozenset[str], reasons: Mapping[str, str]
) -> str | None:
    """Return why an engine that `expresses` these fields cannot express a scene, or None.

    `reasons` are the engine's reasons by the name of an effect or a field.
    """
    for effect in scene.effects:
        name = effect_name(effect)
        if name in reasons:
            return f"{engine} cannot express {name}: {reasons[name]}"
    try:
        uses = joint_model(scene).uses
    except EngineError as error:
        return f"{engine} cannot express the scene: {error}"
    for use in sorted(uses - expresses):
        reason = reasons.get(use, "it has no such element")
        return f"{engine} cannot express {_WORDS[use]}: {reason}"
    return None


_WORDS = {
    "torque": "a joint's torque",
    "stiffness": "a joint's spring",
    "damping": "a joint's damping",
    "armature": "a rotor's inertia",
    "waves": "a torque that varies with time",
    "samples": "a sampled torque",
    "drive": "negative damping",
    "push": "negative stiffness",
}


def effect_name(effect: Any) -> str:
    """Return an effect's name in scene files, or the name of its class."""
    home = type(effect).__module__, type(effect).__name__
    return next((name for name, known in EFFECTS.items() if known == home), home[1])


def without_rotors(chain: Chain) -> tuple[Chain, Numbers]:
    """Return a chain's links in floats and the armature of its joints (kg m²).

    A rotor with the speed of θ1 or θ2 becomes armature, one with the speed of link 2 is added to
    link 2. Raises `EngineError` for other rotors, which engines do not support.
    """
    first, second, carried = 0.0, 0.0, 0.0
    for inertia, (w1, w2) in chain.rotors:
        if w2 == 0:
            first += float(inertia * w1 * w1)
        elif w1 == 0:
            carried += float(inertia * w2 * w2)
        elif w1 + w2 == 0:
            second += float(inertia * w2 * w2)
        else:
            raise EngineError(
                "an armature leaves out that link 1 carries the rotor of B along; carried must be "
                "false or the ratio 1"
            )
    plain = replace(chain, rotors=()).convert(float)
    if carried:
        plain = replace(plain, inertia=(plain.I_C1, plain.I_C2 + carried))
    return plain, (first, second)


def _with(model: JointModel, name: str, effect: Any) -> JointModel:
    if name == "gravity":
        gravity = effect.acceleration
        return replace(model, gravity=_sum(model.gravity, gravity))
    if name == "joint_damping":
        return replace(model, damping=_sum(model.damping, effect.coefficient))
    if name == "joint_spring":
        return _with_spring(model, effect.stiffness, effect.rest)
    if name == "pd_control":
        model = replace(model, damping=_sum(model.damping, effect.derivative))
        return _with_spring(model, effect.proportional, effect.target)
    if name == "sampled_torque":
        samples = Samples(effect.times, (effect.A, effect.B), effect.interpolation)
        return replace(model, samples=(*model.samples, samples))
    waves = tuple(
        Wave(joint, effect.amplitude[joint], effect.frequency[joint], effect.phase[joint])
        for joint in (0, 1)
        if effect.amplitude[joint]
    )
    return replace(model, torque=_sum(model.torque, effect.torque), waves=model.waves + waves)


def _with_spring(model: JointModel, stiffness: Pair, rest: Pair) -> JointModel:
    """Return the model with one more spring in each joint; parallel springs are combined."""
    total = _sum(model.stiffness, stiffness)
    rests, torque = [], list(model.torque)
    for joint in (0, 1):
        moments = ((model.stiffness[joint], model.rest[joint]), (stiffness[joint], rest[joint]))
        # A single spring keeps its rest angle exactly.
        alone = [angle for k, angle in moments if k]
        moment = sum(k * angle for k, angle in moments)
        if len(alone) < 2:
            rests.append(float(sum(alone)))
        elif total[joint]:
            rests.append(moment / total[joint])
        else:
            rests.append(0.0)
            torque[joint] += moment
    return replace(model, stiffness=total, rest=(rests[0], rests[1]), torque=(torque[0], torque[1]))


def _sum(first: Pair, second: Pair) -> Numbers:
    return float(first[0] + second[0]), float(first[1] + second[1])


def _floats(pair: Pair) -> Numbers:
    return float(pair[0]), float(pair[1])
