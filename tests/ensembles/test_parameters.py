import pytest

from tests.ensembles.cases import axis, ensemble
from twolink.ensembles.parameters import SYMBOLS, keys_of, unit_of


@pytest.mark.parametrize(("symbol", "keys"), SYMBOLS.items())
def test_a_symbol_stands_for_a_number_of_a_scene(symbol, keys):
    assert keys_of(symbol) == keys_of(keys) == tuple(keys.split("."))
    by_symbol, by_keys = (
        ensemble(axes=[axis(name, 1.5)]).family.scene([1.5]) for name in (symbol, keys)
    )
    assert by_symbol == by_keys


def test_a_symbol_has_a_unit():
    units = ["rad", "rad", "rad s-1", "rad s-1", "kg", "kg", "m", "m", "m s-2"]
    assert [unit_of(symbol) for symbol in SYMBOLS] == units
    assert unit_of("chain.inertia.1") == "kg m2"
    assert unit_of("effects.joint_spring.rest.0") == ""


def test_other_names_are_keys():
    assert keys_of("effects.joint_spring.rest.0") == ("effects", "joint_spring", "rest", "0")
    assert keys_of("q3") == ("q3",)


def test_the_name_of_a_result_is_the_symbol():
    (only,) = ensemble(axes=[axis("m2", 1.0, 2.0)]).runs.axes
    assert (only.name, only.keys) == ("m2", ("chain", "mass", "1"))
