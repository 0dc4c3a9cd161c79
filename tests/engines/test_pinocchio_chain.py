"""The adapter calls the documented functions of Pinocchio, on a chain in general position."""

from dataclasses import replace

import numpy as np
import pytest

from tests.urdf.drawing import arm, at, axis, joint
from tests.urdf.test_drawings import messy
from tests.verification.chains import GENERAL
from twolink.engines.pinocchio_chain import PinocchioChain
from twolink.urdf import parse_planar_urdf
from twolink.verification import verify

N = 7


@pytest.fixture(scope="module", params=["written by us", "messy"], ids=["written by us", "messy"])
def engine(request) -> PinocchioChain:
    text = GENERAL.to_urdf() if request.param != "messy" else messy(np.random.default_rng(3))
    return PinocchioChain(parse_planar_urdf(text))


@pytest.fixture
def state(random):
    """Angles, speeds, accelerations and a force on D."""
    return tuple(random.uniform(-2, 2, (4, 2, N)))


def differences(function, at, step=1e-6):
    """Central differences by both coordinates: columns on the last axis but one."""
    columns = []
    for coordinate in (0, 1):
        h = np.zeros((2, 1))
        h[coordinate] = step
        columns.append((function(at + h) - function(at - h)) / (2 * step))
    return np.stack(columns, axis=-2)


def test_the_name_contains_the_version(engine):
    assert engine.name.startswith("Pinocchio 4.")


def test_inverse_dynamics_is_made_of_its_parts(engine, state):
    angles, speeds, accelerations, _ = state
    M = engine.evaluate("mass_matrix", angles=angles)
    parts = (
        np.einsum("ijn,jn->in", M, accelerations)
        + engine.evaluate("velocity_terms", angles=angles, speeds=speeds)
        + engine.evaluate("gravity_terms", angles=angles)
    )
    assert engine.inverse_dynamics(angles, speeds, accelerations) == pytest.approx(parts, rel=1e-12)
    C = engine.coriolis_matrix(angles, speeds)
    terms = np.einsum("ijn,jn->in", C, speeds)
    assert engine.evaluate("velocity_terms", angles=angles, speeds=speeds) == pytest.approx(
        terms, rel=1e-11, abs=1e-12
    )


def test_forward_dynamics_undoes_inverse_dynamics(engine, state):
    angles, speeds, accelerations, _ = state
    torques = engine.inverse_dynamics(angles, speeds, accelerations)
    found = engine.forward_dynamics(angles, speeds, torques)
    assert found == pytest.approx(accelerations, rel=1e-9, abs=1e-11)


def test_a_force_on_D_acts_through_its_jacobian(engine, state):
    angles, speeds, accelerations, force = state
    with_force = engine.inverse_dynamics(angles, speeds, accelerations, force)
    without = engine.inverse_dynamics(angles, speeds, accelerations)
    moment = np.einsum("pcn,pn->cn", engine.jacobian("D", angles), force)
    assert without - with_force == pytest.approx(moment, rel=1e-10, abs=1e-11)


@pytest.mark.parametrize("point", ["C1", "C2", "D"])
def test_motion_of_a_point_is_differentiated_position(engine, state, point):
    angles, speeds, accelerations, _ = state
    r, v, a = engine.point_motion(point, angles, speeds, accelerations)
    slope = differences(lambda x: engine.point_motion(point, x, speeds, speeds)[0], angles)
    assert np.moveaxis(slope, -2, 1) == pytest.approx(engine.jacobian(point, angles), abs=1e-8)
    assert v == pytest.approx(
        np.einsum("pcn,cn->pn", engine.jacobian(point, angles), speeds), abs=1e-12
    )
    step = 1e-5
    later, earlier = (
        engine.point_motion(
            point,
            angles + h * speeds + h * h / 2 * accelerations,
            speeds + h * accelerations,
            accelerations,
        )[1]
        for h in (step, -step)
    )
    assert a == pytest.approx((later - earlier) / (2 * step), abs=1e-6)
    assert r.shape == v.shape == a.shape == (2, N)


