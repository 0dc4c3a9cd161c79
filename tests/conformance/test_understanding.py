"""The parameters that an engine reports, compared with those of the model."""

import pytest

from twolink.conformance.understanding import misunderstood
from twolink.engines.messages import Understood

EXPECTED = Understood(
    mass=(1.0, 2.0),
    reach=(0.5, 0.4),
    inertia=(0.1, 0.2),
    damping=(0.3, 0.0),
    friction=(0.0, 0.0),
    limits=((-1.0, 1.0), None),
)


def test_right_or_absent_descriptions_have_no_findings():
    assert misunderstood(EXPECTED, EXPECTED, "binary64") == ()
    assert misunderstood(Understood(), EXPECTED, "binary64") == ()
    assert misunderstood(None, EXPECTED, "binary64") == ()
    assert misunderstood(EXPECTED, None, "binary64") == ()


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"mass": (1.0, 1.5)}, "mass of link 2 must be 2 kg; it understood 1.5"),
        ({"inertia": (0.1, 0.3)}, "inertia of link 2 must be 0.2 kg m²; it understood 0.3"),
        ({"damping": (0.0, 0.0)}, "damping of joint 1 must be 0.3 N m s/rad; it understood 0"),
        ({"reach": (float("nan"), 0.4)}, "reach of link 1 must be 0.5 m; it understood nan"),
        (
            {"limits": (None, None)},
            "limits of joint 1 must be (-1.0, 1.0) rad; it understood None",
        ),
    ],
)
def test_each_difference_is_a_sentence(changes, sentence):
    told = EXPECTED.model_copy(update=changes)
    assert misunderstood(told, EXPECTED, "binary64") == (sentence,)


def test_rounding_is_allowed_by_precision():
    told = EXPECTED.model_copy(update={"mass": (1.0, 2.0 + 1e-6)})
    assert misunderstood(told, EXPECTED, "binary64")
    assert not misunderstood(told, EXPECTED, "binary32")
