"""What hypothesis draws: chains of every proportion, and general states of them."""

from dataclasses import dataclass

from hypothesis import strategies as st

from twolink.arithmetic import Pair
from twolink.chain import Chain


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
    """A state of a chain, and what acts on it: pairs of floats, none of them zero."""

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
