"""Tables fit a width without a cut number, and are well-formed HTML."""

import xml.etree.ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st

from twolink.cli.terminal import _page, print_table
from twolink.tables import Cell, Column, Tone, as_html, length, table

EXAMPLE = table(
    "Errors",
    (
        Column("configuration", wraps=12),
        Column("time", number=True),
        Column("least error", number=True),
        Column("failed settings", number=True, spare=1),
        Column("order", number=True, spare=2),
    ),
    [
        ("taylor, long double on momenta", "5.63 ms", "1.2e-14", "0", "23"),
        ("rk4 on <momenta>", Cell("not reached", Tone.WARN), "-6.0e-117", "12", "4"),
    ],
)


def printed(found, width, split=False):
    page = _page(width=width)
    with page.capture() as capture:
        print_table(page, found, split=split)
    return capture.get()


@pytest.mark.parametrize("width", [200, 80, 60, 50, 40, 30, 10])
def test_numbers_are_never_cut(width):
    text = printed(EXAMPLE, width)
    for number in ("5.63 ms", "1.2e-14", "-6.0e-117", "not reached"):
        assert number in text
    assert "…" not in text
    shown = EXAMPLE.within(width)
    for line in text.splitlines():
        assert length(line.rstrip()) <= max(width, shown.least_width)


def test_spare_columns_are_omitted_in_order():
    names = [[c.name for c in EXAMPLE.within(width).columns] for width in (200, 55, 45)]
    assert [len(each) for each in names] == [5, 4, 3]
    assert "order" not in names[1]
    assert "failed settings" not in names[2]


def test_text_wraps_between_words():
    text = printed(EXAMPLE, 50)
    words = text.split()
    for word in ["taylor,", "long", "double", "on", "momenta"]:
        assert word in words


def test_a_wide_table_is_split_with_all_columns():
    heads = [f"engine{n}" for n in range(20)]
    wide = table("Board", ["case", *heads], [["one", *["pass"] * 20], ["two", *["x"] * 20]])
    text = printed(wide, 60, split=True)
    assert all(head in text.split() for head in heads)
    assert max(length(line.rstrip()) for line in text.splitlines()) <= 60
    assert text.count("one") == len(wide.parts(60)) > 1


def test_html_has_scopes_a_caption_and_no_markup_of_the_data():
    page = ET.fromstring(EXAMPLE.html("board"))
    assert page.find("caption").text == "Errors"
    assert [head.get("scope") for head in page.iter("th")] == ["col"] * 5 + ["row"] * 2
    assert [span.get("class") for span in page.iter("span")] == ["whole", "warn", "whole"]
    assert "rk4 on <momenta>" in "".join(page.itertext())


def test_a_number_with_a_negative_exponent_is_whole_in_html():
    assert as_html("a < 2.4e-08 m/s") == 'a &lt; <span class="whole">2.4e-08</span> m/s'
    assert as_html("the-drop, 1e+06, 2-3") == "the-drop, 1e+06, 2-3"


def test_a_column_without_a_name_has_no_empty_heading():
    found = table("Counts", ("", "pass"), [["ours", "1"]]).html()
    assert '<thead><tr><td></td><th scope="col">pass</th></tr></thead>' in found


@pytest.mark.slow
@given(
    st.lists(st.lists(st.text(max_size=9), min_size=3, max_size=3), max_size=4), st.integers(5, 90)
)
def test_any_text_in_any_width(rows, width):
    found = table("title", ("a", Column("b", spare=1), Column("c", wraps=4)), rows)
    assert "\x1b" not in printed(found, width)
    within = found.within(width)
    assert len(within.columns) in (2, 3)
    assert all(wide >= 0 for wide in within.widths(width))
