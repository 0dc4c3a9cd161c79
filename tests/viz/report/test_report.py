import re

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from tests.test_readme import CONSOLE, masked
from tests.viz.accessibility import violations
from tests.viz.films import need_browser
from tests.viz.report.test_page import read
from tests.viz.surroundings import surround, tabbed
from twolink.accuracy.study import study
from twolink.cli import app
from twolink.data import data_path
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.effects_cost import effects_cost
from twolink.viz.browser import Browser
from twolink.viz.report.sections import scene

SCENES = data_path("scenes")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site") / "report"
    arguments = ["report", str(SCENES / "drop.toml"), "--states", "200", "--out", str(folder)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    return result.stdout, folder


@pytest.mark.slow
def test_the_report_is_one_page_of_less_than_5_megabytes(made):
    output, folder = made
    assert [file.name for file in folder.iterdir()] == ["index.html"]
    assert (folder / "index.html").stat().st_size < 5_000_000
    assert output.splitlines()[0].startswith("All 60 comparisons agree at 200 states")


@pytest.mark.slow
def test_the_readme_shows_its_output(made):
    assert masked(made[0])[:-1] == masked(CONSOLE[0][1])[:-1]


@pytest.mark.slow
def test_the_report_has_all_sections(made):
    document = (made[1] / "index.html").read_text(encoding="utf-8")
    for words in (
        "All 60 comparisons agree at 200 states",
        "computeGeneralizedGravity",
        "The drop onto a floor",
        "D hits floor: normal speed",
        "without Surface",
        "Recommended: taylor on ",
        "twolink-player",
        "Pinocchio 4",
    ):
        assert words in document, words


@pytest.mark.slow
def test_every_table_has_a_caption_and_scopes(made):
    document = (made[1] / "index.html").read_text(encoding="utf-8")
    assert document.count("<table") == document.count("<caption>") > 5
    assert re.findall(r"<th(?: class=\"\w+\")?>", document) == []


@pytest.mark.slow
def test_every_option_that_it_names_is_an_option_of_report(made):
    document = (made[1] / "index.html").read_text(encoding="utf-8")
    words = re.sub(
        r"<(script|style).*?</\1>|<pre>.*?</pre>|<[^>]*>", " ", document, flags=re.DOTALL
    )
    known = {option for each in get_command(app).commands["report"].params for option in each.opts}
    named = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", words))
    assert "--full" in named
    assert named <= known


@pytest.mark.slow
def test_the_report_loads_no_other_file(made):
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
        (["--budget", "0"], "--budget must be a positive number of seconds; got 0"),
        (["--budget", "1e9"], "a measurement with this budget would take"),
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
def test_a_browser_opens_the_report_without_messages_or_requests(made, width):
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


@pytest.mark.slow
def test_verdicts_come_first_then_films_then_tables(made):
    document = (made[1] / "index.html").read_text(encoding="utf-8")
    order = [
        'class="cards"',
        "Not run for this report",
        "the free end",
        'class="twolink-player"',
        'data-axes="',
        "Cost of accuracy",
        'download="the-drop-onto-a-floor.csv"',
        'id="verification"',
        "<details",
        'download="verdict.json"',
        'id="reproduce-this-report"',
    ]
    places = [document.index(words) for words in order if words != "<details"]
    assert places == sorted(places)
    # The tables of units in the last place are folded, and so are the bounces.
    checks = document[document.index('id="verification"') :]
    assert checks.index("<details") < checks.index("mass matrix</th>")
    # A folded list has all of its entries.
    folded = re.findall(r"Show the (\d+) entries</summary>\s*<ul>(.*?)</ul>", document, re.DOTALL)
    assert folded
    for count, entries in folded:
        assert entries.count("<li>") == int(count)
    for fact in ("date", "processor", "twolink"):
        assert f'<th scope="row">{fact}</th>' in document


@pytest.mark.slow
def test_a_sweep_stopped_by_its_budget_is_reported():
    free_fall = Scene.load("free_fall")
    measured = study(free_fall, methods=("rk4",), budget=0.1)
    body = scene(simulate(free_fall), "", effects_cost(free_fall), measured).body
    assert "budget ended</td>" in body
    assert "not reached</td>" not in body
    assert "Stopped by the time budget" in body


@pytest.mark.slow
def test_curves_and_film_move_together(made):
    need_browser()
    with Browser() as browser:
        page = browser.page(1280, 900)
        page.open((made[1] / "index.html").as_uri())
        time = "Number(document.querySelector('.twolink-player').dataset.time)"
        page.value("document.querySelectorAll('button.time')[1].click()")
        assert page.value(time) == pytest.approx(0.4316, abs=0.02)
        # A click in the middle of the first curve.
        page.value(
            "(() => { const f = document.querySelector('.timed'), b = f.getBoundingClientRect();"
            "const [l, r, t, d] = JSON.parse(f.dataset.axes)[0];"
            "f.dispatchEvent(new MouseEvent('click', {bubbles: true,"
            "clientX: b.left + b.width * (l + r) / 2,"
            "clientY: b.top + b.height * (t + d) / 2})) })()"
        )
        assert page.value(time) == pytest.approx(2.5, abs=0.02)
        place = page.value("parseFloat(document.querySelector('.cursor').style.left)")
        left, right, *_ = page.value("JSON.parse(document.querySelector('.timed').dataset.axes)[0]")
        assert place == pytest.approx(50 * (left + right), abs=0.3)
        assert page.complaints() == []


def on_a_phone(browser, made):
    """Return the report as a phone shows it, with all of its parts unfolded."""
    page = browser.page(390, 844)
    page.open((made[1] / "index.html").as_uri())
    page.value("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
    return page


@pytest.mark.slow
def test_on_a_phone_every_result_is_visible(made):
    need_browser()
    with Browser() as browser:
        page = on_a_phone(browser, made)
        wide = page.value(
            "[...document.querySelectorAll('table, figure img, .twolink-player, .scrub')]"
            ".filter((each) => each.offsetParent && "
            "each.getBoundingClientRect().right > 391).map((each) => each.outerHTML.slice(0, 80))"
        )
        assert wide == []
        assert page.value("document.querySelector('.scrub').getBoundingClientRect().width") > 300


# Words of tables in more than one line, but names that are divided after a hyphen of theirs.
_DIVIDED = """(() => {
  const found = [], range = document.createRange();
  for (const cell of document.querySelectorAll("th, td, ul.log li")) {
    const walker = document.createTreeWalker(cell, NodeFilter.SHOW_TEXT);
    for (let node = walker.nextNode(); node; node = walker.nextNode()) {
      for (const word of node.data.matchAll(/\\S+/g)) {
        range.setStart(node, word.index);
        range.setEnd(node, word.index + word[0].length);
        const lines = new Set([...range.getClientRects()].map((box) => Math.round(box.top)));
        if (lines.size > 1 && !/^[a-z]+(-[a-z0-9]+)+$/.test(word[0])) found.push(word[0]);
      }
    }
  }
  return found;
})()"""


@pytest.mark.slow
def test_on_a_phone_no_word_and_no_number_of_a_table_is_divided(made):
    need_browser()
    with Browser() as browser:
        page = on_a_phone(browser, made)
        assert page.value(_DIVIDED) == []


@pytest.mark.slow
def test_the_description_of_a_curve_includes_both_sides_of_impacts(made):
    """u2 leaps from −4.6 rad/s at the first impact, between two samples."""
    document = (made[1] / "index.html").read_text(encoding="utf-8")
    low = re.search(r"u2 from −([\d.]+) to [\d.]+ rad/s\.", document)[1]
    assert float(low) > 4.5


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1280, 1920])
def test_the_report_is_accessible_and_no_wider_than_the_window(made, width, scheme):
    need_browser()
    with Browser() as browser:
        page = browser.page(width, 900)
        surround(page, prefers_color_scheme=scheme)
        page.open((made[1] / "index.html").as_uri())
        assert page.value("document.documentElement.scrollWidth") <= width
        # Folded tables are checked, too.
        page.value("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
        assert violations(page) == []
        paper = page.value("getComputedStyle(document.body).backgroundColor")
        assert paper == ("rgb(255, 255, 255)" if scheme == "light" else "rgb(20, 23, 28)")
        # Two columns where there is room.
        columns = page.value("getComputedStyle(document.querySelector('.side')).display")
        assert columns == ("grid" if width == 1920 else "block")


@pytest.mark.slow
def test_print_is_light_and_has_a_still_and_every_entry(made):
    need_browser()
    with Browser() as browser:
        page = browser.page(760, 1080)
        page.open((made[1] / "index.html").as_uri())
        surround(page, media="print", prefers_color_scheme="dark")
        page.value("dispatchEvent(new Event('beforeprint'))")
        shown = "(e => getComputedStyle(e).display)(document.querySelector('{}'))".format
        assert page.value(shown(".twolink-player .still")) == "block"
        for hidden in (".twolink-player .stage", ".twolink-player .controls", "nav", ".downloads"):
            assert page.value(shown(hidden)) == "none"
        assert page.value("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
        assert page.value("[...document.querySelectorAll('details')].every((each) => each.open)")


@pytest.mark.slow
def test_a_command_is_not_wrapped_at_its_dashes_on_a_phone(made):
    need_browser()
    with Browser() as browser:
        page = browser.page(390, 844)
        page.open((made[1] / "index.html").as_uri())
        lines = page.value("document.querySelector('.cards code').getClientRects().length")
        assert page.value("document.querySelector('.cards code').textContent") == (
            "twolink report --full"
        )
        assert lines == 1


@pytest.mark.slow
def test_the_keyboard_alone_reaches_the_verdicts_the_film_and_the_log(made):
    need_browser()
    with Browser() as browser:
        page = browser.page(1280, 900)
        page.open((made[1] / "index.html").as_uri())
        found = tabbed(page, 14)
    assert found[:2] == ["Checks", "Scenes"]
    film = found.index("motion: The drop onto a floor")
    assert found[film + 1 : film + 6] == ["play", "time", "slower", "faster", "reset view"]
    assert "time" in found[film + 6 :]
