import numpy as np
import pytest

from tests.ensembles.cases import UNCOUPLED
from tests.variations.cases import RICH, SPRING, TORQUES, J, family, oscillation
from twolink.effects import pieces_at
from twolink.errors import IntegrationError, SimulationError
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.taylor import taylor_run
from twolink.variations.directions import directions
from twolink.variations.system import VariedSystems, check_form, varied_motion


def varied(scene, *parameters, formulation="momenta", precision="double", count=11):
    own = family(scene, *parameters)
    made = own.scene(own.values)
    times = np.linspace(0.0, made.duration, count)
    along = directions(own)
    return times, varied_motion(made, along, times, formulation, precision, lambda share: None)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("formulation", EQUATIONS)
def test_an_oscillator_in_every_precision_and_by_all_equations(formulation, precision):
    names = ("start.q.0", "start.u.0", "effects.joint_spring.rest.0")
    t, found = varied(SPRING, *names, formulation=formulation, precision=precision)
    _, _, by_q, by_u = oscillation(t)
    by_rest = 1 - by_q[0], -by_q[1]
    for k, (dq, du) in enumerate((by_q, by_u, by_rest)):
        assert found.dq[k, 0].astype(float) == pytest.approx(dq, abs=1e-13)
        assert found.du[k, 0].astype(float) == pytest.approx(du, abs=1e-13)
        # Link 2 is not coupled to it.
        assert np.abs(found.dq[k, 1].astype(float)).max() < 1e-14


def test_the_motion_is_that_of_a_run_without_derivatives():
    t, found = varied(RICH, "chain.mass.0", "effects.end_drag.coefficient")
    own = family(RICH).scene([])
    alone = taylor_run(own, t, formulation="momenta")
    assert np.abs(found.q - alone.q).max() < 1e-13
    assert np.abs(found.u - alone.u).max() < 1e-13


def test_all_parameters_together_are_as_each_alone():
    names = ("start.theta.1", "chain.length.0", "effects.motor_inertia.inertia.1")
    _, together = varied(RICH, *names)
    for k, name in enumerate(names):
        _, alone = varied(RICH, name)
        assert together.dq[k] == pytest.approx(alone.dq[0], abs=1e-12)
        assert together.du[k] == pytest.approx(alone.du[0], abs=1e-12)


def test_a_parameter_that_must_be_a_float_is_named():
    own = family("general", "effects.gravity.direction.0")
    with pytest.raises(SimulationError, match="the direction must be a number by which"):
        check_form(own.scene(own.values), directions(own)[0], "the direction")


@pytest.mark.slow_but_first
@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("formulation", EQUATIONS)
def test_a_held_torque_s_samples_in_closed_form(formulation, precision):
    """I2 q2″ is the torque at B, and J q1″ its reaction: speeds change while a sample is held."""
    times = [0.0, 0.5, 1.25]
    scene = {
        **UNCOUPLED,
        "run": {"duration": 2.0},
        "effects": {
            "sampled_torque": {
                "times": times,
                "A": [0.0, 0.0, 0.0],
                "B": [0.25, 1.0, -2.0],
                "interpolation": "hold",
            }
        },
    }
    names = ("effects.sampled_torque.B.1", "start.u.1", "effects.sampled_torque.B.2")
    t, found = varied(scene, *names, formulation=formulation, precision=precision, count=9)
    inertia = UNCOUPLED["chain"]["inertia"][1]
    after = [np.maximum(t - begin, 0.0) for begin in times]
    by_first = (after[1] - after[2]) / inertia, (after[1] ** 2 - after[2] ** 2) / 2 / inertia
    expected = [by_first, (np.ones(9), t), (after[2] / inertia, after[2] ** 2 / 2 / inertia)]
    for k, (du, dq) in enumerate(expected):
        assert found.du[k, 1].astype(float) == pytest.approx(du, abs=1e-14)
        assert found.dq[k, 1].astype(float) == pytest.approx(dq, abs=1e-14)
        reaction = 0.0 if k == 1 else -inertia / J
        assert found.dq[k, 0].astype(float) == pytest.approx(reaction * dq, abs=1e-14)


def test_pieces_share_one_compiled_system():
    own = family(TORQUES, "chain.mass.0", "effects.sampled_torque.A.1")
    scene = own.scene(own.values)
    systems = VariedSystems.of(scene, directions(own), "momenta", "double")
    found = [systems.at(t, pieces_at(scene.effects, t)) for t in (0.0, 0.1, 1.5)]
    assert found[0].pool is found[1].pool is found[2].pool
    assert found[0].numbers != found[1].numbers


def test_a_motion_that_ends_is_an_error():
    # The spring pushes: the motion grows by e^1500.
    scene = {
        **SPRING,
        "run": {"duration": 2000.0},
        "effects": {"joint_spring": {"stiffness": [-1.0, 0.0]}},
    }
    with pytest.raises(IntegrationError, match="could not be integrated beyond"):
        varied(scene, "start.q.0")
