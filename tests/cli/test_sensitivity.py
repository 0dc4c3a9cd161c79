"""The command `twolink sensitivity`."""

import csv
import json

import pytest
from typer.testing import CliRunner

from twolink.cli import app
from twolink.scene import Scene

TEXT = """
title = "Two springs"
[chain]
mass = [1.0, 1.0]
length = [1.0, 1.0]
[start]
q = [0.1, 0.2]
[run]
duration = 1.0
[effects.joint_spring]
stiffness = [2.0, 1.0]
"""


@pytest.fixture
def file(tmp_path):
    made = tmp_path / "springs.toml"
    made.write_text(TEXT)
    return made


def run(*words):
    return CliRunner().invoke(app, ["sensitivity", *map(str, words)])


def test_derivatives_are_printed_with_their_errors(file):
    result = run(file, "--by", "q1", "--by", "effects.joint_spring.stiffness.1")
    assert result.exit_code == 0, result.output
    lines = result.output.splitlines()
    assert lines[0] == "Two springs"
    assert lines[1].strip() == "Derivatives at 1 s"
    assert any(line.split()[:2] == ["q1", "0.1"] for line in lines)
    assert any(line.split()[:1] == ["effects.joint_spring.stiffness.1"] for line in lines)
    assert "Errors are bounds, measured by runs that differ in precision and equations" in lines[-1]


@pytest.mark.slow
def test_deviations_are_printed_with_the_time_until_which_they_hold(file):
    result = run(file, "--by", "m2", "--deviation", "q1=0.001", "--deviation", "m2=0.01")
    assert result.exit_code == 0, result.output
    assert "Standard deviations, to first order" in result.output
    assert "differ from the first order by" in result.output
    # A deviation names its parameter.
    assert sum(line.split()[:1] == ["q1"] for line in result.output.splitlines()) == 1


@pytest.mark.slow
def test_exponents_are_printed_with_what_is_known_of_them(file):
    result = run(file, "--lyapunov", 100)
    assert result.exit_code == 0, result.output
    assert [line.split()[0] for line in result.output.splitlines()[5:10]] == [
        *(f"λ{k}" for k in (1, 2, 3, 4)),
        "sum",
    ]
    assert "± is the standard error from 20 blocks of time." in result.output
    assert "100 s" in result.output.splitlines()[-1]


@pytest.mark.slow
def test_an_accuracy_that_is_not_met_is_exit_code_1(file):
    result = run(file, "--by", "q1", "--accuracy", "1e-17")
    assert result.exit_code == 1
    assert "The accuracy 1.0e-17 holds until" in result.output


def test_files_have_the_derivatives(file, tmp_path):
    for name in ("a.json", "a.csv"):
        made = run(file, "--by", "q1", "--samples", 3, "--out", tmp_path / name)
        assert made.exit_code == 0, made.output
    document = json.loads((tmp_path / "a.json").read_text())
    rows = list(csv.reader((tmp_path / "a.csv").read_text().splitlines()))
    assert document["by"]["q1"]["dq"][0] == [float(row[5]) for row in rows[1:]]
    assert rows[0][5] == "dq1/dq1"


def test_files_have_the_exponents(file, tmp_path):
    for name in ("a.json", "a.csv"):
        assert run(file, "--lyapunov", 50, "--out", tmp_path / name).exit_code == 0
    document = json.loads((tmp_path / "a.json").read_text())
    rows = list(csv.reader((tmp_path / "a.csv").read_text().splitlines()))
    assert document["blocks"][0] == [float(x) for x in rows[1][1:]]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ([], "--by must name a parameter, such as q1 or chain.mass.1; got none"),
        (["--by", "q3"], "by.0: the key in the scene must be one of chain, start, effects, q1"),
        *(
            ([*words, "--lyapunov", "9"], f"{words[0]} must be left out with --lyapunov; got both")
            for words in (
                ["--by", "q1"],
                ["--deviation", "q1=1"],
                ["--accuracy", "1e-3"],
                ["--samples", "7"],
            )
        ),
        (["--lyapunov", "-1"], "--lyapunov must be a positive number of seconds; got -1"),
        (["--lyapunov", "0.1"], "seconds must be"),
        (["--deviation", "q1"], "--deviation must be NAME=NUMBER, such as q1=0.001; got 'q1'"),
        (["--deviation", "q1=x"], "--deviation must be NAME=NUMBER, such as q1=0.001; got 'q1=x'"),
        (
            ["--by", "q1", "--deviation", "q1=0.1", "--deviation", "q1=0.2"],
            "--deviation must name each number once; got 'q1' twice",
        ),
        (["--deviation", "q1=-1"], "the deviation of q1 must be zero or positive, and finite"),
        (["--by", "q1", "--accuracy", "0"], "accuracy must be positive and finite"),
        (["--by", "q1", "--samples", "1"], "samples must be a whole number of 2 or more"),
        (["--by", "q1", "--out", "a.txt"], "--out must be"),
    ],
)
def test_options_that_make_no_sense_are_refused(file, words, sentence):
    result = run(file, *words)
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert result.stderr.count("\n") == 1
    assert not result.stdout


@pytest.mark.parametrize("words", [["--by", "q1"], ["--lyapunov", "10"]])
def test_a_scene_with_contact_is_refused(words):
    result = run("drop", *words)
    assert result.exit_code == 2
    assert "a scene must be smooth" in result.stderr
    assert any(type(effect).__name__ in result.stderr for effect in Scene.load("drop").effects)
