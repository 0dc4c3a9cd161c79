"""The command `twolink harness`: skeletons of engines."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from twolink.cli import app

FOLDER = Path(__file__).parent.parent.parent / "examples" / "harness"


def run(*arguments):
    return CliRunner().invoke(app, ["harness", *arguments])


@pytest.mark.parametrize(
    ("language", "name"),
    [("c", "engine.c"), ("cpp", "engine.cpp"), ("js", "engine.js"), ("octave", "engine.m")],
)
def test_skeletons_are_written(language, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = run(language)
    assert (found.exit_code, found.output) == (0, f"{name}\n")
    assert (tmp_path / name).read_bytes() == (FOLDER / name).read_bytes()


def test_a_skeleton_is_written_to_the_named_file(tmp_path):
    assert run("c", "--out", str(tmp_path / "mine.c")).exit_code == 0
    assert (tmp_path / "mine.c").exists()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("fortran",), "must be one of c, cpp, js, octave; got 'fortran'"),
        (("c", "--out", "/no/such/folder/engine.c"), "its folder does not exist"),
        ((), "LANGUAGE"),
    ],
)
def test_bad_input(arguments, sentence):
    found = run(*arguments)
    assert found.exit_code == 2
    assert sentence in found.output
