"""The check of a site's accessibility finds a fault on any page, at any width."""

import pytest

from tests.docs.accessible import inaccessible
from tests.docs.transcript import ROOT
from tests.viz.accessibility import need_axe
from tests.viz.films import need_browser

# Enough for axe-core to have something to check.
GOOD = (
    '<!doctype html><html lang="en"><head><title>t</title><meta name="viewport" '
    'content="width=device-width"></head><body><main><h1>a</h1><p>b</p><ul><li><a href="#c">d</a>'
    '</li></ul><table><thead><tr><th scope="col">e</th></tr></thead><tr><td>f</td></tr></table>'
    '<img alt="g" src="data:,"><button>h</button></main></body></html>'
)


@pytest.mark.slow
def test_faults_are_found_and_a_good_page_has_none(tmp_path):
    need_browser()
    need_axe()
    (tmp_path / "good.html").write_text(GOOD, encoding="utf-8")
    (tmp_path / "wide.html").write_text(
        GOOD.replace("<p>b</p>", '<p style="width:800px">b</p>'), encoding="utf-8"
    )
    (tmp_path / "mute.html").write_text(GOOD.replace('alt="g" ', ""), encoding="utf-8")
    first, second = inaccessible(tmp_path)
    assert first.startswith("mute.html: image-alt: ")
    assert second == "wide.html: it is wider than its window"


def test_the_check_is_part_of_the_whole_build():
    assert "tests.docs.accessible" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")
