"""TOML: texts that are refused in one sentence, before they take time or memory."""

import pytest

from twolink.errors import FileError
from twolink.toml import read_text, tables

DOTS = ".".join(["a"] * 100_000)


def test_a_file_is_read_to_its_tables(tmp_path):
    file = tmp_path / "a.toml"
    file.write_bytes(b"[one]\r\nx = 1\r\n")
    assert read_text(file, 100) == "[one]\nx = 1\n"
    assert tables(read_text(file, 100), "a file") == {"one": {"x": 1}}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("x = " + "[" * 3000 + "]" * 3000, "tables must not be nested deeper than those of a file"),
        (f"{DOTS} = 1", "tables must not be nested deeper than those of a file"),
        (f"[{DOTS}]", "tables must not be nested deeper than those of a file"),
        ("x = " + "9" * 5000, "a file must be TOML; got another text (Exceeds the limit"),
        ("x = \n1", "a file must be TOML; got another text (Invalid value"),
    ],
    ids=["lists", "dots", "dots of a table", "digits", "other"],
)
def test_hostile_text_is_refused_in_one_sentence(text, sentence):
    with pytest.raises(FileError) as caught:
        tables(text, "a file")
    assert str(caught.value).startswith(sentence)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"x = 1 # \xff", "byte 8 is not UTF-8; must be a TOML file in UTF-8"),
        (b"\xef\xbb\xbfx = 1", "without a byte order mark; got a mark of UTF-8"),
        (b"#" * 101, "got a larger file"),
    ],
)
def test_files_of_other_kinds_are_refused(content, sentence, tmp_path):
    (tmp_path / "a.toml").write_bytes(content)
    with pytest.raises(FileError, match=sentence):
        read_text(tmp_path / "a.toml", 100)
