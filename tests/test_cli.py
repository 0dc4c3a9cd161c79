"""The command line: output, errors and exit codes."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pinocchio
import pytest
from typer.testing import CliRunner

from tests.verification.chains import GENERAL
from twolink import lagrange
from twolink.cli import app
from twolink.data import data_path

SENTENCE_LINES = 1


def run(*arguments: str):
    return CliRunner().invoke(app, ["verify", *arguments])


def test_verify_prints_a_table_and_a_sentence():
    result = run("--states", "50")
    assert result.exit_code == 0
    for words in ("crba", "rnea", "aba", "Kane", "Lagrange", "All 60 comparisons agree at 50"):
        assert words in result.stdout


def test_a_disagreement_ends_with_1_and_names_the_state(monkeypatch):
    right = lagrange.kinetic_energy
    monkeypatch.setattr(lagrange, "kinetic_energy", lambda *state: right(*state) * 1.001)
    result = run("--states", "50")
    assert result.exit_code == 1
    assert "2 of 60 comparisons disagree" in result.stdout
    assert result.stdout.count("✗") == 2
    assert "kinetic energy, Lagrange − Pinocchio" in result.stdout
    assert "kinetic energy, Kane − Lagrange:" in result.stdout
    assert "'angles': [" in result.stdout


def test_one_formulation(tmp_path):
    file = tmp_path / "verdict.json"
    result = run("--states", "20", "--formulation", "lagrange", "--json", str(file))
    assert result.exit_code == 0
    sources = {c["source"] for c in json.loads(file.read_text())["comparisons"]}
    assert sources == {"Lagrange", "twolink's kinematics"}


def test_json_holds_the_verdict(tmp_path):
    file = tmp_path / "verdict.json"
    assert run("--states", "20", "--seed", "5", "--json", str(file)).exit_code == 0
    document = json.loads(file.read_text())
    assert document["passed"] is True
    assert (document["states"], document["seed"]) == (20, 5)
    assert document["engine"].startswith("Pinocchio 4")
    assert set(document["versions"]) >= {"python", "twolink", "pin", "numpy"}
    assert set(document["machine"]) == {"system", "machine", "processor", "cores"}
    assert len(document["comparisons"]) == 60
    for comparison in document["comparisons"]:
        assert comparison["passed"] == (comparison["difference"] <= comparison["allowed"])
        assert comparison["state"]
    assert os.listdir(tmp_path) == ["verdict.json"]


def test_a_verdict_with_nan_is_valid_json(tmp_path, monkeypatch):
    monkeypatch.setattr(lagrange, "kinetic_energy", lambda chain, q, u: u[0] / (u[0] - u[0]))
    file = tmp_path / "verdict.json"
    with pytest.warns(RuntimeWarning):
        assert run("--states", "5", "--json", str(file)).exit_code == 1
    document = json.loads(file.read_text(), parse_constant=pytest.fail)
    worst = [c for c in document["comparisons"] if not c["passed"]]
    assert worst
    assert {c["quantity"] for c in worst} == {"kinetic energy"}


def test_a_users_urdf(tmp_path):
    file = tmp_path / "mine.urdf"
    GENERAL.to_urdf(file)
    result = run("--urdf", str(file), "--states", "20")
    assert result.exit_code == 0
    assert "mine.urdf" in result.stdout


def test_assumptions_are_printed(tmp_path):
    file = tmp_path / "mine.urdf"
    file.write_text(GENERAL.to_urdf().replace('"D"', '"hand"').replace('"D_frame"', '"h"'))
    result = run("--urdf", str(file), "--states", "20")
    assert result.exit_code == 0
    assert "D is taken at frame 'hand', the farthest one fixed to link 2." in result.stdout
    assert "D is taken" not in run("--urdf", str(file), "--states", "20", "--tip", "hand").stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--states", "0"], "--states must be a positive whole number; got 0"),
        (["--seed", "-1"], "--seed must be zero or a positive whole number; got -1"),
        (["--urdf", "nowhere.urdf"], "nowhere.urdf: there is no file of this name"),
        (["--urdf", "."], ".: must be a regular file; got a folder"),
        (
            ["--json", "nowhere/verdict.json"],
            "--json: nowhere/verdict.json: its folder does not exist",
        ),
        (["--json", "tests"], "--json: tests: must be a regular file, or a new one; got a folder"),
        (
            ["--tip", "hand"],
            "tip must be a frame fixed to link 'link2', one of 'link2', 'C2', 'D'; got 'hand'",
        ),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(arguments, words):
    result = run(*arguments)
    assert result.exit_code == 2
    assert words in result.stderr
    assert result.stderr.count("\n") == SENTENCE_LINES
    assert result.stdout == ""


@pytest.mark.parametrize(
    "arguments", [["--states", "many"], ["--formulation", "newton"], ["--colour", "red"]]
)
def test_bad_options_end_with_2(arguments):
    result = run(*arguments)
    assert result.exit_code == 2
    assert arguments[0] in result.stderr


def test_bad_input_leaves_an_old_json_alone(tmp_path):
    file = tmp_path / "verdict.json"
    file.write_text("old")
    assert run("--urdf", "nowhere.urdf", "--json", str(file)).exit_code == 2
    assert file.read_text() == "old"


def test_pinocchios_refusal_is_one_sentence(monkeypatch):
    def refuse(text):
        raise ValueError("no")

    monkeypatch.setattr(pinocchio, "buildModelFromXML", refuse)
    result = run("--states", "5")
    assert result.exit_code == 2
    assert "twolink.urdf: Pinocchio rejects the file: no" in result.stderr


def test_a_missing_pinocchio_is_one_sentence(monkeypatch):
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    result = run("--states", "5")
    assert result.exit_code == 2
    assert "twolink: Pinocchio needs pin, which is not installed" in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.slow
def test_an_interrupt_is_safe(tmp_path):
    """Ctrl-C in the middle: no traceback, no half-written file."""
    file = tmp_path / "verdict.json"
    command = [sys.executable, "-m", "twolink.cli", "verify", "--states", "10000000"]
    process = subprocess.Popen(
        [*command, "--json", str(file)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parent.parent,
    )
    time.sleep(3)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert os.listdir(tmp_path) == []


def test_help_names_the_exit_codes():
    result = run("--help")
    assert result.exit_code == 0
    assert "Exit code 0: all agree." in result.stdout


def simulate(*arguments: str):
    return CliRunner().invoke(app, ["simulate", *arguments])


FREE_FALL = str(data_path("scenes") / "free_fall.toml")


def test_simulate_prints_scene_and_accuracy(tmp_path):
    result = simulate(FREE_FALL, "--out", str(tmp_path / "run.csv"), "--samples", "11")
    assert result.exit_code == 0
    for words in ("10 s with Gravity", "taylor on momenta", "1.0e-09 allowed", "2.315203415"):
        assert words in result.stdout
    lines = (tmp_path / "run.csv").read_text().splitlines()
    assert len([line for line in lines if not line.startswith("#")]) == 12


@pytest.mark.slow
def test_a_missed_accuracy_exits_with_1():
    result = simulate(FREE_FALL, "--accuracy", "1e-17")
    assert result.exit_code == 1
    assert "holds until 0 s" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere.toml"], "nowhere.toml: there is no file of this name"),
        ([FREE_FALL, "--method", "euler"], "method must be one of taylor"),
        ([FREE_FALL, "--accuracy", "-1"], "accuracy must be positive and finite; got -1.0"),
        ([FREE_FALL, "--formulation", "newton"], "formulation must be one of momenta"),
        (
            [FREE_FALL, "--out", "run.xlsx"],
            "--out must be a .npz or .csv or .parquet file; got run.xlsx",
        ),
        (
            [FREE_FALL, "--out", "nowhere/run.csv"],
            "--out: nowhere/run.csv: its folder does not exist",
        ),
    ],
)
def test_bad_simulations_are_refused(arguments, words):
    result = simulate(*arguments)
    assert result.exit_code == 2
    assert words in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("scene", "effect"), [("acrobot", "JointDamping"), ("stick_slip", "JointFriction")]
)
def test_the_cost_of_effects_is_printed(scene, effect):
    result = simulate(str(data_path("scenes") / f"{scene}.toml"), "--effects-cost")
    assert result.exit_code == 0
    for words in ("all effects", "without Gravity", f"without {effect}", "operations"):
        assert words in result.stdout


def test_stick_and_slip_are_printed():
    result = simulate(str(data_path("scenes") / "stick_slip.toml"))
    assert result.exit_code == 0
    assert "0 s: A slips forward, B sticks" in result.stdout
    assert "A sticks, B sticks" in result.stdout
