"""Contact at D: agreement with Pinocchio and with the simulation, and checks that can fail."""

import json
from dataclasses import dataclass, replace

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from typer.testing import CliRunner

from tests.conftest import SEED
from tests.mutants import Mutant, mutants
from tests.strategies import chains
from tests.urdf.test_drawings import messy
from tests.verification.chains import GENERAL
from tests.verification.test_verify_can_fail import agree_with_rotors, survivors
from twolink import kane, kinematics, lagrange
from twolink.chain import Chain
from twolink.cli import app
from twolink.contact import coordinates as directions
from twolink.contact import impact_laws as impacts
from twolink.contact.elastoplastic import ElastoPlastic, Material
from twolink.contact.elements import CompliantContact
from twolink.contact.force_laws import Phase, PlasticState
from twolink.contact.states import ContactState
from twolink.coordinates import JointConvention
from twolink.data import data_path
from twolink.effects import ContactEffect
from twolink.effects.gravity import Gravity
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.engines.pinocchio_chain import PinocchioChain
from twolink.errors import ParameterError
from twolink.formulations import FORMULATIONS, Formulation
from twolink.simulation.hybrid import constraint, dynamics
from twolink.simulation.hybrid import pose as pose_module
from twolink.simulation.hybrid.dynamics import mode_solution
from twolink.simulation.hybrid.impact import Impacts
from twolink.simulation.hybrid.pose import Pose
from twolink.urdf import parse_planar_urdf, read_planar_urdf
from twolink.verification import contact
from twolink.verification.contact import CONTACT, ContactSpace, verify_contact
from twolink.verification.contact_tolerance import _Contact, contact_tolerance
from twolink.verification.jointspace import PlanarModel
from twolink.verification.quantities import Formula
from twolink.verification.states import random_contact_states
from twolink.verification.tolerance import Problem, Scale

SHIPPED = read_planar_urdf(data_path("twolink.urdf"))
FEW = 5
THE_SOURCES = JointConvention()
SOLVED = {quantity.name: quantity for quantity in CONTACT}


@pytest.fixture(scope="module")
def urdf():
    return parse_planar_urdf(GENERAL.to_urdf())


@pytest.fixture(scope="module")
def engine(urdf):
    return PinocchioChain(urdf)


def left_out(verdict) -> int:
    words = verdict.assumptions[-1].split()
    assert words[0] == "Excluded:"
    return int(words[1])


def failed(verdict) -> set[str]:
    return {c.quantity for c in verdict.comparisons if not c.passed}


# Agreement


@pytest.mark.slow
def test_the_shipped_urdf_agrees_on_ten_thousand_states():
    verdict = verify_contact(SHIPPED, states=10_000, seed=SEED)
    assert verdict.passed, verdict.sentence
    assert len(verdict.comparisons) == 3 * len(CONTACT)
    assert left_out(verdict) == 0


@pytest.mark.slow
@given(chain=chains(ratio=4))
@settings(max_examples=25)
def test_random_chains_agree(chain):
    """Ratios from 1e-4 to 1e4: there Pinocchio's J M⁻¹ Jᵀ has digits left in most poses."""
    verdict = verify_contact(parse_planar_urdf(chain.to_urdf()), states=200, seed=SEED)
    assert verdict.passed, verdict.sentence


@pytest.mark.long
@pytest.mark.slow
@given(chain=chains())
@settings(max_examples=100)
def test_random_chains_agree_wherever_pinocchio_has_digits_left(chain):
    """Where link 2 has some 1e8 times the inertia of link 1, M over joint angles has none."""
    try:
        verdict = verify_contact(parse_planar_urdf(chain.to_urdf()), states=200, seed=SEED)
    except ParameterError:
        at_A = chain.I_C1 + chain.m1 * chain.C1.along**2 + chain.m2 * chain.L1**2
        at_B = chain.I_C2 + chain.m2 * (chain.C2.along**2 + chain.C2.across**2)
        assert at_B > 1e8 * at_A or chain.L2 > 1e4 * chain.L1
        return
    assert verdict.passed, verdict.sentence


@pytest.mark.slow_but_first
@pytest.mark.parametrize("seed", range(8))
def test_drawings_of_every_kind_agree(seed):
    """Axes of either sign and any direction, frames turned and moved."""
    urdf = parse_planar_urdf(messy(np.random.default_rng(seed)))
    verdict = verify_contact(urdf, states=500, seed=SEED)
    assert verdict.passed, verdict.sentence
    assert left_out(verdict) == 0


