"""Instances of an FMU: the order of its states, steps, and FMUs that do not go on."""

import pytest

from tests.engines.fmus import DESCRIPTION, SOURCE, built
from twolink.engines.fmu_file import STATES, read_fmu
from twolink.engines.fmu_instance import exchange, simulation
from twolink.errors import EngineError

pytestmark = pytest.mark.engines

BARS = {
    "mass1": 1.0,
    "mass2": 1.0,
    "length1": 1.0,
    "length2": 1.0,
    "centre_along1": 0.5,
    "centre_along2": 0.5,
    "inertia1": 1 / 12,
    "inertia2": 1 / 12,
    "gravity": 9.81,
}
STATE = (0.3, -0.7, 0.1, 0.2)


def unpacked(folder, source=SOURCE, description=DESCRIPTION, *, fmi3=False):
    from fmpy import extract

    file = read_fmu(built(folder, source, description, fmi3=fmi3))
    return file, extract(file.path, folder / "unpacked")


@pytest.mark.parametrize("fmi3", [False, True])
def test_rates_are_in_the_order_of_the_states(tmp_path, fmi3):
    """The end of a horizontal chain falls faster than freely."""
    with exchange(*unpacked(tmp_path, fmi3=fmi3), BARS) as instance:
        instance.go_to((0.0, 0.0, 0.1, 0.2))
        rates = instance.rates()
        assert rates[:2] == (0.1, 0.2)
        assert instance.get(["angle1", "speed2", "der(speed1)"]) == [0.0, 0.2, rates[2]]
        instance.go_to((0.0, 0.0, 0.0, 0.0))
        assert instance.rates()[2] == pytest.approx(9.81 * 9 / 7)


@pytest.mark.parametrize("fmi3", [False, True])
def test_a_communication_step_advances_the_state(tmp_path, fmi3):
    values = BARS | dict(zip(STATES, STATE, strict=True))
    with simulation(*unpacked(tmp_path, fmi3=fmi3), values, 1e-12) as instance:
        assert tuple(instance.get(STATES)) == STATE
        instance.step(0.0, 1e-6)
        angle, _, speed, _ = instance.get(STATES)
        assert angle == pytest.approx(0.3 + 1e-6 * speed, abs=1e-10)
        assert speed != STATE[2]


def test_discrete_states_that_do_not_settle_are_refused(tmp_path):
    old = "memset(events, 0, sizeof *events);"
    assert old in SOURCE
    file, folder = unpacked(tmp_path, SOURCE.replace(old, f"{old} events->needed = 1;"))
    with (
        pytest.raises(EngineError, match="discrete states must settle"),
        exchange(file, folder, BARS),
    ):
        pass


def test_a_failed_step_raises_an_error(tmp_path):
    old = "    (void)time, (void)no_set;\n"
    assert old in SOURCE
    file, folder = unpacked(
        tmp_path, SOURCE.replace(old, f"{old}    if (time > 0) return ERROR;\n")
    )
    with simulation(file, folder, BARS, 1e-12) as instance:
        instance.step(0.0, 0.1)
        with pytest.raises(Exception, match="fmi2DoStep failed with status 3"):
            instance.step(0.1, 0.1)


def test_a_step_that_ends_early_is_refused(tmp_path):
    """FMI 3.0 returns it, without a status of failure."""
    file, folder = unpacked(tmp_path, f"#define EARLY true\n{SOURCE}", fmi3=True)
    with (
        simulation(file, folder, BARS, 1e-12) as instance,
        pytest.raises(EngineError, match=r"at 1 s ends early, at 1\.25 s"),
    ):
        instance.step(1.0, 0.5)
