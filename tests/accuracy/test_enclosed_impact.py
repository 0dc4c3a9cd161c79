"""The enclosed impact of all motions near one: law, derivatives, and the time it happens."""

import itertools
import random
from dataclasses import replace

import flint
import numpy as np
import pytest
from flint import arb

from twolink import kane
from twolink.accuracy import enclosed_run
from twolink.accuracy.certain import UndecidedError
from twolink.accuracy.defect_bound import Passage, Step
from twolink.accuracy.enclosed_impact import _Law, collision, rebound
from twolink.accuracy.frames import Frame
from twolink.accuracy.gap_bound import Bracket, GapBound, bracket
from twolink.chain import Chain
from twolink.contact.coordinates import JointCoordinate, PointCoordinate
from twolink.contact.elements import RigidContact
from twolink.contact.impact_laws import LAWS
from twolink.effects.gravity import Gravity
from twolink.effects.joint_stop import JointStop
from twolink.scene import Scene
from twolink.simulation.motion import motion_run

CHAIN = Chain((1.25, 0.75), (0.75, 0.5), ((0.4, 0.1), (0.3, -0.05)), (0.06, 0.03))
STATE = (0.75, 1.25, 0.5, 1.5)


def floor(point="D", law="stronge", friction=0.25, restitution=0.5):
    along = PointCoordinate(point, (1.0, 0.0))
    normal = PointCoordinate(point, (0.0, -1.0))
    return RigidContact(
        "floor", normal, -1.0, restitution, along if friction else None, friction, friction, law
    )


CONTACTS = {
    **{law: floor(law=law) for law in LAWS},
    "rough": floor(friction=2.0),
    "smooth": floor(friction=0.0),
    "guided": floor("B"),
    "guided by newton": floor("B", "newton"),
    "stop": RigidContact("stop", JointCoordinate("B", -1), -0.5, 0.5),
}


@pytest.mark.parametrize("contact", CONTACTS.values(), ids=CONTACTS)
def test_an_impact_obeys_the_laws_of_mechanics(contact):
    """Impulse and momentum by Kane's equations; Coulomb's law; no gain of energy (but Newton's)."""
    q, u = STATE[:2], STATE[2:]
    found = collision(CHAIN, contact, q, u)
    v, w = found.normal_speed
    assert v < 0 < w
    row = kane.generalized_active_force(CHAIN, q, contact.normal.unit_loads(CHAIN))
    rows = np.array([row])
    impulses = [found.impulse.normal]
    if contact.tangent is not None:
        rows = np.array(
            [row, kane.generalized_active_force(CHAIN, q, contact.tangent.unit_loads(CHAIN))]
        )
        impulses.append(found.impulse.tangential)
        most = contact.kinetic * found.impulse.normal
        assert abs(found.impulse.tangential) <= most * (1 + 1e-12)
    change = np.array(kane.mass_matrix(CHAIN, q)) @ (np.array(found.u) - u)
    assert change == pytest.approx(rows.T @ impulses, abs=1e-12)
    before, after = found.kinetic_energy
    assert after <= before or contact.law.startswith("newton")


@pytest.mark.parametrize("contact", CONTACTS.values(), ids=CONTACTS)
def test_slopes_are_derivatives_of_the_numbers(contact):
    law = _Law(CHAIN.convert(arb), contact)
    slopes = law.slopes([arb(x) for x in STATE])

    def numbers(state):
        return np.array([float(x) for x in law.numbers([arb(float(x)) for x in state])])

    for by in range(4):
        step = 1e-6 * np.eye(4)[by]
        difference = (numbers(STATE + step) - numbers(STATE - step)) / 2e-6
        assert [float(row[by]) for row in slopes] == pytest.approx(difference, abs=1e-7)


def test_the_branch_of_the_law_is_the_same_for_all_states():
    """A slide that may or may not stop in the impact leaves the law open."""
    law = _Law(CHAIN.convert(arb), floor(friction=0.5))
    narrow = [arb(x) for x in STATE]
    assert (
        law.regime(narrow) == collision(CHAIN, floor(friction=0.5), STATE[:2], STATE[2:])[3].regime
    )
    with pytest.raises(UndecidedError):
        law.regime([*narrow[:2], arb(0.5, 2), arb(1.5, 2)])


def test_a_contact_that_opens_has_no_impact():
    with pytest.raises(UndecidedError, match="approach to floor is too slow"):
        _Law(CHAIN.convert(arb), floor()).numbers([arb(x) for x in (0.75, 1.25, -0.5, -1.5)])


STOP = JointStop("B", lower=-2.0, upper=0.5 + 1 / 64, restitution=0.5)
TUBE = arb(2.0**-10)


