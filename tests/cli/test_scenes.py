"""The command `twolink scenes`: names, descriptions, the schema."""

import json

from typer.testing import CliRunner

from twolink.cli import app
from twolink.scene import Scene, scene_names


def run(*words):
    return CliRunner().invoke(app, ["scenes", *words])


def test_each_scene_has_one_line_with_its_title():
    lines = run().stdout.splitlines()
    for name, file in scene_names().items():
        (line,) = (line for line in lines if line.split()[:1] == [name])
        assert line.split()[1:] == Scene.load(file).title.split()
        assert len(line) <= 80


def test_a_scene_is_described_with_its_file():
    said = run("drop", "painleve").stdout
    assert Scene.load("drop").shows in said
    assert str(scene_names()["painleve"]) in said


def test_an_unknown_name_is_refused():
    result = run("dropp")
    assert result.exit_code == 2
    assert "did you mean 'drop'" in result.stderr


def test_the_schema_is_json():
    assert json.loads(run("--schema").stdout)["properties"]
