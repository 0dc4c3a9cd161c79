"""`twolink scoreboard`: the files it writes, and refusals."""

import json

import pytest
from typer.testing import CliRunner

from tests.conformance.board import WRONG, verdict_file
from tests.viz.accessibility import violations
from tests.viz.films import need_browser
from tests.viz.surroundings import surround
from twolink.cli import app
from twolink.viz.browser import Browser


def run(*words):
    return CliRunner().invoke(app, ["scoreboard", *map(str, words)])


@pytest.mark.slow
def test_a_page_and_a_document_are_written(tmp_path):
    files = [verdict_file(tmp_path), verdict_file(tmp_path, "wrong", WRONG)]
    result = run(*files, "--out", tmp_path / "board")
    assert result.exit_code == 0, result.output
    assert sorted(path.name for path in (tmp_path / "board").iterdir()) == [
        "index.html",
        "scoreboard.json",
    ]
    document = json.loads((tmp_path / "board/scoreboard.json").read_text())
    assert [entry["engine"]["name"] for entry in document["engines"]] == ["right", "wrong"]
    assert "Passed tests" in result.stdout
    assert result.stdout.endswith("index.html\n")


@pytest.mark.slow
def test_a_verdict_written_by_conform_is_read(tmp_path):
    words = ["conform", "tests.conformance.arm:Arm", "--suite", "evaluation", "--json"]
    made = CliRunner().invoke(app, [*words, str(tmp_path / "arm.json")])
    assert made.exit_code == 0, made.output
    assert run(tmp_path / "arm.json", "--out", tmp_path / "board").exit_code == 0


@pytest.mark.parametrize(
    ("second", "said"),
    [
        ({"vectors": "2025.01"}, "all verdicts must be on the same vectors"),
        ({"suites": 3}, "must be a verdict of twolink conform --json; suites"),
    ],
)
def test_bad_input_is_one_sentence_and_nothing_is_written(second, said, tmp_path):
    files = [verdict_file(tmp_path), verdict_file(tmp_path, "other", **second)]
    result = run(*files, "--out", tmp_path / "board")
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1
    assert said in result.stderr
    assert not (tmp_path / "board").exists()


def test_no_file_is_refused(tmp_path):
    assert run("--out", tmp_path / "board").exit_code == 2


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    result = run(verdict_file(tmp_path), "--out", tmp_path / "file" / "board")
    assert result.exit_code == 2
    assert "--out must be a folder" in result.stderr


@pytest.mark.slow
@pytest.mark.parametrize("width", [390, 1280])
def test_the_page_is_accessible(tmp_path, width):
    need_browser()
    files = [verdict_file(tmp_path), verdict_file(tmp_path, "wrong", WRONG)]
    assert run(*files, "--out", tmp_path / "board").exit_code == 0
    with Browser() as browser:
        page = browser.page(width, 900)
        for scheme in ("light", "dark"):
            surround(page, prefers_color_scheme=scheme)
            page.value("window.before = true")
            address = (tmp_path / "board" / "index.html").as_uri()
            page.call("Page.navigate", {"url": address})
            page.wait_until("!window.before && document.readyState === 'complete'")
            page.value(
                "document.querySelectorAll('details').forEach((each) => { each.open = true; })"
            )
            assert violations(page) == []
            assert page.value("document.documentElement.scrollWidth") <= width
