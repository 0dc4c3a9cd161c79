"""The command `twolink reference`: its times and digits."""

from dataclasses import replace

import pytest
from typer.testing import CliRunner

from twolink.cli import app
from twolink.scene import Scene


def run(*words):
    return CliRunner().invoke(app, ["reference", *map(str, words)])


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--times", "1", "--fifths"], "--times must be left out with --fifths; got both"),
        (["--times", ""], "--times must be numbers of seconds, separated by commas; got ''"),
        (["--times", "11"], "general: times must increase from 0 to 10 s; got 11"),
        *(
            (
                ["--digits", digits, *others],
                f"--digits must be a whole number from 1 to {most}; got {digits}",
            )
            for digits in (-3, 0, 1001)
            for others, most in (([], 1000), (["--rigorous"], 400), (["drop"], 1000))
        ),
    ],
)
def test_bad_input_is_refused_in_one_sentence(words, sentence, tmp_path):
    several = "drop" in words
    result = run("general", *words, "--out", tmp_path / ("a" if several else "a.csv"))
    assert result.exit_code == 2
    assert result.stderr == f"twolink: {sentence}\n"
    assert result.stdout == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("duration", [0.11, 0.21, 0.42, 0.98, 1.62])
def test_the_last_fifth_ends_with_the_run(duration, tmp_path):
    """Five times a duration, divided by five, may be more than it."""
    scene, out = tmp_path / "short.toml", tmp_path / "short.csv"
    scene.write_text(replace(Scene.load("general"), duration=duration).to_toml(), "utf-8")
    result = run(scene, "--fifths", "--digits", 5, "--out", out)
    assert result.exit_code == 0, result.output
    times = [float(line.partition(",")[0]) for line in out.read_text().splitlines()[1:]]
    assert times == [*(duration * part / 5 for part in range(1, 5)), duration]


@pytest.mark.parametrize("options", [[], ["--rigorous"]])
def test_times_are_checked_in_all_scenes_before_any_is_computed(options, tmp_path):
    words = ["general", "drop", "--digits", 10, "--times", "6", *options]
    result = run(*words, "--out", tmp_path / "a")
    assert result.exit_code == 2
    assert result.stderr == "twolink: drop: times must increase from 0 to 5 s; got 6\n"
    assert result.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_scenes_without_a_proof_are_refused_before_any_is_computed(tmp_path):
    words = ["free_fall", "stick_slip", "--digits", 10, "--rigorous"]
    result = run(*words, "--out", tmp_path / "a")
    assert result.exit_code == 2
    assert result.stderr.startswith("twolink: stick_slip: the scene of a rigorous enclosure must")
    assert result.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_a_choice_that_the_laws_leave_is_printed():
    result = CliRunner().invoke(app, ["reference", "elbow_and_tip", "--digits", "8"])
    assert result.exit_code == 0
    assert "do not determine the order of simultaneous impacts" in result.stdout
