"""Whatever is given to the Python API: a value that can be hashed, or one sentence."""

import datetime
import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.effects.test_inputs_of_effects import GOOD
from twolink.chain import Chain
from twolink.effects import effect_class
from twolink.effects.gravity import Gravity
from twolink.errors import TwolinkError
from twolink.scene import Scene
from twolink.values import is_value

LEAVES = st.one_of(
    st.floats(width=32),
    st.integers(-5, 5),
    st.sampled_from([10**400, -0.0, 5e-324, 1e308, math.nan, math.inf, None, True, 1j, "", "D"]),
    st.sampled_from(
        [object(), float, b"x", np.float32(0.5), np.int64(3), np.True_, len, Gravity()]
    ),
    st.text(max_size=3),
)
JUNK = st.recursive(
    LEAVES,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3),
        st.tuples(inner, inner),
        st.tuples(st.floats(0.1, 2), st.floats(0.1, 2)),
        st.lists(st.floats(), max_size=3).map(np.array),
        st.dictionaries(st.text(max_size=1), inner, max_size=2),
        st.lists(inner, max_size=3).map(iter),
    ),
    max_leaves=6,
)
SCENE = {
    "chain": Chain.uniform_bars(),
    "q": (0.1, 0.2),
    "u": (0.0, 0.0),
    "duration": 1.0,
    "effects": (Gravity(),),
    "accuracy": 1e-9,
    "method": "taylor",
    "title": "t",
    "shows": "s",
}
CHAIN = {
    "mass": (1.0, 1.0),
    "length": (1.0, 1.0),
    "centre": ((0.5, 0.0), (0.5, 0.0)),
    "inertia": (0.1, 0.1),
    "rotors": (),
}
MAKERS = {name: (effect_class(name), fields) for name, fields in GOOD.items()}
MAKERS |= {"chain": (Chain, CHAIN), "scene": (Scene, SCENE)}


@pytest.mark.parametrize("name", MAKERS)
@settings(max_examples=60)
@given(data=st.data())
def test_anything_is_a_value_or_refused(name, data):
    maker, fields = MAKERS[name]
    changed = data.draw(st.sets(st.sampled_from(sorted(fields)), min_size=1, max_size=2))
    given_fields = {**fields, **{field: data.draw(JUNK, label=field) for field in changed}}
    try:
        made = maker(**given_fields)
    except TwolinkError as error:
        sentence = str(error)
    else:
        assert is_value(made)
        assert hash(made) == hash(made)
        return
    assert "\n" not in sentence
    assert len(sentence) < 700


ODD = [
    *[0, 1, -1, -0.0, 5e-324, 1e308, math.nan, math.inf, 10**400, 10**308, 2**70, None, True, 1j],
    *["", "D", b"x", object(), float, len, [], [1], {}, {1}, Gravity(), Decimal(1), Fraction(1, 3)],
    *[np.float32(0.5), np.longdouble(2), np.True_, np.array(2.0), np.zeros(2), np.zeros((2, 2))],
    *[np.datetime64("2020"), datetime.timedelta(1), np.array(["a", "b"])],
]


@pytest.mark.parametrize("name", MAKERS)
def test_odd_values_alone_and_in_pairs(name):
    maker, fields = MAKERS[name]
    pairs = [(odd, 0.5) for odd in ODD] + [((odd, 0.1), (0.5, 0.5)) for odd in ODD]
    for field in fields:
        for value in [*ODD, *pairs, *([odd] for odd in ODD), iter(())]:
            try:
                made = maker(**{**fields, field: value})
                # A chain of arrays is for single evaluations: it cannot be the key of a cache.
                assert name == "chain" or isinstance(hash(made), int)
            except TwolinkError as error:
                sentence = str(error)
                assert sentence.count("\n") == 0
