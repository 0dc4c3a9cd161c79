"""Scenes by name: a shipped scene, a file, or a sentence with the nearest names."""

import tomllib

import pytest
from typer.testing import CliRunner

from twolink.cli import app
from twolink.errors import SceneError
from twolink.scene import Scene, scene_file, scene_names
from twolink.scene.names import files_named_in

NAMES = scene_names()


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_scene_is_loaded_by_its_name(name):
    assert Scene.load(name) == Scene.load(NAMES[name])


def test_every_shipped_scene_has_a_name_of_its_own():
    assert len(NAMES) == len(list(NAMES["drop"].parent.rglob("*.toml")))


def test_a_file_of_that_name_comes_first_and_a_folder_does_not(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "drop"
    folder.mkdir()
    assert scene_file("drop") == NAMES["drop"]
    folder.rmdir()
    folder.write_text(NAMES["free_fall"].read_text())
    assert Scene.load("drop") == Scene.load("free_fall")


@pytest.mark.parametrize("name", ["drp", "Drop", "drop.toml"])
def test_a_misspelt_name_is_refused_with_the_nearest_one(name):
    with pytest.raises(SceneError, match=f"^{name}: there is no scene .*; did you mean drop"):
        Scene.load(name)


@pytest.mark.parametrize("name", ["xyz", "x" * 9999, "models/drop", "a\0b"])
def test_a_path_without_a_file_is_refused_as_a_path(name):
    with pytest.raises(SceneError, match=r"must be a file that can be read|has a NUL character"):
        Scene.load(name)


@pytest.mark.parametrize(
    "command",
    [
        ["simulate", "drp"],
        ["accuracy", "drp"],
        ["drift", "drp"],
        ["reference", "drp"],
        ["report", "drp"],
        ["view", "drp"],
        ["record", "drp", "--out", "film.html"],
        ["plot", "drp", "--kind", "angles", "--out", "plot.svg"],
        ["record", "free_fall", "--ghost", "drp", "--out", "film.html"],
    ],
    ids=" ".join,
)
def test_every_command_takes_names(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 2
    assert "did you mean drop?" in result.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_scene_of_a_name_is_simulated_and_plotted(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(app, ["simulate", "free_fall"]).exit_code == 0
    plot = ["plot", "free_fall", "--kind", "angles", "--samples", "11", "--out", "a.svg"]
    assert CliRunner().invoke(app, plot).exit_code == 0
    record = ["record", "free_fall", "--out", "film.html"]
    assert CliRunner().invoke(app, record).exit_code == 0


def test_a_scene_from_a_dict_is_that_of_its_file():
    for file in NAMES.values():
        table = tomllib.loads(file.read_text())
        kept = repr(table)
        assert Scene.from_dict(table, folder=file.parent) == Scene.load(file)
        assert repr(table) == kept


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ([1], "<dict>: a scene must be a dict; got list"),
        ({}, "<dict>: key 'chain' is missing"),
        (
            {"chain": {"mass": (1, "x")}},
            "<dict>: chain.mass.1 must be a number, without quotes; got 'x'",
        ),
    ],
)
def test_a_dict_that_is_no_scene_is_refused(table, sentence):
    with pytest.raises(SceneError, match=sentence):
        Scene.from_dict(table)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ('[chain]\nurdf = "arms/a.urdf"', ["arms/a.urdf"]),
        ('scene = "inner.toml"', ["inner.toml", "b.urdf"]),
        ('[scene.chain]\nurdf = "c.urdf"', ["c.urdf"]),
        ('scene = "drop"', []),
        ("chain = 1\nscene = 2", []),
    ],
)
def test_the_files_that_a_scene_or_a_sweep_names(text, names, tmp_path):
    (tmp_path / "inner.toml").write_text('[chain]\nurdf = "b.urdf"')
    (tmp_path / "outer.toml").write_text(text)
    assert files_named_in(tmp_path / "outer.toml") == tuple(tmp_path / name for name in names)