@pytest.mark.slow_but_first
@pytest.mark.parametrize("first", [1, -1])
@pytest.mark.parametrize("second", [1, -1])
def test_axes_of_either_sign_agree(first, second):
    pieces = GENERAL.to_urdf().split('<axis xyz="0 1 0"/>')
    axes = [f'<axis xyz="0 {sign} 0"/>' for sign in (first, second)]
    urdf = parse_planar_urdf(pieces[0] + axes[0] + pieces[1] + axes[1] + pieces[2])
    # Signs are counted from the first axis: it is z, or the plane is seen from behind.
    assert urdf.joints.sign[0] * urdf.joints.sign[1] == first * second
    verdict = verify_contact(urdf, states=500, seed=SEED)
    assert verdict.passed, verdict.sentence


def test_one_formulation_alone():
    verdict = verify_contact(SHIPPED, states=10, formulations={"kane": FORMULATIONS["kane"]})
    assert {c.source for c in verdict.comparisons} == {"Kane"}
    assert len(verdict.comparisons) == len(CONTACT)


def test_the_same_seed_gives_the_same_verdict():
    first, second = (verify_contact(SHIPPED, states=50, seed=7) for _ in range(2))
    assert first == second
    assert verify_contact(SHIPPED, states=50, seed=8).comparisons != first.comparisons


def test_states_are_general():
    states = random_contact_states(10_000, seed=(SEED, 0))
    assert np.hypot(*states.normal) == pytest.approx(1)
    assert np.all(states.normal != 0)
    e, along = states.restitution
    assert 0 < e.min() < 0.01
    assert 0.99 < e.max() < 1
    assert np.all(along == 0)


# Simulation


def solved_by(engine, urdf, name, states):
    """Return Pinocchio's solution, and the tolerances of its forces and motion."""
    chain = Chain.from_links(urdf.links)
    model = PlanarModel(chain, urdf.joints, urdf.gravity)
    answer = SOLVED[name].call(engine, states)
    scale = Scale.of(chain, joint=True, gravity=urdf.gravity, joints=urdf.joints)
    scale = replace(scale.widened(engine.sizes), from_world=True)
    formula = Formula(SOLVED[name], ContactSpace(FORMULATIONS["kane"], model))
    roundings = formula.roundings + engine.contact_roundings
    problem = Problem(chain, scale, states, roundings, found=answer)
    situation = name.partition(":")[0]
    allowed = [contact_tolerance(q.name, problem) for q in CONTACT if q.name.startswith(situation)]
    return answer, np.concatenate(allowed)


def absolute(urdf, states, index):
    """Return q and u of a state."""
    angles, speeds = (tuple(map(float, x[:, index])) for x in (states.angles, states.speeds))
    return urdf.joints.absolute_angles(angles), urdf.joints.absolute_speeds(speeds)


def surface_at(chain, q, states, index, **how):
    point = kinematics.position(chain, q, chain.D)
    normal = tuple(map(float, states.normal[:, index]))
    return Surface(tuple(map(float, point)), normal, **how)


def struck(surface, formulation, q, u):
    pose = Pose(GENERAL, formulation, q)
    return Impacts(pose, surface.contact_elements(GENERAL), 0.0, 2.0**-52).impact(0, u)


@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_an_impact_in_simulation_is_pinocchios(urdf, engine, formulation):
    states = random_contact_states(300, seed=(SEED, 1))
    answer, allowed = solved_by(engine, urdf, "frictionless impact: impulse", states)
    for index in range(len(states)):
        q, u = absolute(urdf, states, index)
        e = float(states.restitution[0, index])
        surface = surface_at(GENERAL, q, states, index, restitution=e)
        strike = struck(surface, formulation, q, u)
        found = np.array([strike.impulse.normal, *urdf.joints.joint_speeds(strike.u[1])])
        assert np.all(np.abs(found - answer[:, index]) <= allowed[:, index])


