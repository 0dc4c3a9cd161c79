import base64
import json
import re
from html.parser import HTMLParser

from matplotlib.figure import Figure

from twolink import tables
from twolink.viz.report.page import (
    Section,
    download,
    folded,
    page,
    paragraph,
    picture,
    table,
    write,
)


class Reader(HTMLParser):
    """Collects the elements that a page opens and closes, and every address in it."""

    VOID = ("meta", "link", "img", "source", "br", "wbr", "!doctype")

    def __init__(self):
        super().__init__()
        self.open, self.addresses, self.ids = [], [], []

    def handle_starttag(self, tag, attrs):
        if tag not in self.VOID:
            self.open.append(tag)
        for name, value in attrs:
            if name in ("src", "href", "srcset", "action", "data"):
                self.addresses.append(value)
            if name == "id":
                self.ids.append(value)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def read(document):
    reader = Reader()
    reader.feed(document)
    assert reader.open == []
    return reader


def figure():
    drawn = Figure(facecolor="#ffffff")
    drawn.subplots().plot([0, 1], [0, 1])
    return drawn


SECTIONS = [Section("One", picture(figure(), "a line")), Section("And two", paragraph("x < y & z"))]


def test_tags_are_closed_and_links_lead_to_sections():
    reader = read(page("title", "<p>lead</p>", SECTIONS))
    inside = [address[1:] for address in reader.addresses if address.startswith("#")]
    assert inside == [section.anchor for section in SECTIONS]
    assert set(inside) <= set(reader.ids)


def test_the_page_loads_no_other_file():
    document = page("title", "", SECTIONS)
    for address in read(document).addresses:
        assert address.startswith(("#", "data:")), address
    assert not re.search(r"url\((?!['\"]?data:)|@import", document)


def test_text_is_escaped():
    assert "<p>x &lt; y &amp; z</p>" in page("title", "", SECTIONS)
    assert "<title>a &lt; b</title>" in page("a < b", "", [])


def test_columns_of_numbers_are_set_to_the_right():
    described = tables.table("c & d", ("a", tables.Column("b", number=True)), [["x", "1"]])
    found = table(described, "board")
    assert '<th scope="row">x</th><td class="number">1</td>' in found
    assert '<th scope="col">a</th><th scope="col" class="number">b</th>' in found
    assert "<caption>c &amp; d</caption>" in found
    assert '<table class="board">' in found


def test_a_picture_follows_the_colour_scheme_of_the_reader():
    light, dark = (
        base64.b64decode(url)
        for url in re.search(
            r'srcset="data:image/svg\+xml;base64,(.*?)".* src="data:image/svg\+xml;base64,(.*?)"',
            picture(figure(), "a"),
        ).groups()[::-1]
    )
    assert b"#ffffff" in light
    assert b"#ffffff" not in dark
    assert b"#14171c" in dark


def test_a_picture_is_the_same_each_time():
    assert picture(figure(), "a") == picture(figure(), "a")


def test_the_page_is_written_atomically(tmp_path):
    write(tmp_path / "index.html", page("τ", "", []))
    assert "τ" in (tmp_path / "index.html").read_text(encoding="utf-8")
    assert [file.name for file in tmp_path.iterdir()] == ["index.html"]


def test_the_axes_of_time_are_where_the_picture_has_them():
    made = Figure()
    above, below = made.subplots(2, 1)
    above.set_xlim(0, 5)
    below.set_xlim(0, 1)
    found = picture(made, "two axes", (0.0, 5.0))
    (axes,) = json.loads(re.search(r'data-axes="(.*?)"', found)[1])
    left, right, top, bottom, start, end = axes
    assert (start, end) == (0.0, 5.0)
    assert 0 < left < right < 1
    assert 0 < top < bottom < 0.6
    assert "data-axes" not in picture(made, "no time")


def test_a_download_is_in_the_page_and_folded_text_is_printed():
    link = read(download("a.csv", "text/csv", b"t,q")).addresses
    assert link == [f"data:text/csv;base64,{base64.b64encode(b't,q').decode()}"]
    assert '<details class="print"><summary>x &lt; y</summary>' in folded("x < y", "<p>z</p>")
    assert "open" in folded("x", "y", opened=True)
