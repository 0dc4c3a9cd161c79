"""The contracts of effects: a class that lacks a method cannot be instantiated."""

import inspect

import numpy as np
import pytest

from twolink import effects
from twolink.chain import Chain
from twolink.effects import (
    EFFECTS,
    ConservativeEffect,
    ContactEffect,
    Effect,
    EndDrag,
    EndForce,
    Gravity,
    JointFriction,
    JointSpring,
    JointStop,
    JointTorque,
    MotorInertia,
    ParametricEffect,
    PiecewiseEffect,
    RotorEffect,
    SampledTorque,
    Surface,
    contact_elements,
    discontinuities,
    effect_class,
    names_of,
    pieces_at,
    potential_energy,
    smooth_loads,
    with_rotors,
)
from twolink.loads import Torque, motor_loads
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.smooth.equations import gathered_force

BARS = Chain.uniform_bars()
Q, U = (0.3, 0.5), (0.2, -0.1)
STEPS = SampledTorque((0.0, 1.0), (1.0, 2.0), (0.0, 0.0), "hold")
CONTRACTS = [
    (Effect, {"loads"}),
    (ConservativeEffect, {"loads", "potential_energy"}),
    (ContactEffect, {"loads", "smooth_loads", "contact_elements"}),
    (RotorEffect, {"with_rotors"}),
    (PiecewiseEffect, {"discontinuities", "piece_at"}),
    (ParametricEffect, {"loads", "numbers", "with_numbers"}),
]


@pytest.mark.parametrize(
    ("contract", "methods"), CONTRACTS, ids=lambda x: getattr(x, "__name__", "")
)
def test_an_incomplete_effect_is_refused_with_the_name_of_the_missing_method(contract, methods):
    assert contract.__abstractmethods__ == methods
    for missing in methods:
        names = {name: lambda self, *_: () for name in methods - {missing}}
        incomplete = type("Incomplete", (contract,), names)
        with pytest.raises(TypeError, match=rf"abstract method '?{missing}'?"):
            incomplete()


@pytest.mark.parametrize("name", EFFECTS)
def test_every_registered_effect_fulfils_a_contract(name):
    kind = effect_class(name)
    assert issubclass(kind, Effect)
    assert not inspect.isabstract(kind)


def test_effects_have_different_names():
    walls = [Surface((1.0, 0.0), (-1.0, 0.0), name=name) for name in ("3", "", "")]
    acting = (Gravity(), EndForce(1.0, 0.0), Gravity(), *walls)
    names = ["Gravity", "EndForce", "Gravity 2", "Surface 3", "Surface", "Surface 2"]
    assert names_of(acting) == names


def test_the_contracts_are_public():
    assert {contract.__name__ for contract, _ in CONTRACTS} <= set(dir(effects))


def test_smooth_loads_are_those_beside_contact_elements():
    """The loads of friction and stops depend on the mode; those of a force on D do not."""
    force = EndForce(-2.0, 0.5)
    acting = (Gravity(), JointFriction((1.0, 1.0)), JointStop("A", lower=0.0), force)
    found = smooth_loads(acting, BARS, Q, U)
    assert found == (*Gravity().loads(BARS, Q, U), *force.smooth_loads(BARS, Q, U))
    assert len(contact_elements(acting, BARS)) == 4


def test_contacts_of_one_name_have_numbers():
    """Two surfaces that were not named are told apart in logs and forces."""
    floors = Surface((0.0, 0.5), (0.0, -1.0)), Surface((0.0, 0.7), (0.1, -1.0))
    names = [element.name for element in contact_elements(floors, BARS)]
    assert names == ["D on surface", "D on surface 2"]


def test_the_loads_of_an_effect_are_smooth_by_default():
    class Motor(Effect):
        def loads(self, chain, q, u, t=0.0):
            return motor_loads(1.0, 0.0)

    assert smooth_loads((Motor(),), BARS, Q, U) == motor_loads(1.0, 0.0)
    assert Motor().shortest_time == float("inf")
    assert contact_elements((Motor(),), BARS) == ()


def test_potential_energies_are_added():
    spring = JointSpring((2.0, 3.0))
    total = potential_energy((Gravity(), spring, MotorInertia((0.1, 0.0))), BARS, Q)
    assert total == Gravity().potential_energy(BARS, Q) + spring.potential_energy(BARS, Q)


def test_pieces_follow_each_other_at_the_discontinuities():
    acting = (Gravity(), STEPS)
    assert discontinuities(acting) == (0.0, 1.0)
    before, after = (pieces_at(acting, t)[1].loads(BARS, Q, U, t) for t in (0.5, 1.5))
    assert before == STEPS.loads(BARS, Q, U, 0.5)
    assert after == STEPS.loads(BARS, Q, U, 1.5)
    assert pieces_at(acting, 0.5)[0] is acting[0]


class Pieces(PiecewiseEffect):
    """The same torques as `STEPS`, and a drag that replaces them at 2 s."""

    discontinuities = (0.0, 1.0, 2.0)

    def piece_at(self, t):
        return JointTorque((1.0 if t < 1.0 else 2.0, 0.0)) if t < 2.0 else EndDrag(0.3)


def test_loads_at_many_times_are_those_of_the_pieces_there():
    times = np.array([0.0, 0.5, 1.0, 1.5, 2.0, 3.5])
    q = np.linspace(0.1, 0.4, 6), np.linspace(0.2, -0.4, 6)
    found = gathered_force(BARS, q, smooth_loads((Pieces(),), BARS, q, (0 * q[0], q[1]), times))
    for place, t in enumerate(times.tolist()):
        here = q[0][place], q[1][place]
        for loads in (Pieces().loads(BARS, here, (0.0, here[1]), t),
                      Pieces().piece_at(t).loads(BARS, here, (0.0, here[1]), t)):  # fmt: skip
            exact = gathered_force(BARS, here, loads)
            assert [force[place] for force in found] == pytest.approx(exact, rel=1e-15)


def test_loads_of_pieces_count_only_where_these_act():
    """The first piece is not finite where another one acts."""

    class Root(Effect):
        def loads(self, chain, q, u, t=0.0):
            return Torque(1, 1.0 / (t - 1.0)), Torque(2, 2.0 * t)

    class Ends(PiecewiseEffect):
        discontinuities = (1.0,)

        def piece_at(self, t):
            return Root() if t < 1.0 else Gravity(0.0)

    with np.errstate(divide="ignore"):
        loads = Ends().loads(BARS, Q, U, np.array([0.5, 1.0]))
    assert [load.moment.tolist() for load in loads[:2]] == [[-2.0, 0.0], [1.0, 0.0]]
    assert all(np.all(np.array(load.components) == 0) for load in loads[2:])


def test_the_work_of_pieces_is_theirs():
    """A class of a user as the library's, where a method `loads` that differs is not used."""

    class Other(Pieces):
        def loads(self, chain, q, u, t=0.0):
            return (Torque(1, 1e9),)

    sums = []
    for effect in (STEPS, Other()):
        scene = Scene(BARS, Q, U, 1.8, (Gravity(), effect))
        found = simulate(scene, accuracy=1e-9, samples=31)
        assert found.met
        _, work = found.work().values()
        sums.append([*found.q[:, -1], work[-1]])
    for one, other in zip(*sums, strict=True):
        assert one == pytest.approx(other, abs=1e-8)


def test_rotors_of_all_effects_are_added():
    chain = with_rotors((MotorInertia((0.1, 0.0)), Gravity(), MotorInertia((0.0, 0.2))), BARS)
    assert len(chain.rotors) == 2
