"""Scenes in other units: even powers of two change all numbers exactly, and no motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from twolink.chain import Chain
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.end_drag import EndDrag
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.motor_inertia import MotorInertia
from twolink.effects.pd_control import PdControl
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.scene import Scene


class Units(NamedTuple):
    """How many times as large numbers become, as powers of two: of m, of kg and of s."""

    length: int = 0
    mass: int = 0
    time: int = 0

    @property
    def force(self) -> int:
        """The power of two of N."""
        return self.mass + self.length - 2 * self.time

    @property
    def moment(self) -> int:
        """The power of two of N m."""
        return self.force + self.length


def scaled(value: Any, power: float) -> Any:
    """Return numbers times a power of two, None as it is."""
    if value is None:
        return None
    if isinstance(value, tuple):
        return tuple(scaled(each, power) for each in value)
    return value * 2.0**power


def in_units(scene: Scene, units: Units) -> Scene:
    """Return a scene whose lengths, masses and times have larger or smaller numbers.

    The stiffness of a law with δ^1.5 has the root of a power of two, so that of m should be even.
    """
    return replace(
        scene,
        chain=_chain(scene.chain, units),
        u=scaled(scene.u, -units.time),
        duration=scaled(scene.duration, units.time),
        effects=tuple(_POWERS[type(effect)](effect, units) for effect in scene.effects),
    )


def _chain(chain: Chain, units: Units) -> Chain:
    assert not chain.rotors
    mass, length = scaled(chain.mass, units.mass), scaled(chain.length, units.length)
    if chain == Chain.uniform_bars(chain.mass, chain.length):
        # The inertia of bars is known with more digits.
        return Chain.uniform_bars(mass, length)
    centre = scaled(chain.centre, units.length)
    return Chain(mass, length, centre, scaled(chain.inertia, units.mass + 2 * units.length))


def _with(**powers: Callable[[Units], float]) -> Callable[[Any, Units], Any]:
    """Return the change of an effect whose fields have units."""

    def changed(effect: Any, units: Units) -> Any:
        new = {name: scaled(getattr(effect, name), of(units)) for name, of in powers.items()}
        return replace(effect, **new)

    return changed


def _compliant(effect: CompliantSurface, units: Units) -> CompliantSurface:
    force, length, time = units.force, units.length, units.time
    linear = effect.law == "kelvin-voigt"
    pressure = force - 2 * length
    return replace(
        effect,
        point=scaled(effect.point, length),
        stiffness=scaled(effect.stiffness, force - (length if linear else 1.5 * length)),
        loss=scaled(effect.loss, force + time - length if linear else time - length),
        radius=scaled(effect.radius, length),
        modulus=scaled(effect.modulus, pressure),
        strength=scaled(effect.strength, pressure),
    )


def _sampled(effect: SampledTorque, units: Units) -> SampledTorque:
    # The interpolation is computed again.
    times, A, B = scaled(effect.times, units.time), *scaled((effect.A, effect.B), units.moment)
    return SampledTorque(times, A, B, effect.interpolation)


def _moment(units: Units) -> int:
    return units.moment


def _damping(units: Units) -> int:
    return units.moment + units.time


_POWERS: Mapping[type, Callable[[Any, Units], Any]] = {
    Gravity: _with(g=lambda units: units.length - 2 * units.time),
    JointTorque: _with(torque=_moment, amplitude=_moment, frequency=lambda units: -units.time),
    PdControl: _with(proportional=_moment, derivative=_damping),
    JointSpring: _with(stiffness=_moment),
    JointDamping: _with(coefficient=_damping),
    JointFriction: _with(kinetic=_moment, static=_moment),
    JointStop: _with(),
    MotorInertia: _with(inertia=lambda units: units.mass + 2 * units.length),
    EndForce: _with(normal=lambda units: units.force),
    EndDrag: _with(coefficient=lambda units: units.force + units.time - units.length),
    Surface: _with(point=lambda units: units.length),
    CompliantSurface: _compliant,
    SampledTorque: _sampled,
}
