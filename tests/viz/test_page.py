import json
import re
import struct
import zlib
from base64 import b64decode
from dataclasses import replace

import pytest

from tests.viz.films import film_of, scene_named
from twolink.simulation import simulate
from twolink.viz.film import Film
from twolink.viz.page import archive, frame_message, licences, player_body, player_head, player_page
from twolink.viz.run import Run
from twolink.viz.themes import DARK, LIGHT


def unpacked(message):
    """A message as the player decodes it: its JSON, and the commands behind it."""
    (length,) = struct.unpack("<I", message[:4])
    return json.loads(message[4 : 4 + length]), message[4 + length :]


def test_an_archive_holds_every_frame_in_order():
    film = film_of("drop", 1.0)
    reports = []
    head, rest = unpacked(archive(film, progress=reports.append))
    assert head["about"] == json.loads(json.dumps(film.about))
    assert len(head["frames"]) == len(film.times) == 31
    lengths = [*head["setup"], *(n for frame in head["frames"] for n in frame["commands"])]
    assert sum(lengths) == len(rest)
    commands = [*film.setup, *(c for k in range(31) for c in film.frame(k).commands)]
    assert rest == b"".join(commands)
    assert [frame["words"]["t"] for frame in head["frames"]][-1] == 1.0
    assert reports[-1] == 1.0
    assert reports == sorted(reports)


def test_a_page_is_one_file_without_references_to_others():
    page = player_page(film_of("free_fall", 2.0))
    outside = re.sub(r"<!--.*?-->|<script>.*?</script>", "", page, flags=re.DOTALL)
    # Addresses: the empty icon, without which a browser asks for one, and the stills.
    icon, stills = re.findall(r'(?:src|href|url)\s*=\s*"([^"]*)"', outside)
    assert icon == "data:,"
    assert stills.startswith("data:image/svg+xml;base64,")
    assert "http" not in outside
    assert page.count("<script") == page.count("</script>") == 3


@pytest.mark.slow
def test_ten_seconds_are_a_page_of_a_megabyte():
    assert len(player_page(film_of("free_fall", 10.0)).encode()) < 1.0e6
    # A player inside another page brings its film alone.
    assert len(player_body(film_of("free_fall", 10.0)).encode()) < 0.65e6
    assert len(player_head().encode()) < 0.35e6


@pytest.mark.slow
def test_the_page_contains_the_film():
    film = film_of("drop", 1.0)
    body = player_body(film)
    packed = re.search(r'application/x-twolink-film">([^<]*)<', body)
    assert zlib.decompress(b64decode(packed[1])) == archive(film)


def test_a_player_may_have_both_colour_schemes():
    film = film_of("drop", 1.0)
    head, rest = unpacked(archive(film, dark=True))
    plain, same = unpacked(archive(film))
    dark = head["about"].pop("dark")
    assert (head, rest) == (plain, same)
    assert dark["theme"]["name"] == "dark"
    assert dark["swatches"] == [DARK.end]
    assert dark["recoloured"][LIGHT.links[0]] == DARK.links[0]


@pytest.mark.slow
def test_the_viewer_comes_with_its_licences():
    page = player_page(film_of("drop", 1.0))
    assert "Robin Deits" in page
    assert "Three.js Authors" in licences()
    comment = page[page.index("<!--") : page.index("-->")]
    assert "MIT" in comment


@pytest.mark.slow
def test_equal_films_are_equal_pages():
    assert player_page(film_of("drop", 1.0)) == player_page(film_of("drop", 1.0))


@pytest.mark.slow
def test_titles_cannot_break_out_of_the_page():
    title = "</script><script>alert(1)</script>"
    film = Film((Run("x", simulate(replace(scene_named("drop", 0.2), title=title))),))
    page = player_page(film)
    assert "<script>alert" not in page
    assert page.count("<script") == 3


def test_a_frame_message_has_the_frame_and_the_state_of_the_player():
    film = film_of("drop", 1.0)
    head, rest = unpacked(frame_message(film.frame(3), {"playing": True}))
    assert head["state"] == {"playing": True}
    assert head["words"] == film.frame(3).words
    assert rest == b"".join(film.frame(3).commands)
