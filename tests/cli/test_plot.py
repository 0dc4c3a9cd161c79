"""`twolink plot`: files, messages and errors."""

import subprocess
import sys
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from twolink.chain import Chain
from twolink.cli import app
from twolink.cli.plot import OF_MOTION
from twolink.data import data_path
from twolink.scene import Scene
from twolink.simulation import simulate

SLIDING = data_path("scenes/slide_and_stop.toml")
FREE_FALL = data_path("scenes/free_fall.toml")
FEW = ("--samples", "101")
FEW_STATES = ("--states", "50")

START = {".svg": b"<?xml", ".png": b"\x89PNG"}


def plot(*arguments):
    return CliRunner().invoke(app, ["plot", *map(str, arguments)])


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".svg", ".png"])
@pytest.mark.parametrize("kind", [*OF_MOTION, "verification"])
def test_each_kind_is_written_as_each_kind_of_file(tmp_path, kind, suffix):
    file = tmp_path / f"plot{suffix}"
    few = FEW_STATES if kind == "verification" else FEW
    result = plot(SLIDING, "--kind", kind, "--out", file, "--theme", "dark", *few)
    assert result.exit_code == 0, result.output
    assert result.stdout.split() == [str(file)]
    assert file.read_bytes().startswith(START[suffix])
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.slow
def test_kind_all_writes_a_file_for_each_kind(tmp_path):
    result = plot(SLIDING, "--kind", "all", "--out", tmp_path / "slide.svg", *FEW, *FEW_STATES)
    assert result.exit_code == 0, result.output
    names = {f"slide-{kind}.svg" for kind in (*OF_MOTION, "verification")}
    assert {file.name for file in tmp_path.iterdir()} == names


@pytest.mark.slow
def test_all_plots_of_a_smooth_motion_omit_contact_with_a_message(tmp_path):
    result = plot(FREE_FALL, "--kind", "all", "--out", tmp_path / "fall.png", *FEW, *FEW_STATES)
    assert result.exit_code == 0, result.output
    assert not (tmp_path / "fall-contact.png").exists()
    assert (tmp_path / "fall-energy.png").exists()
    assert "No plot of contact: the scene has no friction and no obstacle." in result.stdout


@pytest.mark.slow
def test_a_saved_trajectory_is_plotted_as_its_scene_is(tmp_path):
    """Except between samples, where a smooth motion's angles show no difference."""
    saved = tmp_path / "fall.npz"
    simulated = CliRunner().invoke(
        app, ["simulate", str(FREE_FALL), "--samples", "101", "--out", str(saved)]
    )
    assert simulated.exit_code == 0
    for name, source in (("one", [saved]), ("two", [FREE_FALL, *FEW])):
        result = plot(*source, "--kind", "angles", "--out", tmp_path / f"{name}.svg")
        assert result.exit_code == 0, result.output
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()


@pytest.mark.slow
def test_a_urdf_is_verified(tmp_path):
    urdf = tmp_path / "chain.urdf"
    Chain.uniform_bars((2.0, 1.0), (0.5, 0.7)).to_urdf(urdf)
    result = plot(urdf, "--kind", "verification", "--out", tmp_path / "v.svg", *FEW_STATES)
    assert result.exit_code == 0, result.output
    assert (tmp_path / "v.svg").exists()


@pytest.mark.slow
def test_the_same_command_writes_the_same_bytes(tmp_path):
    """In two processes, whose hashes differ."""
    for name in ("one", "two"):
        subprocess.run(
            [
                sys.executable, "-m", "twolink.cli", "plot", str(SLIDING), "--kind", "contact",
                "--out", str(tmp_path / f"{name}.svg"), *FEW,
            ],
            check=True, capture_output=True,
        )  # fmt: skip
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()


def test_a_motion_not_known_to_its_end_exits_with_1(tmp_path, monkeypatch):
    from twolink import simulation

    real = simulation.simulate_with

    def cut_short(scene, options):
        done = real(scene, options)
        return replace(done, error=1.0, holds_until=0.5, notes=("Known until 0.5 s.",))

    monkeypatch.setattr(simulation, "simulate_with", cut_short)
    result = plot(FREE_FALL, "--kind", "angles", "--out", tmp_path / "a.svg", *FEW)
    assert result.exit_code == 1
    assert (tmp_path / "a.svg").exists()
    assert "Known until 0.5 s." in result.stderr