@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_an_impact_that_sticks_in_simulation_is_pinocchios(urdf, engine, formulation):
    """Rough enough to hold D in the impacts that press it on: half of all that come in."""
    states = random_contact_states(300, seed=(SEED, 2))
    answer, allowed = solved_by(engine, urdf, "sticking impact: impulses", states)
    stuck = 0
    for index in range(len(states)):
        q, u = absolute(urdf, states, index)
        surface = surface_at(GENERAL, q, states, index, friction=1e3, law="newton")
        strike = struck(surface, formulation, q, u)
        if strike.speeds[0] > 0 or strike.impulse.regime != "sticks":
            continue
        stuck += 1
        forces = strike.impulse.normal, strike.impulse.tangential
        found = np.array([*forces, *urdf.joints.joint_speeds(strike.u[1])])
        assert np.all(np.abs(found - answer[:, index]) <= allowed[:, index])
    assert stuck > 50


@pytest.mark.parametrize(
    ("name", "state"),
    [
        ("frictionless contact: force", ContactState.CLOSED),
        ("sticking contact: forces", ContactState.STICKS),
    ],
)
@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_resting_in_simulation_is_pinocchios(urdf, engine, formulation, name, state):
    """On a surface of a scene, with the speeds that D may have on it: along it, or none."""
    states = random_contact_states(300, seed=(SEED, 3))
    for index in range(len(states)):
        q, u = absolute(urdf, states, index)
        (x1, y1), (x2, y2) = kane.partial_velocities(GENERAL, q, GENERAL.D)
        x, y = states.normal[:, index]
        row = x * x1 + y * y1, x * x2 + y * y2
        along = (-row[1], row[0]) if state is ContactState.CLOSED else (0.0, 0.0)
        states.speeds[:, index] = urdf.joints.joint_speeds(along)
    answer, allowed = solved_by(engine, urdf, name, states)
    for index in range(len(states)):
        q, u = absolute(urdf, states, index)
        friction = 1.0 if state is ContactState.STICKS else 0.0
        surface = surface_at(GENERAL, q, states, index, friction=friction)
        torques = tuple(map(float, states.torques[:, index]))
        acting = (Gravity(urdf.gravity), JointTorque(torques), surface)
        pose = Pose(GENERAL, formulation, q)
        elements = surface.contact_elements(GENERAL)
        solution = mode_solution(pose, acting, elements, (state,), (None,), u, 0.0)
        forces = solution.forces[0][: 1 if state is ContactState.CLOSED else 2]
        found = np.array([*forces, *urdf.joints.joint_speeds(solution.du)])
        assert np.all(np.abs(found - answer[:, index]) <= allowed[:, index])


@pytest.mark.parametrize("phase", [Phase.YIELDS, Phase.FLOWS])
@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_compliant_contact_moves_as_in_pinocchio(urdf, engine, formulation, phase):
    """D pressed into a surface that yields, and slid along it: Pinocchio is given both forces."""
    states = random_contact_states(300, seed=(SEED, 4))
    x, y = states.normal
    material = Material(1e6, 0.05, 2e4, 0.3)
    depth = (1.4 if phase is Phase.YIELDS else 6.0) * material.yield_depth
    normal = material.compression(depth)
    assert 0.1 < normal < 10
    states.end_force[:] = normal * np.array([x + 0.3 * y, y - 0.3 * x])
    answer, allowed = solved_by(engine, urdf, "given force on D: motion", states)
    for index in range(len(states)):
        q, u = absolute(urdf, states, index)
        direction = _AtDepth("D", (float(x[index]), float(y[index])), -depth)
        tangent = directions.PointCoordinate("D", (float(-y[index]), float(x[index])))
        law = ElastoPlastic(material)
        cushion = CompliantContact(
            "D", direction, 0.0, law.branch(PlasticState(phase)).law, tangent, 0.3, 0.3, law
        )
        torques = tuple(map(float, states.torques[:, index]))
        acting = (Gravity(urdf.gravity), JointTorque(torques), _Pressed(cushion))
        pose, states_of = Pose(GENERAL, formulation, q), (ContactState.FORWARD,)
        dents = (PlasticState(phase),)
        solution = mode_solution(pose, acting, (cushion,), states_of, dents, u, 0.0)
        found = np.array(urdf.joints.joint_speeds(solution.du))
        assert np.all(np.abs(found - answer[:, index]) <= allowed[:, index])


@dataclass(frozen=True)
class _AtDepth(directions.PointCoordinate):
    """A direction in which D is at a given place: that of a random pose has too few digits."""

    place: float

    def coordinate(self, chain, q):
        return self.place


@dataclass(frozen=True)
class _Pressed(ContactEffect):
    cushion: CompliantContact

    def loads(self, chain, q, u, t=0.0):
        return ()

    def smooth_loads(self, chain, q, u, t=0.0):
        return ()

    def contact_elements(self, chain):
        return (self.cushion,)


