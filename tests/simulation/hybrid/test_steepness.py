"""The steepness of event functions against derivatives by hand, and compiled formulas."""

import math
from dataclasses import dataclass

import pytest

from tests.simulation.hybrid import BALANCED, mode_of, system_of
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.effect import Effect
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.loads import motor_loads
from twolink.simulation.hybrid import steepness as module
from twolink.simulation.hybrid.event_functions import triggers
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.steepness import EventFunction, steepness


def steepness_at(system, mode, q, trigger):
    """Return the steepness of an event function at rest in a pose."""
    state = [system.number(x) for x in (*q, 0.0, 0.0)]
    return steepness(system, mode, state, 0.0, trigger)


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
@pytest.mark.parametrize("depth", [1e-9, 1e-7, 1e-4])
@pytest.mark.parametrize("mirrored", [False, True])
def test_the_steepness_of_a_force_is_not_too_small_where_a_point_is_hardly_pressed_in(
    precision, depth, mirrored
):
    """B presses with K δ^1.5, of the slope 1.5 K √δ, and not at all off the surface."""
    soft = CompliantSurface(
        (0.0, math.sin(0.5)), (0.0, -1.0), "hertz", stiffness=1e4, on=("B",), friction=0.5, static=5
    )
    system = system_of(soft, chain=BALANCED, precision=precision)
    mode = mode_of(system, S.STICKS)
    turned = math.asin(math.sin(0.5) + depth)
    q = math.pi - turned if mirrored else turned, 0.3
    found = [steepness_at(system, mode, q, Trigger(E.BREAKS, 0, sense)) for sense in (1, -1)]
    # The sum of both functions is twice the limit, whose depth changes by cos q1.
    slope = 5 * 1.5e4 * math.sqrt(depth) * math.cos(turned) * system.scales.force(0)
    assert sum(found) > 2 * 0.99 * slope


def test_a_steepness_is_infinite_where_constraints_have_no_solution(monkeypatch):
    """Nothing is known of the error by which the event comes: its doubt counts in any case."""

    def parallel(*arguments):
        raise ZeroDivisionError

    system = system_of(JointFriction((1.0, 0.0), (1.5, 0.0)), chain=BALANCED)
    mode = mode_of(system, *[S.STICKS] * len(system.elements))
    limit = (system, mode, (0.0, 0.0), Trigger(E.BREAKS, 0, 1))
    assert math.isfinite(steepness_at(*limit))
    monkeypatch.setattr(module, "mode_solution", parallel)
    assert steepness_at(*limit) == math.inf


@dataclass(frozen=True)
class Table(Effect):
    """A torque at A that is no formula: it asks for the number of the time."""

    def loads(self, chain, q, u, t=0.0):
        return motor_loads(math.floor(t) + 2.0, 0.0)


FRICTION = JointFriction((1.0, 0.5), (1.5, 0.7))
FLOOR = Surface((0.0, 0.8), (0.0, -1.0), friction=0.3, static=0.4, restitution=0.5)
SOFT = CompliantSurface(
    (0.0, 0.4), (0.0, -1.0), "hunt-crossley", stiffness=1e4, loss=0.3, on=("B",), friction=0.5
)
DRIVEN = JointTorque((1.0, -0.5), (2.0, 0.3), (3.0, 1.0)), JointDamping((0.2, 0.1)), Gravity()
CASES = {
    "two joints hold": ((FRICTION, *DRIVEN), (S.STICKS, S.STICKS)),
    "one joint slips": ((FRICTION, *DRIVEN), (S.FORWARD, S.STICKS)),
    "a joint and a floor": ((FRICTION, FLOOR, *DRIVEN), (S.STICKS, S.BACKWARD, S.FORWARD)),
    "a soft surface": ((FRICTION, SOFT, *DRIVEN), (S.STICKS, S.STICKS, S.FORWARD)),
    "no formula": ((FRICTION, Table()), (S.STICKS, S.STICKS)),
}


@pytest.mark.parametrize("formulation", ["kane", "lagrange"])
@pytest.mark.parametrize("case", CASES)
def test_a_compiled_event_function_has_the_bits_of_the_plain_one(case, formulation, random):
    effects, states = CASES[case]
    system = system_of(*effects, formulation=formulation)
    mode = mode_of(system, *states, *[S.OPEN] * (len(system.elements) - len(states)))
    for trigger in triggers(system, mode):
        if trigger.kind not in (E.BREAKS, E.STOPS):
            continue
        often, compiled = EventFunction(system, mode, trigger), []
        for _ in range(100):
            q, u = (tuple(pair) for pair in random.uniform(-2.0, 2.0, (2, 2)).tolist())
            time = float(random.uniform(0.0, 2.0))
            once = EventFunction(system, mode, trigger)
            assert often(q, u, time) == once(q, u, time)
            compiled.append(often.is_compiled)
        assert compiled[-1] is (case != "no formula")
        assert not compiled[0]


def test_an_event_function_is_made_once_for_a_mode():
    system = system_of(FRICTION, *DRIVEN)
    mode = mode_of(system, S.STICKS, S.STICKS)
    for _ in range(3):
        steepness_at(system, mode, (0.3, 0.7), Trigger(E.BREAKS, 0, 1))
    (function,) = system.event_functions.values()
    # Two changes of each angle and each speed.
    assert function.is_compiled is False
    for _ in range(2):
        steepness_at(system, mode, (0.3, 0.7), Trigger(E.BREAKS, 0, 1))
    assert function.is_compiled