def test_energies(engine, state):
    angles, speeds, _, _ = state
    T = np.einsum("in,ijn,jn->n", speeds, engine.evaluate("mass_matrix", angles=angles), speeds) / 2
    assert engine.evaluate("kinetic_energy", angles=angles, speeds=speeds) == pytest.approx(
        T, rel=1e-12
    )
    slope = differences(lambda x: engine.evaluate("potential_energy", angles=x)[None], angles)[0]
    assert slope == pytest.approx(engine.evaluate("gravity_terms", angles=angles), abs=1e-6)


def test_derivatives_against_finite_differences(engine, state):
    angles, speeds, accelerations, torques = state
    by_angles, by_speeds = engine.inverse_dynamics_derivatives(angles, speeds, accelerations)
    expected = differences(lambda x: engine.inverse_dynamics(x, speeds, accelerations), angles)
    assert by_angles == pytest.approx(expected, rel=1e-5, abs=1e-6)
    expected = differences(lambda x: engine.inverse_dynamics(angles, x, accelerations), speeds)
    assert by_speeds == pytest.approx(expected, rel=1e-5, abs=1e-6)
    by_angles, by_speeds, by_torques = engine.forward_dynamics_derivatives(angles, speeds, torques)
    expected = differences(lambda x: engine.forward_dynamics(x, speeds, torques), angles)
    assert by_angles == pytest.approx(expected, rel=1e-5, abs=1e-5)
    expected = differences(lambda x: engine.forward_dynamics(angles, x, torques), speeds)
    assert by_speeds == pytest.approx(expected, rel=1e-5, abs=1e-5)
    expected = differences(lambda x: engine.forward_dynamics(angles, speeds, x), torques)
    assert by_torques == pytest.approx(expected, rel=1e-5, abs=1e-5)


def test_both_joint_types_answer_alike(state):
    angles, speeds, accelerations, force = state
    text = GENERAL.to_urdf()
    revolute = text.replace('"continuous">', '"revolute"><limit effort="1" velocity="1"/>')
    first, second = (PinocchioChain(parse_planar_urdf(t)) for t in (text, revolute))
    assert first.inverse_dynamics(angles, speeds, accelerations, force) == pytest.approx(
        second.inverse_dynamics(angles, speeds, accelerations, force), rel=1e-13
    )


def normals_and_tangents(count):
    """Unit vectors at random, and a quarter turn from them: shape (count, 2, N)."""
    angle = np.linspace(-3, 3, N)
    x, y = np.cos(angle), np.sin(angle)
    return np.array([[x, y], [-y, x]][:count])


def rows_along(engine, along, angles):
    return np.einsum("kpn,pcn->kcn", along, engine.jacobian("D", angles))


def times(matrices, vectors):
    return np.einsum("ijn,jn->in", matrices, vectors)


@pytest.mark.parametrize("count", [1, 2])
def test_an_impact_obeys_momentum_balance_and_restitution(engine, state, count):
    """M (v⁺ − v) = Jᵀ Λ and J v⁺ = −e J v."""
    angles, speeds, _, _ = state
    along, e = normals_and_tangents(count), np.linspace(0, 1, N)
    solution = engine.impact(angles, speeds, along, e)
    impulses, after = solution[:count], solution[count:]
    rows = rows_along(engine, along, angles)
    given = times(rows.swapaxes(0, 1), impulses)
    change = times(engine.evaluate("mass_matrix", angles=angles), after - speeds)
    assert change == pytest.approx(given, rel=1e-9, abs=1e-10)
    assert times(rows, after) == pytest.approx(-e * times(rows, speeds), rel=1e-9, abs=1e-10)