# Tolerance


def bent_by(elbow: float):
    """Return a way to draw states whose elbow is bent by an angle (rad) of either sign, or is
    folded but for it."""

    def draw(n, *, seed, **largest):
        states = random_contact_states(n, seed=seed, **largest)
        random = np.random.default_rng(seed)
        sign = random.choice([-1.0, 1.0], n)
        states.angles[1] = sign * elbow + random.choice([0.0, np.pi], n)
        return states

    return draw


@pytest.mark.slow_but_first
@pytest.mark.parametrize("power", range(1, 6))
def test_near_singular_poses_are_compared(power):
    """Stretched and folded to 1e-5 rad: D hardly moves along the arm, and nothing is left out."""
    verdict = verify_contact(SHIPPED, states=2000, seed=SEED, draw=bent_by(10.0**-power))
    assert verdict.passed, verdict.sentence
    assert left_out(verdict) == 0


def test_singular_poses_are_left_out_and_counted():
    half = bent_by(1e-9)

    def draw(n, *, seed, **largest):
        states, straight = random_contact_states(n, seed=seed, **largest), half(n, seed=seed)
        states.angles[1, ::2] = straight.angles[1, ::2]
        return states

    verdict = verify_contact(SHIPPED, states=2000, seed=SEED, draw=draw)
    assert verdict.passed, verdict.sentence
    assert verdict.assumptions[-1] == (
        "Excluded: 1000 of 2000 poses, in which J M⁻¹ Jᵀ is singular to rounding."
    )


def test_a_comparison_in_singular_poses_only_is_refused():
    with pytest.raises(
        ParameterError, match="sticking impact: impulses: J M⁻¹ Jᵀ of D is singular"
    ):
        verify_contact(SHIPPED, states=50, draw=bent_by(1e-12))


def posed(chain, states, roundings=50, joints=THE_SOURCES, found=None):
    scale = Scale.of(chain, joint=True, gravity=9.81, joints=joints)
    return Problem(chain, scale, states, roundings, found=found)


def test_the_tolerance_grows_with_the_condition_of_the_contact():
    """By 1/sin² of the elbow where both rows bar: G's condition is the square of that of J."""
    found = np.ones((4, 200))
    wide, narrow = (
        contact_tolerance(
            "sticking impact: impulses",
            as_an_engine(posed(GENERAL, bent_by(bend)(200, seed=(1, 1)), found=found)),
        )
        for bend in (1e-2, 1e-4)
    )
    assert np.median(narrow / wide) == pytest.approx(1e4, rel=0.1)


def as_an_engine(problem):
    """Return a problem as it is when the other side is an engine."""
    return replace(problem, scale=replace(problem.scale, in_space=True))


def test_the_tolerance_in_ordinary_poses_is_1e_minus_10_of_the_values_or_less():
    """In an ordinary pose it is some 1e-12 of the value: ten digits at least are compared."""
    states = random_contact_states(1000, seed=(SEED, 4))
    model = PlanarModel(GENERAL, THE_SOURCES, 9.81)
    for quantity in CONTACT:
        formula = Formula(quantity, ContactSpace(FORMULATIONS["kane"], model))
        values = formula.values(states)
        problem = as_an_engine(posed(GENERAL, states, formula.roundings + 150, found=values))
        allowed = contact_tolerance(quantity.name, problem)
        size = np.abs(values).max(axis=0)
        assert np.median(allowed / size) < 1e-10, quantity.name


