"""Contact elements of users that would pull or give energy, each refused with one sentence."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from twolink import kane
from twolink.chain import Chain, Point
from twolink.contact.coordinates import JointCoordinate, PointCoordinate
from twolink.contact.elements import CompliantContact, DryFriction, RigidContact
from twolink.contact.force_laws import Hertz, HuntCrossley, KelvinVoigt, NoPull
from twolink.effects import ContactEffect
from twolink.effects.gravity import Gravity
from twolink.errors import ParameterError
from twolink.kinematics import position, velocity
from twolink.loads import Force
from twolink.scene import Scene
from twolink.simulation import simulate

SCENE = Scene(Chain.uniform_bars(), (0.3, 0.5), (0.2, -0.1), 0.5, (Gravity(),))
A, STOP_AT_A = JointCoordinate("A"), JointCoordinate("A", -1)


@dataclass(frozen=True)
class Elements(ContactEffect):
    """An effect with given elements of contact."""

    elements: tuple

    def contact_elements(self, chain):
        return self.elements

    def smooth_loads(self, chain, q, u, t=0.0):
        return ()

    def loads(self, chain, q, u, t=0.0):
        return ()


@dataclass(frozen=True)
class Law:
    """A law k δ + k₃ δ³ + c dδ/dt + `first`, whose stored energy has the factor `share`."""

    stiffness: float = 100.0
    cubic: float = 0.0
    damping: float = 0.0
    first: float = 0.0
    share: float = 1.0
    uses_root = False
    relaxation = None

    def force(self, depth, root, rate):
        cubic = self.cubic * depth * depth * depth
        return self.first + self.stiffness * depth + cubic + self.damping * depth * rate

    def stored(self, depth, root):
        square = depth * depth
        work = self.first * depth + self.stiffness * square / 2 + self.cubic * square * square / 4
        return self.share * work


class Heading:
    """The angle of link 2, a coordinate that is neither that of a joint nor of a point."""

    def coordinate(self, chain, q):
        return q[1]


class Failing(Law):
    """A law that cannot be evaluated at zero depth."""

    def force(self, depth, root, rate):
        return 1 / depth


@dataclass(frozen=True)
class Damped(KelvinVoigt):
    """A damped law whose surface springs back at another rate."""

    stiffness: float = 100.0
    damping: float = 10.0
    relaxation: float = 10.0


@dataclass(frozen=True)
class LinearHuntCrossley:
    """A law k δ (1 + a dδ/dt)."""

    stiffness: float
    dissipation: float
    uses_root = True
    relaxation = None

    def force(self, depth, root, rate):
        return self.stiffness * depth * (1 + self.dissipation * rate)

    def stored(self, depth, root):
        return self.stiffness * depth * depth / 2


def stop(law, memory=None):
    """Return a soft stop at the start of link 1."""
    return CompliantContact("stop", STOP_AT_A, -0.4, law=law, memory=memory)


@pytest.mark.parametrize(
    ("element", "words"),
    [
        (DryFriction("A", A, -1.0, 1.0), "friction of A must be at least 0, .*; got -1 and 1"),
        (DryFriction("A", A, 2.0, 1.0), "no more while it slides than .*; got 2 and 1"),
        (DryFriction("A", A, 1.0, math.inf), "got 1 and inf"),
        (DryFriction("A", A, math.nan, 1.0), "got nan and 1"),
        (RigidContact("end", STOP_AT_A, -1.0, 1.5), "restitution of end must be .*; got 1.5"),
        (DryFriction("A", Heading(), 1.0, 1.0), "a coordinate of A must be a JointCoordinate or a"),
        (RigidContact("floor", Heading(), 0.0, 0.5), "a coordinate of floor must be a Joint"),
        (
            RigidContact("floor", PointCoordinate("D", (0.0, -2.0)), 0.0, 0.5),
            "a coordinate of floor: the length of its vector must be 1; got 2.0",
        ),
        ("friction", "contact_elements must be a tuple of ContactElement; got 'friction'"),
        (stop(Law(first=5.0)), "the law of stop: force at a depth of 0 must be 0; got 5.0"),
        (stop(Law(first=-5.0)), "force at a depth of 0 must be 0; got -5.0"),
        (stop(Law(-100.0)), "force at a depth of 1e-09, at rest must be 0 or more; got -"),
        (stop(Law(cubic=-1e9)), "force at a depth of 0.001, at rest must be 0 or more"),
        (stop(Law(math.nan)), "must be 0; got nan"),
        (stop(Law(damping=-1.0)), "must not fall with the rate of the depth; got .* at rates of"),
        (stop(Law(share=0.5)), "stored energy at a depth of 1e-09 must be the work of its force"),
        (
            stop(Law(damping=3.0)),
            "that falls at 1000 must be 0 or more, as the point leaves the surface",
        ),
        (stop(HuntCrossley(1e3, 0.2)), "must have a relaxation, or its contact a memory, such as "),
        (
            stop(Damped(relaxation=5.0)),
            "falls at its relaxation of 5 1/s must be 0; got 5.0",
        ),
        (stop(Law(), NoPull(HuntCrossley(1.0, 1.0))), "uses_root must be True for a contact with"),
        (stop(Failing()), "the law of stop raised ZeroDivisionError: (float )?division by zero"),
    ],
)
def test_elements_that_would_give_energy_are_refused(element, words):
    with pytest.raises(ParameterError, match=words):
        replace(SCENE, effects=(Elements((element,)),))


@dataclass(frozen=True)
class Middle(PointCoordinate):
    """The place of the middle of link 2."""

    def of(self, chain):
        return Point(2, chain.L2 / 2, chain.scalar(0))


@pytest.mark.parametrize(
    "element",
    [
        RigidContact("floor", Middle("D", (0.0, -1.0)), -1.2, 0.5),
        DryFriction("A", A, 0.5, 1.0),
        RigidContact("end", STOP_AT_A, -1.0, 1.0),
        stop(Law(cubic=1e5)),
        stop(KelvinVoigt(100.0, 1.0)),
        stop(Damped()),
        stop(Hertz(1e3)),
        stop(HuntCrossley(1e3, 0.2), NoPull(HuntCrossley(1e3, 0.2))),
        stop(LinearHuntCrossley(1e3, 0.2), NoPull(LinearHuntCrossley(1e3, 0.2))),
    ],
)
def test_elements_within_the_laws_are_simulated(element):
    scene = replace(SCENE, effects=(Gravity(), Elements((element,))))
    found = simulate(scene, samples=3)
    assert found.met


def test_an_own_law_that_does_not_pull_has_its_motion():
    """Against a slow integration of max(0, law): the point leaves at a depth, and is met there."""
    law, chain = LinearHuntCrossley(2000.0, 1.5), Chain.uniform_bars()
    pad = CompliantContact("pad", PointCoordinate("D", (0.0, -1.0)), -1.2, law, memory=NoPull(law))
    scene = Scene(chain, (0.3, 0.2), (2.0, 3.0), 0.4, (Gravity(9.81), Elements((pad,))))
    found = simulate(scene, samples=3)

    def rates(t, y):
        q, u = tuple(y[:2]), tuple(y[2:])
        place, speed = (
            f(chain, q, *rest, chain.D) for f, rest in ((position, ()), (velocity, (u,)))
        )
        depth, rate = place[1] - 1.2, speed[1]
        push = max(0.0, 2000.0 * depth * (1 + 1.5 * rate)) if depth > 0 else 0.0
        loads = (*Gravity(9.81).loads(chain, q, u), Force(chain.D, (0.0, -push)))
        return [*u, *kane.forward_dynamics(chain, q, u, loads)]

    slow = solve_ivp(rates, (0, 0.4), [0.3, 0.2, 2.0, 3.0], "DOP853", rtol=1e-11, atol=1e-12,
                     max_step=2e-4)  # fmt: skip
    assert found.met
    assert np.abs(slow.y[:, -1] - [*found.q[:, -1], *found.u[:, -1]]).max() < 1e-6
