"""Files: plain, of bounded size, in an encoding that is known."""

import os
import socket
from pathlib import Path

import pytest

from tests.urdf.robots import PLAIN
from tests.urdf.sentences import names
from twolink import UrdfError
from twolink.text import one_line
from twolink.urdf import parse_planar_urdf, read_planar_urdf
from twolink.urdf.text import decoded, decoded_leniently


def refused_file(path: Path | str) -> str:
    with pytest.raises(UrdfError) as caught:
        read_planar_urdf(path)
    sentence = str(caught.value)
    assert len(sentence.splitlines()) == 1
    assert sentence.startswith(f"{one_line(path, 300)}: ")
    assert "must" in sentence
    return sentence


@pytest.mark.parametrize(
    ("content", "word"),
    [
        (b"", "empty"),
        (PLAIN.encode("utf-16"), "UTF-16"),
        (b"\xff\xfe\x00", "UTF-16"),
        (PLAIN.encode("utf-32"), "UTF-32"),
        (PLAIN.encode().replace(b"base", b"b\0se", 1), "NUL byte at position 36"),
        (PLAIN.encode().replace(b"base", b"b\xe4se"), "0xe4 at position 36 in line 2"),
        (b'<?xml version="1.0" encoding="idna"?><robot name="\xe4"/>', "0xe4"),
        (b'<?xml version="1.0" encoding="cp1252"?><robot name="\x81"/>', "encoding cp1252"),
        (b'<?xml version="1.0" encoding="iso-8859-99"?><robot name="\xe4"/>', "iso-8859-99"),
        (b"<robot>" + b" " * 17_000_000 + b"</robot>", "16 MB"),
        (PLAIN.encode()[:300], "well-formed"),
    ],
)
def test_files_that_are_not_urdf(tmp_path, content, word):
    file = tmp_path / "arm.urdf"
    file.write_bytes(content)
    names(refused_file(file), word)


def test_paths_without_a_file(tmp_path):
    names(refused_file(tmp_path / "none.urdf"), "no file")
    names(refused_file(tmp_path), "folder")
    names(refused_file(tmp_path / "none" / "none.urdf"), "no file")
    with pytest.raises(UrdfError, match="is a name that is too long") as caught:
        read_planar_urdf(tmp_path / ("n" * 5000))
    assert len(str(caught.value)) < 200
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")
        names(refused_file(tmp_path / "pipe"), "pipe")


def test_a_file_that_may_not_be_read(tmp_path, monkeypatch):
    file = tmp_path / "arm.urdf"
    file.write_text(PLAIN)

    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    names(refused_file(file), "Permission denied")


def test_a_file_is_read_as_its_text(tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_bytes(b"\xef\xbb\xbf" + PLAIN.encode())
    read = read_planar_urdf(file)
    assert (read.path, read.xml) == (str(file), PLAIN)
    assert read.links == parse_planar_urdf(PLAIN).links
    assert read_planar_urdf(str(file)) == read


@pytest.mark.parametrize("encoding", ["ISO-8859-1", "latin1", "windows-1252"])
def test_a_declared_encoding_is_read(tmp_path, encoding):
    file = tmp_path / "arm.urdf"
    declaration = f'<?xml version="1.0" encoding="{encoding}"?>\n<!-- Gehäuse -->\n'
    file.write_bytes((declaration + PLAIN).encode("latin-1"))
    read = read_planar_urdf(file)
    assert "Gehäuse" in read.xml
    assert read.links == parse_planar_urdf(PLAIN).links


def test_files_that_are_not_plain(tmp_path):
    names(refused_file("/dev/zero"), "a device")
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(tmp_path / "s"))
        names(refused_file(tmp_path / "s"), "a socket")
    names(refused_file(f"{tmp_path}/a\0b"), "has a NUL character")


@pytest.mark.parametrize(
    "content",
    [PLAIN.encode(), "Ä".encode(), b"\xef\xbb\xbf<r/>", b"<?xml version='1.0'?>\xe2\x82\xac"],
)
def test_lenient_and_strict_reading_of_valid_text_agree(content):
    assert decoded_leniently(content)[0] == decoded(content)


@pytest.mark.parametrize("content", [b"a\0b", b"\xff\xfea", b"\xff\xfe\0\0a"])
def test_damaged_text_is_refused_leniently_too(content):
    with pytest.raises(UrdfError):
        decoded_leniently(content)
