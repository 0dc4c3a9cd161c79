"""Contact elements of users that would pull or give energy, each refused with one sentence."""

import math
from dataclasses import dataclass, replace

import pytest

from twolink.chain import Chain
from twolink.contact.coordinates import JointCoordinate
from twolink.contact.elements import CompliantContact, DryFriction, RigidContact
from twolink.contact.force_laws import Hertz, HuntCrossley, KelvinVoigt
from twolink.effects import ContactEffect
from twolink.effects.gravity import Gravity
from twolink.errors import ParameterError
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


class Failing(Law):
    """A law that cannot be evaluated at zero depth."""

    def force(self, depth, root, rate):
        return 1 / depth


def stop(law):
    """Return a soft stop at the start of link 1."""
    return CompliantContact("stop", STOP_AT_A, -0.4, law=law)


@pytest.mark.parametrize(
    ("element", "words"),
    [
        (DryFriction("A", A, -1.0, 1.0), "friction of A must be at least 0, .*; got -1 and 1"),
        (DryFriction("A", A, 2.0, 1.0), "no more while it slides than .*; got 2 and 1"),
        (DryFriction("A", A, 1.0, math.inf), "got 1 and inf"),
        (DryFriction("A", A, math.nan, 1.0), "got nan and 1"),
        (RigidContact("end", STOP_AT_A, -1.0, 1.5), "restitution of end must be .*; got 1.5"),
        ("friction", "contact_elements must be a tuple of ContactElement; got 'friction'"),
        (stop(Law(first=5.0)), "the law of stop: force at a depth of 0 must be 0; got 5.0"),
        (stop(Law(first=-5.0)), "force at a depth of 0 must be 0; got -5.0"),
        (stop(Law(-100.0)), "force at a depth of 1e-09, at rest must be 0 or more; got -"),
        (stop(Law(cubic=-1e9)), "force at a depth of 0.001, at rest must be 0 or more"),
        (stop(Law(math.nan)), "must be 0; got nan"),
        (stop(Law(damping=-1.0)), "must not fall with the rate of the depth; got .* at rates of"),
        (stop(Law(share=0.5)), "stored energy at a depth of 1e-09 must be the work of its force"),
        (stop(Failing()), "the law of stop raised ZeroDivisionError: (float )?division by zero"),
    ],
)
def test_elements_that_would_give_energy_are_refused(element, words):
    with pytest.raises(ParameterError, match=words):
        replace(SCENE, effects=(Elements((element,)),))


@pytest.mark.parametrize(
    "element",
    [
        DryFriction("A", A, 0.5, 1.0),
        RigidContact("end", STOP_AT_A, -1.0, 1.0),
        stop(Law(cubic=1e5, damping=3.0)),
        stop(KelvinVoigt(100.0, 1.0)),
        stop(Hertz(1e3)),
        stop(HuntCrossley(1e3, 0.2)),
    ],
)
def test_elements_within_the_laws_are_simulated(element):
    scene = replace(SCENE, effects=(Gravity(), Elements((element,))))
    found = simulate(scene, samples=3)
    assert found.met