def struck(scene, error, displaced=0.0):
    """Return the enclosed impact of all motions near a scene, and the middle of its bracket (s)."""
    (contact,) = [c for c in STOP.contact_elements(CHAIN) if "upper" in c.name]
    with enclosed_run.balls(flint, 120, 60):
        motion = enclosed_run.precise_motion(scene, "momenta", 30)
        polynomials, length, _ = enclosed_run.approximation(
            flint, motion, 0.02, arb(0), motion.longest_step
        )
        chain = scene.moving_chain.convert(arb)
        step = Step(flint, chain, scene.effects, polynomials, arb(0), length, 120, 60)
        frame = Frame.around(flint, [arb(error)] * 4)
        known = GapBound.of(step, contact, frame, step.after(frame, TUBE).errors)
        short = bracket(step, known, known.first_crossing(length, 60), frame, TUBE)
        if displaced:
            middle = (short.middle + displaced).mid()
            start, end = ((middle + 2 * side * abs(displaced)).mid() for side in (-1, 1))
            here = step.after(frame, TUBE, middle).frame
            errors = step.after(frame, TUBE, end).errors
            short = Bracket(start, middle, end, Passage(here, errors))
        return rebound(step, contact, short), float(short.middle)


def followed(scene, until, middle):
    """Return the impact log of a scene, and its state after the impact, followed to another time.

    It is followed along the motion without the stop.
    """
    run = motion_run(scene, np.array([0.0, until]), formulation="kane", precision="quadruple")
    free = replace(
        scene,
        q=tuple(float(x) for x in run.q[:, -1]),
        u=tuple(-float(x) for x in run.u[:, -1]),
        effects=(Gravity(),),
    )
    times = np.array([0.0, until - middle])
    back = motion_run(free, times, formulation="kane", precision="quadruple")
    (impact,) = run.impacts
    return impact, np.array([*back.q[:, -1], *(-back.u[:, -1])], dtype=float)


def a_strike(seed):
    numbers = random.Random(seed)
    return Scene(
        CHAIN, (0.3, 0.8), (numbers.uniform(-1, 1), numbers.uniform(3, 5)), 0.02, (Gravity(), STOP)
    )


@pytest.mark.slow_but_first
@pytest.mark.parametrize("seed", range(3))
def test_all_motions_of_a_frame_are_in_the_frame_after_the_impact(seed):
    """Motions that start with an error are followed through the impact by the simulator."""
    scene, error = a_strike(seed), 1e-7
    found, middle = struck(scene, error)
    assert found.opens
    bounds, centre = ([float(x) for x in y] for y in (found.frame.bounds(), found.state))
    reached = np.zeros(4)
    for signs in itertools.product((-1, 1), repeat=4):
        moved = [x + s * error for x, s in zip((*scene.q, *scene.u), signs, strict=True)]
        other = replace(scene, q=tuple(moved[:2]), u=tuple(moved[2:]))
        # Just after the impacts of all.
        impact, state = followed(other, middle + 4e-7, middle)
        off = np.abs(state - centre)
        assert np.all(off <= np.array(bounds) * (1 + 1e-6) + 1e-13)
        reached = np.maximum(reached, off)
        pairs = [
            (found.impact.time, impact.time),
            (found.impact.normal_impulse, impact.normal_impulse),
            *zip(found.impact.u_before, impact.u[0], strict=True),
            *zip(found.impact.u_after, impact.u[1], strict=True),
            *zip(found.impact.normal_speed, impact.speeds, strict=True),
            *zip(found.impact.kinetic_energy, impact.kinetic_energy, strict=True),
        ]
        for interval, number in pairs:
            assert abs(number - float(interval.centre)) <= float(interval.radius) + 1e-13
    # The bounds are tight.
    assert np.all(reached > 0.25 * np.array(bounds))


@pytest.mark.parametrize("displaced", [1e-6, -1e-6])
def test_the_enclosure_holds_if_the_impact_is_not_at_the_middle_of_its_bracket(displaced):
    scene = a_strike(0)
    found, middle = struck(scene, 1e-16, displaced)
    impact, state = followed(scene, middle + 4e-6, middle)
    bounds, centre = ([float(x) for x in y] for y in (found.frame.bounds(), found.state))
    widths = [float(x.rad()) for x in found.state]
    assert np.all(np.abs(state - centre) <= np.array(bounds) + widths + 1e-13)
    assert max(widths) < 1e-8
    time, radius = (float(x) for x in found.impact.time)
    assert abs(impact.time - time) <= radius + 1e-14
    assert radius < 1e-10


def test_the_numbers_of_an_impact_have_units_and_json():
    scene = Scene.load("drop")
    with_stop = replace(
        scene, effects=(Gravity(), JointStop("B", lower=-0.5, restitution=0.5)), duration=0.5
    )
    for given, unit in ((replace(scene, duration=0.5), "m"), (with_stop, "rad")):
        run = enclosed_run.proven_run(given, (0.4375,), 20, 1e-9, lambda share: None)
        (impact,) = run.impacts
        assert impact.unit == unit
        document = impact.document()
        assert document["time"] == impact.time._asdict()
        assert document["u_after"][1]["radius"] == impact.u_after[1].radius
        assert impact.radius >= float(impact.kinetic_energy[1].radius)