@pytest.mark.parametrize("count", [1, 2])
def test_constrained_directions_do_not_accelerate(engine, state, count):
    """Inverse dynamics with the force on D gives back the torques, and D stays along the rows."""
    angles, speeds, _, torques = state
    along = normals_and_tangents(count)
    solution = engine.held(angles, speeds, torques, along)
    forces, accelerations = solution[:count], solution[count:]
    on_D = np.einsum("kpn,kn->pn", along, forces)
    needed = engine.inverse_dynamics(angles, speeds, accelerations, on_D)
    assert needed == pytest.approx(torques, rel=1e-9, abs=1e-10)
    _, _, acceleration = engine.point_motion("D", angles, speeds, accelerations)
    assert np.einsum("kpn,pn->kn", along, acceleration) == pytest.approx(0, abs=1e-9)


def test_the_newer_constrained_dynamics_agrees(engine, state):
    """`constraintDynamics` holds a point as a whole, with Jacobian and drift of its own."""
    angles, speeds, _, torques = state
    pin, model = pytest.importorskip("pinocchio"), engine.model
    frame = model.frames[model.getFrameId("twolink D")]
    models = pin.StdVec_RigidConstraintModel()
    models.append(
        pin.RigidConstraintModel(
            pin.ContactType.CONTACT_3D, model, frame.parentJoint, frame.placement
        )
    )
    datas = pin.StdVec_RigidConstraintData()
    datas.append(models[0].createData())
    data = model.createData()
    pin.initConstraintDynamics(model, data, models, datas)
    settings = pin.ProximalSettings(1e-14, 1e-14, 1e-8, 100)
    solution = engine.held(angles, speeds, torques, normals_and_tangents(2))
    for index, q in enumerate(engine.engine.configurations(angles.T)):
        now = speeds[:, index], torques[:, index]
        accelerations = pin.constraintDynamics(model, data, q, *now, models, datas, settings)
        assert accelerations == pytest.approx(solution[2:, index], rel=1e-6, abs=1e-6)
        force = np.linalg.norm(datas[0].contact_force.linear)
        assert force == pytest.approx(np.hypot(*solution[:2, index]), rel=1e-6)


def test_forward_dynamics_includes_the_force_on_D(engine, state):
    angles, speeds, accelerations, force = state
    torques = engine.inverse_dynamics(angles, speeds, accelerations, force)
    found = engine.forward_dynamics(angles, speeds, torques, force)
    assert found == pytest.approx(accelerations, rel=1e-9, abs=1e-11)


def test_sizes_are_those_in_space():
    sizes = PinocchioChain(parse_planar_urdf(GENERAL.to_urdf())).sizes
    assert sizes.length == GENERAL.L1
    assert sizes.tip == GENERAL.L2
    assert sizes.origin == 0
    assert sizes.radius == pytest.approx([np.hypot(*centre) for centre in GENERAL.centre])
    assert min(sizes.inertia) >= min(GENERAL.inertia)


def about(xyz):
    """Return an arm with both axes along a direction, which gravity is along or nearly."""
    return arm(
        shoulder=joint("shoulder", "ground", "upper", inside=axis(xyz)),
        elbow=joint("elbow", "upper", "lower", inside=axis(xyz) + at("1 0 0")),
    )


@pytest.mark.parametrize("xyz", ["0 0 1", "0 9e-6 1", "0.3 0.5 2", "0 1e-13 1"])
def test_gravity_is_that_of_the_world_in_the_plane(xyz):
    read = parse_planar_urdf(about(xyz))
    chain = PinocchioChain(read)
    # The very vector of the reader, as rounding that is relative to the whole one would count.
    assert list(chain.model.gravity.linear) == [read.gravity * y for y in read.axes[1]]
    assert verify(read, states=20).passed


@pytest.mark.parametrize("xyz", ["0 9e-6 1", "0 1 0", "0 2e-11 1"])
@pytest.mark.parametrize("share", [0.0, 0.9])
def test_gravity_that_a_reader_drops_or_weakens_is_seen(xyz, share):
    read = parse_planar_urdf(about(xyz))
    verdict = verify(replace(read, gravity=share * read.gravity), states=20)
    failed = {each.quantity for each in verdict.comparisons if not each.passed}
    assert {"gravity terms", "potential energy"} <= failed
