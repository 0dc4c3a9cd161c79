"""Whatever a file holds, it is a scene or a robot, or it is refused in one sentence, and soon.

1000 texts for each reader in CI, 50 000 for each in the nightly profile (`tests/conftest.py`).
"""

import re
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.strategies import scenes
from twolink.chain import Chain
from twolink.data import data_path
from twolink.effects import EFFECTS
from twolink.errors import TwolinkError
from twolink.scene import Scene
from twolink.urdf import parse_planar_urdf

EXAMPLES = max(1000, settings().max_examples)

# A text of this size is read in far less; a reader that takes longer hangs.
SECONDS = 5.0

TOMLS = [file.read_text(encoding="utf-8") for file in sorted(data_path("scenes").rglob("*.toml"))]
URDF = data_path("twolink.urdf").read_text(encoding="utf-8")

# Words that readers trip over, and the words of the formats themselves.
NASTY = (
    *(
        "nan",
        "inf",
        "-inf",
        "1e999",
        "-0.0",
        "5e-324",
        "1_0",
        "0x1p3",
        "9" * 400,
        "0b1",
        "1.",
        ".5",
    ),
    *(
        '""',
        "''",
        '"""',
        "'''",
        "\\",
        "\\u0000",
        "\x00",
        "\x7f",
        "\ufeff",
        "\u202e",
        "é",
        "🤖",
        "\r",
    ),
    *("[[", "]]", "[", "]", "{", "}", "{}", "[]", "=", ".", ",", "#", "\n", "\t", " ", "a.b.c"),
    *("true", "false", "1979-05-27T07:32:00Z", "07:32:00", "None", "null", "~", "${x}", "%s"),
)
TOML_WORDS = (
    *NASTY,
    *("chain", "start", "run", "effects", "mass", "length", "centre", "inertia", "urdf", "q", "u"),
    *("duration", "accuracy", "method", "title", "order", "on", "law", "joint", "friction"),
    *EFFECTS,
)
XML_WORDS = (
    *NASTY,
    *(
        "<",
        ">",
        "/>",
        "</",
        "<!--",
        "-->",
        "<![CDATA[",
        "]]>",
        "<?xml",
        "?>",
        "&lt;",
        "&#0;",
        "&x;",
    ),
    *("<!DOCTYPE x [", '<!ENTITY a "b">', "xmlns='x'", "xacro:", "<robot", "</robot>", "<link"),
    *("name=", "<joint", "type=", "continuous", "revolute", "prismatic", "floating", "planar"),
    *(
        "fixed",
        "<parent",
        "<child",
        "link=",
        "<axis",
        "xyz=",
        "rpy=",
        "<mass",
        "value=",
        "<inertia",
    ),
    *("ixx=", "<limit", "lower=", "<mimic", "<origin", "0 0 0", "1 2", "link1", "link2"),
)


@st.composite
def broken(draw, originals, words):
    """A good text with some pieces cut out, doubled, moved, or replaced by other words."""
    text = draw(st.sampled_from(originals))
    for _ in range(draw(st.integers(0, 6))):
        start = draw(st.integers(0, len(text)))
        end = min(len(text), start + draw(st.sampled_from([0, 1, 2, 5, 20, 200])))
        piece = text[start:end]
        change = draw(st.sampled_from(["cut", "double", "word", "move", "letters"]))
        if change == "double":
            text = text[:end] + piece + text[end:]
        elif change == "move":
            place = draw(st.integers(0, len(text)))
            text = text[:place] + piece + text[place:]
        elif change == "letters":
            text = text[:start] + draw(st.text(max_size=8)) + text[end:]
        else:
            word = draw(st.sampled_from(words)) if change == "word" else ""
            text = text[:start] + word + text[end:]
    return text


def soup(words):
    """Words of a format in any order."""
    return st.lists(st.sampled_from(words), max_size=60).map(" ".join)


def texts(originals, words):
    return broken(originals, words) | soup(words) | st.text(max_size=300)


def read_or_refused(read, text: str) -> object:
    """Return the parsed text, or None if it is refused as it should be."""
    begin = time.perf_counter()
    try:
        found = read(text)
    except TwolinkError as error:
        sentence = str(error)
        assert "\n" not in sentence
        assert len(sentence) < 2000
        assert re.search(r"\b(must|allowed)\b", sentence)
        found = None
    assert time.perf_counter() - begin < SECONDS
    return found


@pytest.mark.slow
@settings(max_examples=EXAMPLES)
@given(texts(TOMLS, TOML_WORDS))
def test_any_text_is_a_scene_or_is_refused(text):
    scene = read_or_refused(Scene.parse, text)
    assert scene is None or isinstance(scene, Scene)


@pytest.mark.slow
@settings(max_examples=EXAMPLES)
@given(texts([URDF], XML_WORDS))
def test_any_text_is_a_robot_or_is_refused(text):
    read = read_or_refused(parse_planar_urdf, text)
    if read is not None:
        # A text that is read has valid numbers, or is refused as a planar chain.
        read_or_refused(Chain.from_links, read.links)


@pytest.mark.slow
@settings(max_examples=EXAMPLES // 10)
@given(scenes(), st.data())
def test_a_scene_that_is_written_and_broken_is_a_scene_or_is_refused(scene, data):
    text = data.draw(broken([scene.to_toml()], TOML_WORDS))
    read_or_refused(Scene.parse, text)


def test_the_check_detects_tracebacks_and_messages_of_two_lines():
    """The check can fail: another exception, or a message of two lines, is detected."""

    def crash(_):
        raise ValueError("a traceback")

    def mumble(_):
        raise TwolinkError("a line must be one;\ngot two")

    for read in (crash, mumble):
        try:
            read_or_refused(read, "")
        except (ValueError, AssertionError):
            continue
        raise AssertionError(f"{read.__name__} was not seen")
