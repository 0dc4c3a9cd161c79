"""The log of impacts: energies by hand, in floats, from numbers of any precision."""

import pytest

from tests.simulation.hybrid import BALANCED
from twolink.contact.impact_laws import Impulse, Regime
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.hybrid.impact import Strike
from twolink.simulation.hybrid.impact_log import impact_log


def strike_of(number, kind):
    def pair(a, b):
        return kind(a), kind(b)

    return Strike(
        time=0.25 * number, number=number, name=f"stop {number}", q=pair(0.3, 0.7),
        u=(pair(2.0, -1.0), pair(0.5, 3.0)), speeds=pair(-2.0, 1.0), sliding=pair(0.25, 0.5),
        impulse=Impulse(kind(4.0), kind(-1.5), Regime.SLIDES),
    )  # fmt: skip


@pytest.mark.parametrize("precision", PRECISIONS)
def test_the_log_has_all_of_an_impact_in_floats(precision):
    """T = 3 u1²/2 + u2²/4; link 2 has its mass at B, so 1/2 · 1 kg · u1² of it are translation."""
    kind = PRECISIONS[precision].number
    log = impact_log(BALANCED.convert(kind), [strike_of(0, kind), strike_of(3, kind)], precision)
    assert [impact.index for impact in log] == [0, 3]
    impact = log[1]
    assert impact.time == 0.75
    assert impact.name == "stop 3"
    assert impact.speeds == (-2.0, 1.0)
    assert impact.sliding == (0.25, 0.5)
    assert (impact.normal_impulse, impact.tangential_impulse) == (4.0, -1.5)
    assert impact.regime == "slides"
    assert impact.u == ((2.0, -1.0), (0.5, 3.0))
    assert impact.kinetic_energy == (6.25, 0.375 + 2.25)
    # Link 1: 2 u1²/2; link 2: 1 u1²/2 + 0.5 u2²/2.
    assert impact.link_energies == ((4.0, 2.25), (0.25, 2.375))
    numbers = [*impact.speeds, impact.normal_impulse, *impact.kinetic_energy, *impact.u[0]]
    assert {type(number) for number in numbers} == {float}


def test_a_run_without_impacts_has_an_empty_log():
    assert impact_log(BALANCED, [], "double") == ()
