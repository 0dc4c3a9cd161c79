import json

from typer.testing import CliRunner

from tests.urdf.drawing import arm_with_elbow
from twolink.cli import app
from twolink.data import data_path

DRIVEN = arm_with_elbow(
    '<limit effort="1" velocity="1"/>', '<dynamics damping="0.5" friction="0.25"/>'
)


def run(*arguments: str):
    return CliRunner().invoke(app, ["urdf", "show", *arguments])


def test_the_shipped_file():
    result = run(str(data_path("twolink.urdf")))
    assert result.exit_code == 0
    for words in (
        "A··············1",
        "joint 'joint2', continuous, about (0, 1, 0)",
        "0.0833333333",
        "q1 = θ1 + 0, q2 = q1 + θ2 + 0",
        "gravity in the plane: 9.81 m/s² along y",
        "D is 'D'",
    ):
        assert words in result.stdout


def test_effects_and_warnings(tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_text(DRIVEN)
    text = run(str(file)).stdout
    for words in ("damping 0.5", "friction 0.25", "limits 0 to 0 rad", "lock it"):
        assert words in text


def test_json(tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_text(DRIVEN)
    document = json.loads(run(str(file), "--json", "--tip", "hand").stdout)
    assert document["tip"] == "hand"
    assert document["bodies"][1]["limits"] == [0.0, 0.0]
    assert document["warnings"]


def test_refusals():
    result = run("nowhere.urdf")
    assert result.exit_code == 2
    assert result.stderr == (
        "twolink: nowhere.urdf: there is no file of this name; must be a file that can be read\n"
    )
