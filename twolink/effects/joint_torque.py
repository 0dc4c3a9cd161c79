"""Torques of motors at the joints A and B: constant, sinusoidal, or both."""

from dataclasses import dataclass
from numbers import Real

from twolink.arithmetic import Pair, Scalar, sin
from twolink.chain import Chain
from twolink.effects.effect import Effect
from twolink.inputs import take_fields
from twolink.loads import Loads, motor_loads
from twolink.validation import check_finite


@dataclass(frozen=True)
class JointTorque(Effect):
    """Torques of the motors at A and B (N m): `torque` + `amplitude` sin(`frequency` t + `phase`).

    `frequency` is in rad/s and `phase` in rad; with zero amplitude the sine is not evaluated.
    """

    torque: tuple[float, float] = (0.0, 0.0)
    amplitude: tuple[float, float] = (0.0, 0.0)
    frequency: tuple[float, float] = (0.0, 0.0)
    phase: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        """Require finite numbers."""
        take_fields(self, "joint torque")
        check_finite("joint torque", **vars(self))

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the torques on link 1 and on link 2."""
        return motor_loads(self._of_joint(chain, 0, t), self._of_joint(chain, 1, t))

    def _of_joint(self, chain: Chain, joint: int, t: Scalar) -> Scalar:
        torque, amplitude = chain.scalar(self.torque[joint]), self.amplitude[joint]
        if isinstance(amplitude, Real) and amplitude == 0:
            return torque
        frequency, phase = chain.scalar(self.frequency[joint]), chain.scalar(self.phase[joint])
        return torque + chain.scalar(amplitude) * sin(frequency * t + phase)