def test_a_motion_beside_another_has_its_notes(tmp_path):
    saved = tmp_path / "fall.npz"
    fall = simulate(Scene.load("free_fall"), samples=21)
    replace(fall, holds_until=0.5, error=1.0, notes=("Known until 0.5 s.",)).save(saved)
    words = "--with", saved, "--kind", "path", "--out", tmp_path / "a.svg"
    result = plot(FREE_FALL, *words, *FEW)
    assert result.exit_code == 1
    assert "Known until 0.5 s." in result.stderr


@pytest.mark.slow
def test_a_trajectory_beside_a_scene_is_plotted_with_samples_of_the_scene(tmp_path):
    saved = tmp_path / "fall.npz"
    words = ["simulate", str(FREE_FALL), "--samples", "101", "--out", str(saved)]
    assert CliRunner().invoke(app, words).exit_code == 0
    for name, sources in (("a", [saved, "--with", FREE_FALL]), ("b", [FREE_FALL, "--with", saved])):
        result = plot(*sources, "--kind", "difference", "--out", tmp_path / f"{name}.svg", *FEW)
        assert result.exit_code == 0, result.output


def test_motions_from_files_of_one_name_are_all_drawn(tmp_path):
    fall = simulate(Scene.load("free_fall"), samples=21)
    files = [tmp_path / name / "run.npz" for name in ("a", "b", "c")]
    for file in files:
        file.parent.mkdir()
        fall.save(file)
    beside = [word for file in files[1:] for word in ("--with", file)]
    result = plot(files[0], *beside, "--kind", "path", "--out", tmp_path / "path.svg")
    assert result.exit_code == 0, result.output
    drawn = (tmp_path / "path.svg").read_text(encoding="utf-8")
    assert ">run<" in drawn
    assert ">run (2)<" in drawn


@pytest.mark.parametrize(
    ("source", "options", "said"),
    [
        (FREE_FALL, {"--kind": "spiral"}, "--kind must be one of angles, phase, path"),
        (FREE_FALL, {"--theme": "sepia"}, "--theme must be one of light, dark; got 'sepia'"),
        (FREE_FALL, {"--out": "plot.eps"}, "--out must be a .svg or .png or .pdf file; got"),
        (FREE_FALL, {"--out": "nowhere/plot.svg"}, "its folder does not exist"),
        (FREE_FALL, {"--states": "0"}, "--states must be a positive whole number; got 0"),
        (FREE_FALL, {"--seed": "-1"}, "--seed must be zero or a positive whole number; got -1"),
        (FREE_FALL, {"--samples": "1"}, "--samples must be 2 or more; got 1"),
        (FREE_FALL, {"--kind": "contact"}, "must have friction or an obstacle"),
        (FREE_FALL, {"--kind": "difference"}, "must be given with one --with; got 0"),
        (FREE_FALL, {"--kind": "contact", "--with": FREE_FALL}, "--with must be given with a kind"),
        (FREE_FALL, {"--with": "motion.xlsx"}, "motion.xlsx: must be a scene"),
        *(
            (
                FREE_FALL,
                {"--kind": kind, option: "7"},
                f"{option} must be left out with --kind {kind}; got both",
            )
            for kind in ("angles", "phase")
            for option in ("--states", "--seed")
        ),
        (
            FREE_FALL,
            {"--kind": "verification", "--samples": "7"},
            "--samples must be left out with --kind verification; got both",
        ),
        *(
            (
                "kept.npz",
                {"--kind": kind, "--samples": "7"},
                "--samples must be left out with a trajectory, which has its own; got both",
            )
            for kind in ("angles", "all")
        ),
        (
            "kept.npz",
            {"--with": "kept.csv", "--samples": "7"},
            "--samples must be left out with a trajectory, which has its own; got both",
        ),
        ("motion.xlsx", {}, "must be a scene (.toml) or a trajectory"),
        ("missing.toml", {}, "missing.toml: there is no file of this name"),
        ("missing.npz", {}, "missing.npz: "),
        (data_path("twolink.urdf"), {}, "--kind must be verification for a URDF; got angles"),
        (
            "missing.urdf",
            {"--kind": "verification"},
            "missing.urdf",
        ),
    ],
)
def test_invalid_options_are_rejected_with_one_sentence(tmp_path, source, options, said):
    given = {"--kind": "angles", "--out": "plot.svg"} | options
    given["--out"] = tmp_path / given["--out"]
    result = plot(source, *(word for pair in given.items() for word in pair))
    assert result.exit_code == 2, result.output
    (sentence,) = result.stderr.strip().splitlines()
    assert sentence.startswith("twolink: ")
    assert said in sentence
    assert result.stdout == ""
    assert list(tmp_path.iterdir()) == []
