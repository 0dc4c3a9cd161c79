"""Effects of a user that act for a short time, or in a small range of angles."""

from dataclasses import dataclass

from twolink.arithmetic import exp, sin, sqrt
from twolink.effects import Effect, PiecewiseEffect
from twolink.loads import motor_loads


def _bell(x):
    return exp(-x * x)


@dataclass(frozen=True)
class Pulse(Effect):
    """A torque in A around a time."""

    size: float
    centre: float
    width: float

    def loads(self, chain, q, u, t=0.0):
        return motor_loads(self.size * _bell((t - self.centre) / self.width), 0.0)


@dataclass(frozen=True)
class DampingPulse(Pulse):
    """A damping of joint B around a time, which does nothing at rest."""

    def loads(self, chain, q, u, t=0.0):
        rate = self.size * _bell((t - self.centre) / self.width)
        return motor_loads(0.0, -rate * (u[1] - u[0]))


@dataclass(frozen=True)
class Detent(Pulse):
    """A torque in A around an angle of link 1 (rad)."""

    def loads(self, chain, q, u, t=0.0):
        return motor_loads(self.size * _bell((q[0] - self.centre) / self.width), 0.0)


@dataclass(frozen=True)
class Kink(Pulse):
    """A torque in A that nearly has a kink at an angle of link 1 (rad)."""

    def loads(self, chain, q, u, t=0.0):
        x = q[0] - self.centre
        return motor_loads(self.size * sqrt(x * x + self.width * self.width), 0.0)


@dataclass(frozen=True)
class Logistic(Effect):
    """A torque in A that rises from 0 to 1 N m around a time, at a rate (1/s)."""

    rate: float
    centre: float

    def loads(self, chain, q, u, t=0.0):
        return motor_loads(1 / (1 + 1 / exp((t - self.centre) * self.rate)), 0.0)


@dataclass(frozen=True)
class Rooted(Pulse):
    """A pulse with a factor that is not real beyond a speed."""

    def loads(self, chain, q, u, t=0.0):
        size = self.size * sqrt(0.3 - u[0])
        return motor_loads(size * _bell((t - self.centre) / self.width), 0.0)


@dataclass(frozen=True)
class Declared(Pulse):
    """A torque that declares its width."""

    @property
    def shortest_time(self):
        return self.width


@dataclass(frozen=True)
class Ripple(Effect):
    """A torque that varies everywhere."""

    frequency: float

    def loads(self, chain, q, u, t=0.0):
        return motor_loads(3 * sin(self.frequency * t), t * t * t - 2.0)


@dataclass(frozen=True)
class Switched(PiecewiseEffect):
    """A pulse that is there until a time, and another one from then on."""

    before: Pulse
    after: Pulse
    at: float

    @property
    def discontinuities(self):
        return (self.at,)

    def piece_at(self, t):
        return self.before if t < self.at else self.after