@pytest.mark.parametrize("joint", [False, True])
@pytest.mark.parametrize("count", [1, 2])
def test_sizes_are_those_of_the_quantities(joint, count):
    """|Z|, |J|, |G⁻¹| and |Z G⁻¹| hold, also with the larger sizes that an engine meets."""
    states = random_contact_states(300, seed=(SEED, 5))
    problem = posed(GENERAL, states, found=np.zeros((count + 2, 300)))
    wide = replace(problem.scale, inertia=(7.0, 9.0), radius=(3.0, 4.0), tip=5.0, in_space=True)
    sizes = _Contact(replace(problem, scale=wide), count, joint)
    q = tuple(np.cumsum(states.angles, axis=0))
    S = np.array([[1.0, 0.0], [1.0, 1.0]]) if joint else np.eye(2)
    (x1, y1), (x2, y2) = kane.partial_velocities(GENERAL, q, GENERAL.D)
    (M11, M12), (_, M22) = kane.mass_matrix(GENERAL, q)
    for index in range(300):
        n = states.normal[:, index]
        J = np.array([[x1[index], x2[index]], [y1[index], y2[index]]])
        J = np.array([n, (-n[1], n[0])])[:count] @ J @ S
        M = S.T @ np.array([[M11, M12[index]], [M12[index], M22]]) @ S
        Z = np.linalg.solve(M, J.T)
        inverse = np.linalg.inv(J @ Z)
        found = sizes.inverse(0.0)
        slack = 1 + 1e-9
        assert np.all(np.abs(J) <= sizes.rows[..., index] * slack)
        assert np.all(np.abs(Z) <= sizes.response[..., index] * slack)
        assert sizes.response[..., index] == pytest.approx(np.abs(Z), rel=1e-9, abs=1e-10)
        assert np.all(np.abs(inverse) <= found[..., index] * slack)
        assert np.all(np.abs(Z @ inverse) <= sizes.drive(found)[..., index] * slack)


@pytest.mark.parametrize("formulation", FORMULATIONS.values(), ids=FORMULATIONS)
@pytest.mark.parametrize("quantity", CONTACT, ids=lambda quantity: quantity.name)
@pytest.mark.parametrize("bend", [None, 1e-3, 1e-6])
def test_float64_errors_are_within_the_tolerance(formulation, quantity, bend):
    """Against 50 digits, also nearly stretched; the tolerance is that of our solution alone."""
    draw = random_contact_states if bend is None else bent_by(bend)
    states = draw(20, seed=(SEED, 6))
    joints = JointConvention((1, -1), (0.0, 0.0))
    formula = Formula(quantity, ContactSpace(formulation, PlanarModel(GENERAL, joints, 9.81)))
    values = formula.values(states)
    problem = posed(GENERAL, states, formula.roundings, joints, found=values)
    allowed = contact_tolerance(quantity.name, problem)
    with mpmath.workdps(50):
        model = PlanarModel(GENERAL.convert(mpmath.mpf), joints, mpmath.mpf(9.81))
        text = quantity.text(ContactSpace(formulation, model))
        for index in range(20):
            inputs = [getattr(states, name)[:, index] for name in quantity.inputs]
            exact = text(*(tuple(mpmath.mpf(float(x)) for x in pair) for pair in inputs))
            wrong = [float(abs(x - y)) for x, y in zip(values[:, index], exact, strict=True)]
            assert np.all(quantity.of(np.array(wrong)) <= allowed[..., index])


# The checks can fail

IMPACT = {"frictionless impact: impulse", "frictionless impact: speeds after"}
STICKING_IMPACT = {"sticking impact: impulses"}
RESTING = {"frictionless contact: force", "frictionless contact: motion"}
STICKING = {"sticking contact: forces", "sticking contact: motion"}


def test_a_wrong_restitution_is_detected(urdf, engine, monkeypatch):
    right = impacts.smooth_impulse
    wrong = lambda v, response, e: right(v, response, e * (1 + 1e-9))  # noqa: E731
    monkeypatch.setattr(contact, "smooth_impulse", wrong)
    assert failed(verify_contact(urdf, states=FEW, engine=engine)) == IMPACT


@pytest.mark.parametrize("factor", [0, -1, 1 + 1e-9])
def test_a_wrong_bias_is_detected(urdf, engine, monkeypatch, factor):
    right = directions.PointCoordinate.bias
    wrong = lambda *state: factor * right(*state)  # noqa: E731
    monkeypatch.setattr(directions.PointCoordinate, "bias", wrong)
    verdict = verify_contact(urdf, states=FEW, engine=engine)
    assert failed(verdict) == RESTING | STICKING
    # Both formulations have it from the kinematics: only Pinocchio can show the fault.
    assert {c.against for c in verdict.comparisons if not c.passed} == {engine.name}


def test_a_reversed_tangent_is_detected(urdf, engine, monkeypatch):
    """A quarter turn the other way: the motion stays, the second force changes its sign."""

    def wrong(self, chain):
        (obstacle,) = right(self, chain)
        if obstacle.tangent is None:
            return (obstacle,)
        x, y = obstacle.tangent.vector
        return (replace(obstacle, tangent=replace(obstacle.tangent, vector=(-x, -y))),)

    right = contact._Touched.contact_elements
    monkeypatch.setattr(contact._Touched, "contact_elements", wrong)
    found = failed(verify_contact(urdf, states=FEW, engine=engine))
    assert found == STICKING_IMPACT | {"sticking contact: forces"}


