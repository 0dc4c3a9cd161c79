"""The catalogue has every kind of case, each with a full description."""

import pytest

from twolink.errors import ParameterError
from twolink.hardcases.catalogue import CASES, case_named, explained
from twolink.hardcases.record import GROUPS

ASKED_FOR = {
    "evaluation": "heavy-second-link light-second-link long-second-link short-second-link "
    "massless-second-link point-masses aligned folded nearly-aligned nearly-folded angles-of-1e8 "
    "speeds-of-1e6 denormal-state tiny-chain huge-chain centre-off-the-axis centre-beyond-the-end",
    "smooth": "natural-start upright-rest upright-by-a-picoradian chaos-100-s "
    "small-oscillation-1e6-s separatrix spin-1e5 beats zero-gravity-1e5-s stiff-spring-1e10 "
    "strong-damping-creep strong-damping-at-once discontinuous-torque coarsely-sampled-torque",
    "friction": "stick-at-0.999 loose-at-1.001 loose-within-a-microsecond "
    "reversal-as-a-stop-is-hit two-stops-at-once stop-at-no-speed",
    "contact": "restitution-0 restitution-1 bounces-1e4 zeno grazing slide-ends-with-compression "
    "elbow-and-tip-at-once painleve compliant-1e12 on-the-surface-at-rest on-the-surface-leaving "
    "newtons-gain",
    "input": "nan-angle infinite-angle nan-mass negative-mass no-mass mass-beyond-float64 "
    "no-number-in-any-effect urdf-empty urdf-truncated urdf-deep urdf-entities urdf-100-mb "
    "scene-truncated scene-nested scene-100-mb scene-paths",
}


def test_every_kind_of_case_is_present():
    for group in GROUPS:
        names = {case.name for case in CASES if case.group == group}
        assert set(ASKED_FOR[group].split()) <= names


def test_names_are_words_of_their_own():
    names = [case.name for case in CASES]
    assert len(set(names)) == len(names)
    assert all(name == name.lower() and " " not in name for name in names)
    assert {case.group for case in CASES} == set(GROUPS)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_case_is_fully_described(case):
    for text in (case.hard, case.expected, case.reference, case.bound):
        assert text.strip() == text
        assert text
        assert not text.endswith(".")
        assert "\n" not in text
    page = explained(case)
    assert page.startswith(f"# {case.name}\n")
    assert "***" not in page
    for heading in ("**Difficulty.**", "**Expected.**", "**Reference.**", "**Bound.**"):
        assert page.count(heading) == 1
    assert case.hard[1:] in page
    assert case.bound[1:] in page


def test_an_unknown_case_is_rejected():
    assert case_named("zeno").group == "contact"
    with pytest.raises(ParameterError, match=r"case must be one of zeno, zeno-slow\b.*; got 'zen'"):
        case_named("zen")
    with pytest.raises(ParameterError, match="case must be one of heavy-second-link, "):
        case_named("xyz")
