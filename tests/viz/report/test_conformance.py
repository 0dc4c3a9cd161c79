"""The page of the scoreboard: its parts, its links, and text of engines as text."""

from html.parser import HTMLParser

import pytest

from tests.conformance.board import RIGHT, WRONG, verdict_file
from twolink.conformance.scoreboard import read_scoreboard
from twolink.viz.report.conformance import scoreboard_page


class Targets(HTMLParser):
    def __init__(self):
        super().__init__()
        self.links, self.ids, self.tags = [], set(), []

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.tags.append(tag)
        self.ids.add(found.get("id"))
        if tag == "a":
            self.links.append(found["href"])


@pytest.fixture
def page(tmp_path):
    files = [verdict_file(tmp_path), verdict_file(tmp_path, "wrong", WRONG)]
    return scoreboard_page(read_scoreboard(files), "twolink scoreboard a.json b.json")


@pytest.mark.slow
def test_every_link_is_to_a_part_of_the_page(page):
    found = Targets()
    found.feed(page)
    assert {"#engine-1", "#engine-2", "#motions", "#settings"} <= set(found.links)
    assert {link.removeprefix("#") for link in found.links} <= found.ids


@pytest.mark.slow
def test_the_page_has_versions_marks_digits_causes_settings_and_the_proof(page):
    for words in (
        "2 engines on the vectors 2026.11",
        "twolink is the reference and no engine of this board",
        "right 1.0",
        "14.2",
        "gravity acts in the opposite direction",
        "evaluation/bars/mass-matrix",
        "cmd: wrong",
        "rk4 (step, order 4)",
        "converges to the truth: 1",
        "general: two bars under gravity, from a general state",
        "twolink scoreboard a.json b.json",
    ):
        assert words in page


@pytest.mark.slow
def test_texts_of_engines_are_escaped(page):
    assert "no &lt;b&gt;axis&lt;/b&gt;" in page
    found = Targets()
    found.feed(page)
    assert "b" not in found.tags


@pytest.mark.slow
def test_the_page_needs_no_network(page):
    assert "http" not in page.replace("http://www.w3.org", "")


def test_a_board_without_motions_has_no_part_about_them(tmp_path):
    page = scoreboard_page(read_scoreboard([verdict_file(tmp_path, "a", RIGHT[:3])]), "")
    assert 'id="motions"' not in page
    assert "1 engine on the vectors" in page