@pytest.mark.slow_but_first
@pytest.mark.parametrize("factor", [-1, 1 + 1e-9])
@pytest.mark.parametrize(
    ("text", "jacobian", "other"),
    [(kane, "partial_velocities", "Lagrange"), (lagrange, "position_gradients", "Kane")],
    ids=["kane", "lagrange"],
)
def test_a_wrong_row_is_detected(urdf, engine, monkeypatch, text, jacobian, other, factor):
    """The part of u1 in D's velocity, or of q1 in its position, in one formulation."""
    right = getattr(text, jacobian)

    def wrong(chain, q, point):
        (x, y), second = right(chain, q, point)
        first = (factor * x, factor * y) if point == chain.D else (x, y)
        return kane.PartialVelocities(first, second)

    monkeypatch.setattr(text, jacobian, wrong)
    verdict = verify_contact(urdf, states=FEW, engine=engine)
    assert failed(verdict) >= IMPACT | STICKING_IMPACT | RESTING | STICKING
    others = [c for c in verdict.comparisons if (c.source, c.against) == (other, engine.name)]
    assert len(others) == len(CONTACT)
    assert all(c.passed for c in others)


def test_a_wrong_mass_matrix_is_detected(urdf, engine, monkeypatch):
    right = lagrange.mass_matrix

    def wrong(chain, q):
        (M11, M12), (M21, M22) = right(chain, q)
        return (M11, M12), (M21, M22 * (1 + 1e-9))

    monkeypatch.setattr(lagrange, "mass_matrix", wrong)
    verdict = verify_contact(urdf, states=FEW, engine=engine)
    assert failed(verdict) >= IMPACT | STICKING_IMPACT | RESTING | {"sticking contact: forces"}
    # A point held by two rows moves as they prescribe, whatever its mass.
    assert "sticking contact: motion" not in failed(verdict)


def test_a_wrong_gravity_is_detected(engine):
    """9.81 against 9.80665: impacts do not depend on gravity."""
    other = parse_planar_urdf(GENERAL.to_urdf(), gravity=(0, 0, -9.80665))
    found = failed(verify_contact(other, states=FEW, engine=engine))
    assert found == RESTING | {"sticking contact: forces", "given force on D: motion"}


class Deaf(PinocchioChain):
    """An engine that ignores the force on D and the restitution."""

    def forward_dynamics(self, angles, speeds, torques, end_force=None):
        return super().forward_dynamics(angles, speeds, torques)

    def impact(self, angles, speeds, directions, restitution):
        return super().impact(angles, speeds, directions, 0 * restitution)


class Driftless(PinocchioChain):
    """An engine that leaves out the bias, the acceleration of D due to speeds."""

    def point_motion(self, point, angles, speeds, accelerations):
        return 0 * super().point_motion(point, angles, speeds, accelerations)


def test_a_wrong_engine_is_detected(urdf):
    deaf = failed(verify_contact(urdf, states=FEW, engine=Deaf(urdf)))
    assert deaf == IMPACT | {"given force on D: motion"}
    assert failed(verify_contact(urdf, states=FEW, engine=Driftless(urdf))) == RESTING | STICKING


def test_nan_is_detected(urdf, engine, monkeypatch):
    monkeypatch.setattr(
        contact, "smooth_impulse", lambda v, *_: impacts.Impulse(v / (v - v), 0, "")
    )
    with pytest.warns(RuntimeWarning):
        assert failed(verify_contact(urdf, states=FEW, engine=engine)) == IMPACT


def test_an_infinite_acceleration_is_seen(urdf, engine, monkeypatch):
    """Its tolerance, which grows with the found value, is infinite too."""
    monkeypatch.setattr(
        kane, "forward_dynamics", lambda chain, q, u, loads: (q[0] / (q[0] - q[0]), q[1])
    )
    with pytest.warns(RuntimeWarning):
        found = failed(verify_contact(urdf, states=FEW, engine=engine))
    assert found == {"frictionless impact: speeds after", "given force on D: motion"}


# Functions that contact does not use; `verify` and the proofs look at them.
UNUSED = {
    *("inverse_dynamics", "coriolis_matrix", "_turned", "inertia_torques"),
    *("kinetic_energy", "kinetic_energies", "momenta", "momentum_rates", "energy_gradient"),
}

