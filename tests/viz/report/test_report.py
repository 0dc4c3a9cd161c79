import re

import pytest
from typer.testing import CliRunner

from tests.viz.films import need_browser
from tests.viz.report.test_page import read
from twolink.cli import app
from twolink.data import data_path
from viz.browser import Browser

SCENES = data_path("scenes")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site") / "report"
    arguments = ["report", str(SCENES / "drop.toml"), "--states", "200", "--out", str(folder)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    return result.stdout, folder


@pytest.mark.slow
def test_it_is_one_page_of_less_than_5_megabytes(made):
    output, folder = made
    assert [file.name for file in folder.iterdir()] == ["index.html"]
    assert (folder / "index.html").stat().st_size < 5_000_000
    assert output.splitlines()[0].startswith("All 60 comparisons agree at 200 states")


def test_it_has_all_sections(made):
    document = (made[1] / "index.html").read_text(encoding="utf-8")
    for words in (
        "All 60 comparisons agree at 200 states",
        "computeGeneralizedGravity",
        "The drop onto a floor",
        "impact",
        "without Surface",
        "Recommended: taylor on ",
        "twolink-player",
        "Pinocchio 4",
    ):
        assert words in document, words


def test_nothing_in_it_is_fetched(made):
    document = (made[1] / "index.html").read_text(encoding="utf-8")
    reader = read(re.sub(r"<script.*?</script>", "", document, flags=re.DOTALL))
    for address in reader.addresses:
        assert address.startswith(("#", "data:")), address[:80]


@pytest.mark.slow
def test_a_disagreement_exits_with_1_and_is_on_the_page(tmp_path, monkeypatch):
    from twolink import lagrange

    right = lagrange.kinetic_energy
    monkeypatch.setattr(lagrange, "kinetic_energy", lambda *state: right(*state) * 1.001)
    arguments = ["report", str(SCENES / "general.toml"), "--states", "50", "--out", str(tmp_path)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 1
    assert "disagree" in result.output
    document = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert '<p class="verdict bad">' in document
    assert "✗" in document


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["nowhere.toml"], "nowhere.toml"),
        (["--states", "0"], "--states must be a positive whole number; got 0"),
        (
            ["--out", "README.md"],
            "--out must be a folder that can be written to or made; got README.md",
        ),
    ],
)
def test_bad_input_is_one_sentence_and_nothing_is_written(arguments, sentence, tmp_path):
    target = [] if "--out" in arguments else ["--out", str(tmp_path / "report")]
    result = CliRunner().invoke(app, ["report", *arguments, *target])
    assert result.exit_code == 2
    assert sentence in result.output
    assert not (tmp_path / "report").exists()


@pytest.mark.slow
@pytest.mark.parametrize("width", [390, 1280])
def test_a_browser_opens_it_without_a_word_or_a_request(made, width):
    need_browser()
    address = (made[1] / "index.html").as_uri()
    with Browser() as browser:
        page = browser.page(width, 900)
        page.open(address)
        page.value("document.querySelector('.twolink-player button').click()")
        page.wait_until("performance.now() > 1500")
        assert page.complaints() == []
        asked = [event["request"]["url"] for event in page.events("Network.requestWillBeSent")]
        assert [url for url in asked if not url.startswith(("data:", "blob:"))] == [address]
        # Wide tables scroll inside themselves, and the page does not.
        assert page.value("document.documentElement.scrollWidth") <= width
