"""The report's scoreboard: marks, verdict and failures."""

import re

import pytest
from typer.testing import CliRunner

from tests.viz.report.test_page import read
from twolink.cli import app
from twolink.data import data_path
from twolink.engines.marks import Mark
from twolink.hardcases import Case, Column, Outcome, catalogue, run
from twolink.viz.report.page import page
from twolink.viz.report.scoreboard import hard_cases

COLUMNS = (Column("kane"), Column("A < B"))


def case(name):
    return Case(name, "smooth", f"{name} is hard", "this", "here", "so", trial=None)


def board(ours):
    """Return every mark of another engine, beside one of ours."""
    return {
        mark.name.lower(): {
            "kane": Outcome(ours),
            "A < B": Outcome(mark, 2.5 if mark is Mark.MISSED else None, said=f"said {mark.value}"),
        }
        for mark in Mark
    }


def section(ours=Mark.PASS):
    found = board(ours)
    return hard_cases([case(name) for name in found], COLUMNS, found)


def test_each_mark_is_shown_and_explained():
    body = section().body
    for words in ("pass", "× 2.50", "silent", "refused", "crash", "hang", "–"):
        assert f">{words}</span>" in body
    assert "A &lt; B" in body
    assert "said silently wrong" in body
    # Passed and untried cases have no text.
    assert "said pass" not in body
    assert "said cannot" not in body


def test_links_lead_to_the_description_of_a_case():
    reader = read(page("title", "", [section()]))
    inside = [address[1:] for address in reader.addresses if address.startswith("#")]
    assert set(inside) <= set(reader.ids)
    assert "case-silent" in reader.ids


def test_the_verdict_is_about_this_library():
    assert f"passes {len(Mark)} hard cases of {len(Mark)}, with kane" in section().body
    assert 'class="verdict bad"' in section(Mark.SILENT).body


@pytest.mark.slow
def test_a_full_report_has_the_hard_cases(tmp_path, monkeypatch):
    chosen = tuple(catalogue.case_named(name) for name in ("aligned", "zeno"))
    monkeypatch.setattr(catalogue, "CASES", chosen)
    monkeypatch.setattr(run, "columns", lambda: run.OURS)
    scene = str(data_path("scenes") / "slide_and_stop.toml")
    arguments = ["report", scene, "--states", "50", "--full", "--out", str(tmp_path)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    passes = "This library passes 2 hard cases of 2, with momenta, lagrange, kane."
    assert passes in result.output
    document = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert passes in document
    assert len(re.findall(r'<details id="case-', document)) == 2