# A sign before a zero; see tests/verification/test_verify_can_fail.py.
EQUIVALENT = {
    ("generalized_inertia_force", "Add to Sub before omega1[1] * T_in1"),
    ("generalized_inertia_force", "Add to Sub before omega2[0] * T_in2"),
}


def unused(function: str, line: str, change: str) -> bool:
    return function in UNUSED or (function, change) in EQUIVALENT


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "jacobian", "other", "unseen"),
    [
        (kane, "partial_velocities", lagrange, 0),
        # ∂x/∂q of C1, and of C2 off its axis: weights act along y, and D is on its axis.
        (lagrange, "position_gradients", kane, 6),
    ],
    ids=["kane", "lagrange"],
)
def test_every_mutant_of_a_formulation_is_detected(urdf, engine, text, jacobian, other, unseen):
    def judge(mutant: Mutant) -> bool:
        broken = Formulation("broken", mutant.module, getattr(mutant.module, jacobian))
        verdict = verify_contact(urdf, states=FEW, formulations={"kane": broken}, engine=engine)
        return verdict.passed and agree_with_rotors(mutant.module, other)

    alive = survivors(mutants(text, unused), judge)
    assert len(alive) == unseen, alive
    assert all(" (broken).position_gradients: " in mutant for mutant in alive)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("home", "users", "functions", "equivalent"),
    [
        (constraint, (dynamics, pose_module), ("solved_with_one", "solved_with_two", "cramer"), ""),
        # 0 / v is 0 too.
        (impacts, (contact,), ("smooth_impulse",), "Mult to Div before normal_speed"),
    ],
    ids=["modes", "impacts"],
)
def test_every_mutant_of_the_solution_is_detected(
    urdf, engine, monkeypatch, home, users, functions, equivalent
):
    def skip(function: str, line: str, change: str) -> bool:
        return function not in functions or change == equivalent

    alive = []
    for mutant in mutants(home, skip):
        with monkeypatch.context() as broken, np.errstate(all="ignore"):
            for user in users:
                if hasattr(user, mutant.function):
                    broken.setattr(user, mutant.function, getattr(mutant.module, mutant.function))
            try:
                passed = verify_contact(urdf, states=FEW, engine=engine).passed
            except ZeroDivisionError:
                # A product that has become a division by an exact zero is seen at once.
                passed = False
            if passed:
                alive.append(str(mutant))
    assert alive == []


# The command


def run(*arguments: str):
    return CliRunner().invoke(app, ["verify", "--contact", *arguments])


def test_the_command_prints_a_table_and_a_sentence():
    result = run("--states", "50")
    assert result.exit_code == 0
    for words in (
        "Contact at D",
        "impulseDynamics",
        "forwardDynamics",
        "aba, fext",
        "− Lagrange",
        "Excluded: 0 of 50 poses",
        "All 27 comparisons agree at 50 states",
    ):
        assert words in result.stdout
    assert "Motion of the points" not in result.stdout


def test_the_command_writes_json_of_a_users_urdf(tmp_path):
    file, mine = tmp_path / "verdict.json", tmp_path / "mine.urdf"
    GENERAL.to_urdf(mine)
    arguments = ("--urdf", str(mine), "--states", "20", "--seed", "5", "--json", str(file))
    assert run(*arguments).exit_code == 0
    document = json.loads(file.read_text())
    assert document["passed"] is True
    assert document["seed"] == 5
    assert len(document["comparisons"]) == 27
    impact = document["comparisons"][0]
    assert set(impact["state"]) == {"angles", "speeds", "normal", "restitution"}


def test_a_disagreement_ends_with_1(monkeypatch):
    right = lagrange.mass_matrix
    monkeypatch.setattr(
        lagrange, "mass_matrix", lambda *state: tuple((2 * x, 2 * y) for x, y in right(*state))
    )
    result = run("--states", "5")
    assert result.exit_code == 1
    assert "comparisons disagree" in result.stdout
    assert "sticking impact: impulses, Lagrange − Pinocchio" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--states", "0"), "--states must be a positive whole number; got 0"),
        (("--urdf", "nowhere.urdf"), "there is no file of this name"),
    ],
)
def test_bad_input_ends_with_2(arguments, words):
    result = run(*arguments)
    assert result.exit_code == 2
    assert words in result.stderr
