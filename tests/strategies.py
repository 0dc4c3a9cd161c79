"""Strategies of hypothesis: chains of every proportion, general states, effects and scenes."""

from dataclasses import dataclass

from hypothesis import strategies as st

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.contact.impact_laws import LAWS
from twolink.coordinates import JointConvention
from twolink.effects import effect_class
from twolink.effects.joint_stop import JointStop
from twolink.integration.methods import METHODS
from twolink.scene import Scene


def decades(low: float, high: float) -> st.SearchStrategy[float]:
    """Positive numbers, spread evenly over the powers of ten from low to high."""
    return st.floats(low, high).map(lambda power: float(10.0**power))


def sizes(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers of both signs whose size lies between low and high: none is zero."""
    return st.floats(low, high).flatmap(lambda size: st.sampled_from([size, -size]))


@st.composite
def chains(draw: st.DrawFn, ratio: float = 6.0) -> Chain:
    """Chains with ratios of masses, lengths and inertias from 10^-ratio to 10^ratio."""
    ratios = decades(-ratio, ratio)
    mass = (1.0, draw(ratios))
    length = (1.0, draw(ratios))
    centre = tuple((L * draw(sizes(0.01, 2.0)), L * draw(sizes(0.001, 1.0))) for L in length)
    inertia = tuple(m * L * L * draw(ratios) for m, L in zip(mass, length, strict=True))
    return Chain(mass, length, centre, inertia)


@dataclass(frozen=True)
class State:
    """A state of a chain, and its loads: pairs of floats, none of them zero."""

    q: Pair
    u: Pair
    du: Pair
    force: Pair
    torque: Pair


@st.composite
def states(draw: st.DrawFn) -> State:
    """General states: nothing is zero, nothing is aligned on purpose."""

    def pair(low: float, high: float) -> Pair:
        return draw(sizes(low, high)), draw(sizes(low, high))

    return State(
        q=pair(0.001, 7.0),
        u=pair(0.01, 20.0),
        du=pair(0.01, 200.0),
        force=pair(0.01, 50.0),
        torque=pair(0.01, 50.0),
    )


# Effects and scenes. Numbers are drawn from all that float64 has, where an effect allows it.

finite = st.floats(allow_nan=False, allow_infinity=False)
size = st.floats(0, 1e300)
positive = st.floats(1e-100, 1e100)
pairs = st.tuples(finite, finite)
size_pairs = st.tuples(size, size)
shares = st.floats(0, 1)


def built(effect, /, **values):
    return st.builds(effect_class(effect), **values)


@st.composite
def with_friction(draw, effect, /, **values):
    """An effect whose static friction is above that of sliding, or not given."""
    low, high = sorted([draw(size), draw(size)])
    static = draw(st.sampled_from([None, high]))
    return draw(built(effect, friction=st.just(low), static=st.just(static), **values))


@st.composite
def joint_frictions(draw):
    of_joints = [sorted([draw(size), draw(size)]) for _ in "AB"]
    kinetic, static = zip(*of_joints, strict=True)
    return effect_class("joint_friction")(kinetic, draw(st.sampled_from([None, static])))


@st.composite
def joint_stops(draw):
    lower, upper = sorted(draw(st.lists(finite, min_size=2, max_size=2, unique=True)))
    angles = draw(st.sampled_from([(lower, None), (None, upper), (lower, upper)]))
    return JointStop(draw(st.sampled_from("AB")), *angles, restitution=draw(shares))


@st.composite
def sampled_torques(draw):
    times = sorted(draw(st.lists(st.integers(-999, 999), min_size=4, max_size=6, unique=True)))
    torques = st.tuples(*[st.floats(-1e9, 1e9)] * len(times))
    interpolation = draw(st.sampled_from(["hold", "linear", "cubic"]))
    rising = tuple(time / 7 for time in times)
    return effect_class("sampled_torque")(rising, draw(torques), draw(torques), interpolation)


EFFECT_STRATEGIES = {
    "gravity": built("gravity", g=finite, direction=st.tuples(size, positive)),
    "end_force": with_friction("end_force", normal=finite, sliding=st.sampled_from([None, 1, -1])),
    "joint_torque": built("joint_torque", torque=pairs, amplitude=pairs, phase=pairs),
    "sampled_torque": sampled_torques(),
    "joint_damping": built("joint_damping", coefficient=size_pairs),
    "joint_friction": joint_frictions(),
    "motor_inertia": built("motor_inertia", inertia=size_pairs, ratio=pairs, carried=st.booleans()),
    "joint_stop": joint_stops(),
    "surface": with_friction(
        "surface",
        point=pairs,
        normal=st.tuples(finite, positive),
        on=st.permutations(["B", "C1", "C2", "D"]).map(lambda points: tuple(points[:2])),
        restitution=shares,
        law=st.sampled_from(LAWS),
        name=st.text(),
    ),
    "compliant_surface": with_friction(
        "compliant_surface",
        point=pairs,
        normal=st.tuples(finite, positive),
        law=st.sampled_from(["kelvin-voigt", "hunt-crossley"]),
        stiffness=positive,
        loss=size,
        on=st.permutations(["B", "C1", "C2", "D"]).map(lambda points: tuple(points[:2])),
        name=st.text(),
    ),
    "joint_spring": built("joint_spring", stiffness=pairs, rest=pairs),
    "pd_control": built("pd_control", target=pairs, proportional=pairs, derivative=pairs),
    "end_drag": built("end_drag", coefficient=size),
}

any_effects = st.lists(st.one_of(*EFFECT_STRATEGIES.values()), max_size=6).map(tuple)

bars = st.builds(
    Chain.uniform_bars,
    st.tuples(st.floats(1e-30, 1e30), st.floats(1e-30, 1e30)),
    st.tuples(st.floats(1e-30, 1e30), st.floats(1e-30, 1e30)),
)


conventions = st.builds(
    JointConvention, st.tuples(st.sampled_from([1, -1]), st.sampled_from([1, -1])), pairs
)


def scenes(effects: st.SearchStrategy = any_effects) -> st.SearchStrategy[Scene]:
    """Scenes of bars and of other chains, under these effects (a strategy of tuples)."""
    return st.builds(
        Scene,
        chain=bars | chains(),
        q=pairs,
        u=pairs,
        duration=positive,
        effects=effects,
        accuracy=positive,
        method=st.sampled_from(tuple(METHODS)),
        title=st.text(),
        shows=st.text(),
        joints=st.none() | conventions,
    )
