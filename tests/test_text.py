import math

import numpy as np
import pytest

from twolink.text import (
    as_sentence,
    as_vector,
    choice,
    distinct,
    distinct_names,
    either,
    name_of_source,
    one_line,
    printable,
    quoted,
    rounded,
)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("Ärger θ̇ 摆 [bold]", "Ärger θ̇ 摆 [bold]"),
        ("\x1b[31mred", "\\x1b[31mred"),
        ("a\x00b\x07c\rd\x7fe\x9bf", "a\\x00b\\x07c\\rd\\x7fe\\x9bf"),
        ("a\u202eb\u2066c\u2028d\ufeff", "a\\u202eb\\u2066c\\u2028d\\ufeff"),
        ("byte \udcff, half \ud83d", "byte \\xff, half \\ud83d"),
        ("two\nlines\tand a tab", "two\nlines\tand a tab"),
    ],
)
def test_control_characters_are_escaped(text, shown):
    assert printable(text) == shown
    assert printable(shown) == shown
    shown.encode("utf-8")


@pytest.mark.parametrize(
    ("number", "shown"),
    [(1.0, "1"), (1.2893, "1.29"), (78.49, "78.5"), (6359.0, "6,360"), (0.7561, "0.756")],
)
def test_ratios_have_three_digits(number, shown):
    assert rounded(number) == shown


@pytest.mark.parametrize(
    ("number", "shown"),
    [
        (5.0, "5"),
        (5.0000001, "5.0000001"),
        (-0.5, "-0.5"),
        (1e300, "1e+300"),
        (np.float64(2.5), "2.5"),
        (math.nextafter(5.0, 6.0), "5.000000000000001"),
        (math.nan, "nan"),
    ],
)
def test_numbers_are_told_apart(number, shown):
    assert distinct(number) == shown


@pytest.mark.parametrize(
    ("vector", "shown"),
    [
        ((1.0, -0.0, -1 / 3), "(1, 0, -0.333333)"),
        ([2e-300, 1234567.0], "(2e-300, 1.23457e+06)"),
        (iter((math.inf,)), "(inf)"),
    ],
)
def test_vectors_have_six_digits(vector, shown):
    assert as_vector(vector) == shown


@pytest.mark.parametrize(
    ("names", "form", "told_apart"),
    [
        (["a", "b"], "{} ({})", ["a", "b"]),
        (["x", "x", "x"], "{} ({})", ["x", "x (2)", "x (3)"]),
        (["x (4)", "x", "x"], "{} ({})", ["x (4)", "x", "x (2)"]),
        (["x", "x", "x", "x (2)"], "{} ({})", ["x", "x (3)", "x (4)", "x (2)"]),
        (["x 2", "x", "x", "x 2"], "{} {}", ["x 2", "x", "x 3", "x 2 2"]),
        (["{}", "{}"], "{} ({})", ["{}", "{} (2)"]),
        ([], "{} ({})", []),
    ],
)
def test_names_are_told_apart(names, form, told_apart):
    assert distinct_names(names, form) == told_apart


def test_one_line_is_one_line_and_bounded():
    assert one_line("a\nb\tc") == "a\\nb\\tc"
    long = one_line("x" * 10_000, 100)
    assert len(long) <= 100
    assert " … " in long


@pytest.mark.parametrize(
    "value", ["y" * 9999, list(range(9999)), 10**9999, {"a": "\x1b" * 500}], ids=type
)
def test_quoted_values_are_short(value):
    assert len(quoted(value)) <= 200
    assert "\x1b" not in quoted(value)


def test_integers_that_python_does_not_write_are_named():
    assert quoted(-(10**9999)) == "an integer of thousands of digits"
    assert quoted((1.5, 10**9999)) == "(1.5, an integer of thousands of digits)"


def test_an_unknown_name_is_refused_with_the_nearest_one():
    assert choice("the kind", "angels", ["angles", "phase"]) == (
        "the kind must be one of angles, phase; got 'angels' (did you mean 'angles'?)"
    )
    assert "did you mean" not in choice("the kind", "\x1b[2J", ["angles"])
    many = choice("the case", "x" * 5000, [f"case-{n}" for n in range(91)])
    assert "(91 in all)" in many
    assert len(many) < 400


def test_words_are_enumerated():
    assert either((".svg",)) == ".svg"
    assert either((".svg", ".png")) == ".svg or .png"
    assert either((".svg", ".png", ".pdf")) == ".svg, .png or .pdf"


def test_a_sentence_has_one_capital_and_one_full_stop():
    assert as_sentence("a wall, after Potra et al.") == "A wall, after Potra et al."
    assert as_sentence("a drop") == "A drop."


def test_the_name_of_a_text_is_shortened_only_if_it_is_too_long_for_a_path():
    assert name_of_source("a/long/path/" * 20) == "a/long/path/" * 20
    assert "\n" not in name_of_source("a\nb")
    assert len(name_of_source("x" * 5000)) < 210
