"""Trajectories in files: to the last bit, whole or not at all, and refused in one sentence."""

import io
import json
import math
import os
import subprocess
import sys
import zipfile
from dataclasses import fields, replace
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest

from tests.verification.chains import GENERAL
from twolink.chain import Chain
from twolink.contact.impact_laws import Regime
from twolink.contact.states import ContactState
from twolink.data import data_path
from twolink.effects import Effect, contact_elements
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.errors import FileError, SimulationError
from twolink.scene import Scene
from twolink.simulation import Trajectory, simulate, storage
from twolink.simulation.formats import COLUMNS, FORMATS, Arrays
from twolink.simulation.hybrid.mode import Event, Mode
from twolink.simulation.run import Lane, Recipe
from twolink.simulation.storage import About
from twolink.simulation.trajectory import _Repeated

ROOT = Path(__file__).parent.parent.parent
KINDS = (".npz", ".csv", ".parquet")
SCENE = Scene(
    chain=GENERAL,
    q=(0.3, -0.4),
    u=(1.1, -0.7),
    duration=1.0,
    effects=(Gravity(),),
    title="Ärger,\n# 'and' \"quotes\"",
)


@cache
def smooth():
    return simulate(SCENE, samples=7)


@cache
def sticking():
    return simulate(replace(SCENE, effects=(Gravity(), JointFriction((2.5, 0.6)))), samples=50)


@cache
def bouncing():
    stop = JointStop("B", lower=-0.9, upper=0.4, restitution=0.6)
    return simulate(replace(SCENE, effects=(Gravity(), stop)), samples=50)


@cache
def missed():
    return simulate(SCENE, accuracy=1e-13, method="DOP853", samples=5)


TRAJECTORIES = {"smooth": smooth, "sticks": sticking, "impacts": bouncing, "missed": missed}


def test_the_saved_trajectories_have_events_impacts_and_notes():
    assert not smooth().events
    assert len(sticking().events) > 1
    assert bouncing().impacts
    assert bouncing().events
    assert missed().notes


def test_a_file_has_all_fields_of_a_trajectory():
    known = {field.name for field in fields(Trajectory)}
    assert known - {"t", "q", "u", "_dense", "_knots"} <= {field.name for field in fields(About)}


def same(one, other):
    """To the last bit, and in the same words: repr has every bit of a number."""
    for name in ("t", "q", "u", "energy"):
        ours, theirs = getattr(one, name), getattr(other, name)
        assert ours.dtype == theirs.dtype
        assert ours.shape == theirs.shape
        assert ours.tobytes() == theirs.tobytes()
    for field in fields(Trajectory):
        if field.name not in ("t", "q", "u", "_dense", "_knots"):
            assert repr(getattr(one, field.name)) == repr(getattr(other, field.name))
    assert one.scene == other.scene
    assert one.events == other.events
    assert one.impacts == other.impacts


@pytest.mark.parametrize("name", TRAJECTORIES)
@pytest.mark.parametrize("kind", KINDS)
def test_a_trajectory_is_saved_and_read_back(kind, name, tmp_path):
    trajectory = TRAJECTORIES[name]()
    file = tmp_path / f"run{kind}"
    trajectory.save(file)
    back = Trajectory.load(file)
    same(back, trajectory)
    assert list(tmp_path.iterdir()) == [file]


def fabricated(scene):
    """A trajectory that agrees with a scene, of a mode and an impact of every kind it can have."""
    names = tuple(element.name for element in contact_elements(scene.effects, scene.moving_chain))
    states = [tuple(state for _ in names) for state in ContactState] if names else []
    pair = (-0.0, 5e-324)
    regime = Regime.SLIDES_THEN_BACK
    impact = replace(bouncing().impacts[0], regime=regime, speeds=pair, link_energies=(pair, pair))
    return replace(
        smooth(),
        scene=scene,
        t=np.array([0.0, scene.duration]),
        q=np.array([scene.q, (5e-324, -1e300)]).T.copy(),
        u=np.array([scene.u, (-0.0, 1e-300)]).T.copy(),
        error=float("inf"),
        holds_until=0.0,
        events=tuple(Event(0.0, Mode(names, each), 0.0) for each in states),
        impacts=tuple(
            replace(impact, time=0.0, index=index, name=name) for index, name in enumerate(names)
        ),
        accuracy=np.float32(1e-3),
    )


@pytest.mark.parametrize("file", sorted(data_path("scenes").rglob("*.toml")), ids=lambda f: f.stem)
@pytest.mark.parametrize("kind", KINDS)
def test_trajectories_of_every_shipped_scene_are_saved_and_read_back(kind, file, tmp_path):
    """Values that no simulation gives: an infinite error, a mode and an impact of every kind."""
    trajectory = fabricated(Scene.load(file))
    trajectory.save(tmp_path / f"run{kind}")
    back = Trajectory.load(tmp_path / f"run{kind}")
    same(back, replace(trajectory, accuracy=float(np.float32(1e-3))))


@pytest.mark.parametrize("kind", KINDS)
def test_every_number_is_kept(kind, tmp_path, random):
    """Any finite bits of float64: subnormal, huge, and of either zero."""
    bits = random.integers(0, 2**64, (5, 200), dtype=np.uint64).view(float)
    bits[~np.isfinite(bits)] = -0.0
    bits[1:, 1:4] = [5e-324, -np.finfo(float).max, -5e-324]
    bits[0] = [0.0, *np.sort(random.random(198)), 1.0]
    bits[0, 1] = 5e-324
    bits[1:, 0] = [*smooth().q[:, 0], *smooth().u[:, 0]]
    file = tmp_path / f"run{kind}"
    replace(smooth(), t=bits[0], q=bits[1:3], u=bits[3:]).save(file)
    back = Trajectory.load(file)
    assert np.vstack([back.t, back.q, back.u]).tobytes() == bits.tobytes()


@pytest.mark.parametrize("kind", KINDS)
def test_a_loaded_trajectory_works(kind, tmp_path):
    bouncing().save(tmp_path / f"run{kind}")
    back = Trajectory.load(tmp_path / f"run{kind}")
    assert np.array_equal(back.position(back.chain.D), bouncing().position(bouncing().chain.D))
    assert np.array_equal(back.velocity(back.chain.D), bouncing().velocity(bouncing().chain.D))
    assert np.array_equal(back.kinetic_energy, bouncing().kinetic_energy)
    assert np.array_equal(back.reactions(), bouncing().reactions())
    assert back.effects == ("Gravity", "JointStop")
    assert back.events[-1].mode["B on its upper stop"] is bouncing().events[-1].mode.states[-1]
    assert [impact.description for impact in back.impacts] == [
        impact.description for impact in bouncing().impacts
    ]
    # The regime decides how an impact is described and is stored as its text.
    assert [impact.regime for impact in back.impacts] == [i.regime for i in bouncing().impacts]
    assert {type(impact.regime) for impact in back.impacts} == {Regime}
    with pytest.raises(ValueError, match="read-only"):
        back.q[...] = 0
    times = np.linspace(0, back.t[-1], 300)
    for side in ("left", "right"):
        for ours, theirs in zip(back.at(times, side), bouncing().at(times, side), strict=True):
            assert np.array_equal(ours, theirs)
    for name, work in back.work().items():
        assert np.array_equal(work, bouncing().work()[name])


def test_dense_output_is_refused_if_the_repeated_run_is_another(tmp_path):
    smooth().save(tmp_path / "run.npz")
    back = Trajectory.load(tmp_path / "run.npz")
    assert np.array_equal(back.at(0.3)[0], smooth().at(0.3)[0])
    # As of a library whose arithmetic differs.
    moved = replace(back, q=back.q + 1e-3, _dense=None)
    repeated = _Repeated(moved, moved.recipe)
    with pytest.raises(SimulationError, match=r"must have the stored samples within .* got a diff"):
        repeated.dense()
    with pytest.raises(SimulationError, match="known only at its samples"):
        Trajectory.at(replace(missed(), _dense=None), 0.5)


@pytest.mark.parametrize(
    "recipe",
    [
        Recipe(10**6, 0.1),
        Recipe(1, 0.1),
        Recipe(21, 1e-9),
        Recipe(21, -1.0),
        Recipe(15, 0.1, lane=Lane(2, 40.0)),
        Recipe(15, 0.1, lane=Lane(3, 40.0)),
        Recipe(15, 0.1, lane=Lane(-1, 40.0)),
        Recipe(15, 0.1, lane=Lane(1, 0.5)),
        Recipe(15, 0.1, lane=Lane(1, math.inf)),
        Recipe(15, 0.1, "double", lane=Lane(1, 40.0)),
    ],
)
def test_an_impossible_recipe_is_refused(recipe, tmp_path):
    replace(smooth(), recipe=recipe).save(tmp_path / "run.csv")
    with pytest.raises(SimulationError, match="recipe and its scene do not agree"):
        Trajectory.load(tmp_path / "run.csv")


def test_defects_in_a_shorter_precision_than_the_run_are_refused(tmp_path):
    longer = replace(smooth(), precision="quadruple", recipe=Recipe(21, 0.1, "double"))
    longer.save(tmp_path / "run.csv")
    with pytest.raises(SimulationError, match="recipe and its scene do not agree"):
        Trajectory.load(tmp_path / "run.csv")


def test_a_lane_in_another_precision_is_refused(tmp_path):
    longer = replace(smooth(), precision="quadruple", recipe=Recipe(15, 0.1, lane=Lane(1, 40.0)))
    longer.save(tmp_path / "run.csv")
    with pytest.raises(SimulationError, match="recipe and its scene do not agree"):
        Trajectory.load(tmp_path / "run.csv")


def test_a_lane_is_repeated_bit_by_bit(tmp_path):
    kept = simulate(replace(SCENE, effects=(Gravity(),)), accuracy=1e-6, samples=11)
    assert kept.recipe.lane is not None
    kept.save(tmp_path / "run.npz")
    times = np.linspace(kept.t[0], kept.t[-1], 77)
    for ours, theirs in zip(kept.at(times), Trajectory.load(tmp_path / "run.npz").at(times),
                            strict=True):  # fmt: skip
        assert np.array_equal(ours, theirs)


def test_an_archive_is_read_by_numpy(tmp_path):
    sticking().save(tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz") as archive:
        assert np.array_equal(archive["q"], sticking().q)
        assert np.array_equal(archive["u"], sticking().u)
        about = json.loads(str(archive["about"]))
    assert about["effects"] == ["Gravity", "JointFriction"]
    assert about["error"] == sticking().error
    assert about["events"][0]["mode"] == {
        "names": ["A", "B"],
        "states": [state.value for state in sticking().events[0].mode.states],
        "dents": [],
    }


def test_a_table_is_read_by_numpy(tmp_path):
    file = tmp_path / "run.csv"
    smooth().save(file)
    lines = file.read_text(encoding="utf-8").splitlines()
    comments = [line for line in lines if line.startswith("# ")]
    assert lines[: len(comments)] == comments
    assert f"# error: {smooth().error!r}" in comments
    assert lines[len(comments)] == "t_s,q1_rad,q2_rad,u1_rad_per_s,u2_rad_per_s"
    table = np.loadtxt(file, delimiter=",", skiprows=len(comments) + 1)
    assert np.array_equal(table.T, np.vstack([smooth().t, smooth().q, smooth().u]))
    named = np.genfromtxt(file, delimiter=",", skip_header=len(comments), names=True)
    assert np.array_equal(named["u2_rad_per_s"], smooth().u[1])


def test_a_table_with_other_line_ends_is_the_same(tmp_path):
    file = tmp_path / "run.csv"
    smooth().save(file)
    file.write_bytes(file.read_bytes().replace(b"\n", b"\r\n"))
    same(Trajectory.load(file), smooth())


def test_columns_are_read_by_pyarrow(tmp_path):
    smooth().save(tmp_path / "run.parquet")
    table = pyarrow.parquet.read_table(tmp_path / "run.parquet")
    assert tuple(table.column_names) == COLUMNS
    assert table["u2_rad_per_s"].to_pylist() == smooth().u[1].tolist()
    about = json.loads(table.schema.metadata[b"about"])
    assert Scene.parse(about["scene"]) == SCENE


# Refusals.


def refusal(file):
    """The one sentence with which a file is refused."""
    with pytest.raises(SimulationError) as caught:
        Trajectory.load(file)
    sentence = str(caught.value)
    assert sentence.startswith(f"{file}: ")
    assert "\n" not in sentence
    assert "; allowed " in sentence or "must" in sentence
    return sentence


@pytest.mark.parametrize("file", ["run.xlsx", "run", "run.npy", "run.CSV"])
def test_other_kinds_of_files_are_refused(file, tmp_path):
    words = r"the suffix must be one of \.npz, \.csv, \.parquet; got"
    with pytest.raises(SimulationError, match=words):
        smooth().save(tmp_path / file)
    with pytest.raises(SimulationError, match=words):
        Trajectory.load(tmp_path / file)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("kind", KINDS)
def test_files_that_are_not_there_are_refused(kind, tmp_path):
    assert "there is no file of this name" in refusal(tmp_path / f"run{kind}")
    (tmp_path / f"folder{kind}").mkdir()
    assert "got a folder" in refusal(tmp_path / f"folder{kind}")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"\x93NUMPY", b"\xff\xfe", b"PAR1PAR1"])
def test_files_of_other_content_are_refused(kind, content, tmp_path):
    file = tmp_path / f"run{kind}"
    file.write_bytes(content)
    refusal(file)


@pytest.mark.parametrize("kind", KINDS)
def test_files_of_one_kind_with_the_suffix_of_another_are_refused(kind, tmp_path):
    for other in KINDS:
        if other != kind:
            smooth().save(tmp_path / f"run{other}")
            file = (tmp_path / f"run{other}").rename(tmp_path / f"run{kind}")
            refusal(file)


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_that_was_cut_off_is_refused(kind, tmp_path):
    file = tmp_path / f"run{kind}"
    smooth().save(file)
    content = file.read_bytes()
    for size in range(0, len(content), 7):
        file.write_bytes(content[:size])
        refusal(file)
    file.write_bytes(content[:-1])
    refusal(file)


def test_a_truncated_table_is_refused_with_its_number_of_samples(tmp_path):
    file = tmp_path / "run.csv"
    smooth().save(file)
    file.write_text(file.read_text(encoding="utf-8")[:-1], encoding="utf-8")
    assert "t must have the 7 samples that were saved; got 6" in refusal(file)
    head = file.read_text(encoding="utf-8").partition("u2_rad_per_s")
    file.write_text(head[0] + head[1] + "\n", encoding="utf-8")
    assert "t must have the 7 samples that were saved; got 0" in refusal(file)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_damaged_files_are_refused_or_read_unchanged(kind, tmp_path, random):
    """Any byte may be another: never a traceback, and with checksums no other number."""
    file = tmp_path / f"run{kind}"
    bouncing().save(file)
    saved = [bouncing().t, *bouncing().q, *bouncing().u]
    content = np.frombuffer(file.read_bytes(), dtype=np.uint8)
    refused = 0
    for _ in range(300):
        damaged = content.copy()
        damaged[random.integers(len(content))] ^= random.integers(1, 256, dtype=np.uint8)
        file.write_bytes(damaged.tobytes())
        try:
            back = Trajectory.load(file)
        except SimulationError:
            refused += 1
            refusal(file)
            continue
        assert np.array_equal([back.t, *back.q, *back.u], saved)
    assert refused > 0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("t_s,q1_rad", "t_s,q1_deg", "got t_s, q1_deg, q2_rad"),
        ("t_s,", "", "got q1_rad, q2_rad"),
        ("\n0.0,", "\n", "cannot be read (the number of columns changed from 4 to 5 at row"),
        ("\n0.0,", "\nzero,", "cannot be read (could not convert string 'zero'"),
        ("\n0.0,", "\n# 0.0,", "cannot be read (could not convert string '# 0.0'"),
        ("# samples: 7", "# samples: 8", "t must have the 8 samples that were saved; got 7"),
        ("# samples: 7", "# samples: many", "cannot be read (Expecting value"),
        ("# samples: 7", '# samples: "many"', "got another value (Input should be"),
        ("# samples: 7\n", "", "samples must be as `Trajectory.save` writes it; got none"),
        (
            '"steps": ',
            '"jumps": ',
            "statistics.steps must be as `Trajectory.save` writes it; got none",
        ),
        ("[effects.gravity]", "[effects.gravitas]", "its checksum is not that of its content"),
        ("\n0.0,", "\n-0.0,", "its checksum is not that of its content"),
    ],
)
def test_a_table_with_other_text_is_refused(old, new, words, tmp_path):
    file = tmp_path / "run.csv"
    smooth().save(file)
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    assert words in refusal(file)


def test_a_table_of_too_few_columns_is_refused(tmp_path):
    file = tmp_path / "run.csv"
    smooth().save(file)
    lines = file.read_text(encoding="utf-8").splitlines()
    short = [line.rpartition(",")[0] if line[0].isdigit() else line for line in lines]
    file.write_text("\n".join(short) + "\n", encoding="utf-8")
    assert "each line must have 5 numbers; got 4" in refusal(file)


def test_a_table_that_was_written_elsewhere_is_refused(tmp_path):
    file = tmp_path / "run.csv"
    np.savetxt(file, np.ones((3, 5)), delimiter=",", header=",".join(COLUMNS), comments="")
    assert "title must be as `Trajectory.save` writes it; got none" in refusal(file)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"q": None}, "the arrays must be t, q, u, about; got no q"),
        ({"t": None, "about": None}, "the arrays must be t, q, u, about; got no t and no about"),
        (
            {"q": np.ones((7, 2))},
            "q must be of float64 and shape (2, 7); got float64 and (7, 2)",
        ),
        ({"q": np.ones(7)}, "q must be of float64 and shape (2, 7); got float64 and (7,)"),
        ({"t": np.float64(0)}, "t must be of float64 and shape (7,); got float64 and ()"),
        (
            {"u": np.ones((2, 7), dtype=np.float32)},
            "u must be of float64 and shape (2, 7); got float32",
        ),
        ({"u": np.ones((2, 6))}, "u must have the 7 samples that were saved; got 6"),
        ({"u": np.array([None] * 7)}, "cannot be read (Object arrays cannot be loaded when"),
        ({"about": "[]"}, "the trajectory must be as `Trajectory.save` writes it"),
        ({"about": "{"}, "cannot be read (Expecting property name"),
    ],
)
def test_an_archive_of_other_arrays_is_refused(changes, words, tmp_path):
    file = tmp_path / "run.npz"
    smooth().save(file)
    with np.load(file) as archive:
        arrays = {**archive, **changes}
    np.savez(file, **{name: array for name, array in arrays.items() if array is not None})
    assert words in refusal(file)


@pytest.mark.parametrize("kind", KINDS)
def test_a_run_that_failed_may_have_impacts_after_its_last_sample(kind, tmp_path):
    whole, file = bouncing(), tmp_path / f"run{kind}"
    few = int(np.searchsorted(whole.t, whole.impacts[0].time))
    t, q, u = whole.t[:few], whole.q[:, :few], whole.u[:, :few]
    replace(whole, t=t, q=q, u=u, failure="The law has no solution.").save(file)
    back = Trajectory.load(file)
    assert back.impacts[0].time > back.t[-1]
    replace(whole, t=t, q=q, u=u).save(file)
    assert "t at the end, impacts and its scene do not agree" in refusal(file)


def test_an_array_alone_is_refused(tmp_path):
    file = tmp_path / "run.npz"
    with file.open("wb") as stream:
        np.save(stream, np.ones(3))
    assert "got a single array" in refusal(file)


def test_nothing_in_an_archive_is_executed(tmp_path):
    """An array of objects is a pickle, which could do anything."""
    file = tmp_path / "run.npz"
    smooth().save(file)
    with zipfile.ZipFile(file, "a") as archive, archive.open("v.npy", "w") as stream:
        np.save(stream, np.array([None]), allow_pickle=True)
    same(Trajectory.load(file), smooth())


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (
            lambda table: table.select(COLUMNS[:4]),
            "got t_s, q1_rad, q2_rad, u1_rad_per_s",
        ),
        (lambda table: table.rename_columns(["t", *COLUMNS[1:]]), "got t, q1_rad"),
        (lambda table: table.slice(0, 3), "t must have the 7 samples that were saved; got 3"),
        (
            lambda table: table.replace_schema_metadata(None),
            "schema must have the metadata `about`; got none",
        ),
        (lambda table: table.replace_schema_metadata({"about": "no"}), "cannot be read (Expecting"),
        (
            lambda table: table.set_column(1, "q1_rad", pyarrow.array(range(7))),
            "columns must be of float64 without gaps; got int64",
        ),
        (
            lambda table: table.set_column(1, "q1_rad", pyarrow.array([0.0] * 6 + [None])),
            "got double with 1 gaps",
        ),
    ],
)
def test_other_columns_are_refused(changed, words, tmp_path):
    file = tmp_path / "run.parquet"
    smooth().save(file)
    table = pyarrow.parquet.ParquetFile(file).read()
    pyarrow.parquet.write_table(changed(table), file)
    assert words in refusal(file)


class Wind(Effect):
    """An effect of a user's own."""

    def loads(self, chain, q, u, t=0.0):
        return ()


@pytest.mark.parametrize("kind", KINDS)
def test_without_its_scene_a_trajectory_is_saved_with_a_warning_and_not_loaded(kind, tmp_path):
    file = tmp_path / f"run{kind}"
    with pytest.warns(
        UserWarning, match=r"run\.\w+ has no scene, .* \(effects of a scene file must"
    ):
        replace(smooth(), scene=replace(SCENE, effects=(Wind(),))).save(file)
    sentence = refusal(file)
    assert "`Scene.to_toml` could not write it (effects of a scene file must be" in sentence
    if kind == ".csv":
        comments = file.read_text(encoding="utf-8").splitlines()
        assert "# scene: null" in comments


# Tampered with, and with a checksum that is right.


def forged(file, trajectory, arrays, about):
    """Write a file with other arrays and other words, and the checksum of these."""
    trajectory.save(file)
    write, read, _ = FORMATS[file.suffix]
    t, q, u, words, joints = read(file)
    given = {"t": t, "q": q, "u": u, **arrays}
    stored = Arrays(given["t"], given["q"], given["u"], {**words, **about}, joints)
    stored.about["checksum"] = storage._checksum(stored)
    write(file, stored)


def changed(name, where, value):
    array = getattr(smooth(), name).copy()
    array[where] = value
    return {name: array}


T = np.linspace(0.0, 1.0, 7)
SCENE_TEXT = SCENE.to_toml()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("arrays", "about", "words"),
    [
        ({}, {}, None),
        (changed("t", 3, np.nan), {}, "t is not finite at sample 3"),
        (changed("q", (1, 2), np.inf), {}, "q is not finite at sample 2"),
        (changed("u", (0, 6), -np.inf), {}, "u is not finite at sample 6"),
        ({"t": T[::-1].copy()}, {}, "t does not rise from sample 0 (1 s) to the next"),
        ({"t": np.zeros(7)}, {}, "t does not rise from sample 0"),
        (changed("t", 4, T[3]), {}, "t does not rise from sample 3"),
        ({"t": T * 1e300}, {}, "t at the end and its scene do not agree"),
        ({"t": T / 2}, {}, "t at the end and its scene"),
        ({"t": T + 1e-3}, {}, "t at the start, t at the end and its scene"),
        ({"q": smooth().q + 1e300}, {}, "q at the start and its scene"),
        ({"u": smooth().u + 1e-3}, {}, "u at the start and its scene"),
        ({}, {"error": float("nan")}, "error and its scene"),
        ({}, {"error": -1.0}, "error and its scene"),
        ({}, {"accuracy": float("inf")}, "accuracy and its scene"),
        ({}, {"holds_until": 2.0}, "holds_until and its scene"),
        ({}, {"title": "another"}, "title and its scene"),
        ({}, {"effects": ["Wind"]}, "effects and its scene"),
        ({}, {"scene": SCENE_TEXT.replace("1.0", "2.0")}, "and its scene do not agree"),
        ({}, {"scene": "[effects.gravitas]"}, "its scene: "),
        (
            {"t": T[:0], "q": smooth().q[:, :0], "u": smooth().u[:, :0]},
            {"samples": 0},
            "it has no samples",
        ),
    ],
)
def test_contradictory_files_are_refused(kind, arrays, about, words, tmp_path):
    file = tmp_path / f"run{kind}"
    forged(file, smooth(), arrays, about)
    if words is None:
        same(Trajectory.load(file), smooth())
    else:
        assert words in refusal(file)


@pytest.mark.parametrize(
    ("entry", "changes"),
    [("events", {"time": 1e9}), ("events", {"time": float("nan")}), ("impacts", {"time": 1e9}),
     ("impacts", {"index": 7}), ("impacts", {"index": -1}), ("impacts", {"name": "C"})],
)  # fmt: skip
def test_logs_of_another_scene_are_refused(entry, changes, tmp_path):
    file = tmp_path / "run.npz"
    bouncing().save(file)
    log = FORMATS[".npz"].read(file).about[entry]
    forged(file, bouncing(), {}, {entry: [{**log[0], **changes}, *log[1:]]})
    assert f"{entry} and its scene" in refusal(file)


@pytest.mark.parametrize("name", TRAJECTORIES)
def test_non_finite_trajectories_are_not_saved(name, tmp_path):
    trajectory = TRAJECTORIES[name]()
    broken = replace(trajectory, q=trajectory.q * np.nan)
    with pytest.raises(SimulationError, match="cannot be saved, for q is not finite at sample 0"):
        broken.save(tmp_path / "run.npz")
    assert list(tmp_path.iterdir()) == []


# Large.


def test_an_archive_that_promises_terabytes_is_refused_at_once(tmp_path):
    """A header of a few bytes, for which NumPy would take memory before it reads on."""
    file = tmp_path / "run.npz"
    smooth().save(file)
    header = io.BytesIO()
    shape = {"descr": "<f8", "fortran_order": False, "shape": (2, 10**12)}
    np.lib.format.write_array_header_1_0(header, shape)
    with zipfile.ZipFile(file) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(file, "w") as archive:
        for name, content in {**parts, "q.npy": header.getvalue()}.items():
            archive.writestr(name, content)
    assert "q has 128 bytes for (2, 1000000000000) numbers" in refusal(file)


@pytest.mark.slow
def test_a_decompression_bomb_is_refused(tmp_path):
    file = tmp_path / "run.npz"
    smooth().save(file)
    with zipfile.ZipFile(file) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            if name != "q.npy":
                archive.writestr(name, content)
        with archive.open("q.npy", "w", force_zip64=True) as stream:
            for _ in range(17):
                stream.write(bytes(2**26))
    assert file.stat().st_size < 2**21
    assert "q must be at most 1024 MB; got 1088 MB" in refusal(file)


def test_a_file_that_is_too_large_is_not_opened(tmp_path):
    for kind in KINDS:
        file = tmp_path / f"run{kind}"
        with file.open("wb") as stream:
            stream.truncate(2**30 + 1)
        assert "must be at most 1024 MB" in refusal(file)


def test_columns_without_end_are_refused_shortly(tmp_path):
    file = tmp_path / "run.csv"
    file.write_text("x," * 10**6)
    assert len(refusal(file)) < 600


@pytest.mark.parametrize("kind", KINDS)
def test_pipes_and_loops_of_links_are_refused_without_waiting(kind, tmp_path):
    os.mkfifo(tmp_path / f"fifo{kind}")
    assert "must be a regular file; got a pipe" in refusal(tmp_path / f"fifo{kind}")
    (tmp_path / f"loop{kind}").symlink_to(f"loop{kind}")
    assert "is a loop of links" in refusal(tmp_path / f"loop{kind}")


def test_a_byte_order_mark_is_named(tmp_path):
    file = tmp_path / "run.csv"
    smooth().save(file)
    file.write_bytes(b"\xef\xbb\xbf" + file.read_bytes())
    assert "got a mark of UTF-8" in refusal(file)


# Whole or not at all.

WRITERS = {
    ".npz": "numpy.savez",
    ".csv": "csv.writer",
    ".parquet": "pyarrow.parquet.write_table",
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("older", [False, True])
def test_a_failed_write_leaves_everything_as_it_was(kind, older, tmp_path, monkeypatch):
    file = tmp_path / f"run{kind}"
    if older:
        smooth().save(file)

    def full(*arguments, **options):
        (written,) = tmp_path.glob(".twolink-*")
        written.write_text("half")
        raise OSError("no space left on device")

    monkeypatch.setattr(WRITERS[kind], full)
    with pytest.raises(FileError, match=r"cannot be written \(no space left on device\)"):
        sticking().save(file)
    assert list(tmp_path.iterdir()) == ([file] if older else [])
    if older:
        same(Trajectory.load(file), smooth())


@pytest.mark.parametrize("kind", KINDS)
def test_a_folder_that_is_not_there_is_refused(kind, tmp_path):
    with pytest.raises(FileError, match="its folder does not exist"):
        smooth().save(tmp_path / "nowhere" / f"run{kind}")


@pytest.mark.parametrize("kind", KINDS)
def test_joint_angles_are_part_of_the_checksum(kind, tmp_path):
    file = tmp_path / f"run{kind}"
    scene = Scene.parse(
        '[chain]\nurdf = "twolink.urdf"\n[start]\nq = [0.1, 0.2]\n[run]\nduration = 0.1\n',
        folder=data_path("twolink.urdf").parent,
    )
    simulate(scene, samples=3).save(file)
    write, read, _ = FORMATS[kind]
    stored = read(file)
    assert stored.joints.shape == (4, 3)
    write(file, stored)
    assert Trajectory.load(file).theta.shape == (2, 3)
    write(file, stored._replace(joints=stored.joints + 1))
    assert "its checksum is not that of its content" in refusal(file)


# pyarrow.


def test_a_missing_pyarrow_is_one_sentence(tmp_path, monkeypatch):
    file = tmp_path / "run.parquet"
    smooth().save(file)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert 'pip install "twolink[parquet]"' in refusal(file)
    with pytest.raises(SimulationError, match=r"pyarrow must be installed for \.parquet files"):
        smooth().save(file)


def test_the_command_refuses_before_it_simulates(tmp_path, monkeypatch):
    from typer.testing import CliRunner

    from twolink.cli import app

    monkeypatch.setitem(sys.modules, "pyarrow", None)
    scene, file = data_path("scenes") / "free_fall.toml", tmp_path / "run.parquet"
    result = CliRunner().invoke(app, ["simulate", str(scene), "--out", str(file)])
    assert result.exit_code == 2
    assert result.stdout == ""
    assert 'pip install "twolink[parquet]"' in result.stderr


@pytest.mark.parametrize("kind", KINDS)
def test_files_saved_by_the_command_can_be_loaded(kind, tmp_path):
    from typer.testing import CliRunner

    from twolink.cli import app

    scene, file = data_path("scenes") / "free_fall.toml", tmp_path / f"run{kind}"
    result = CliRunner().invoke(app, ["simulate", str(scene), "--out", str(file)])
    assert result.exit_code == 0
    assert Trajectory.load(file).scene == Scene.load(scene)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_pyarrow_is_imported_for_its_own_files_alone(kind, tmp_path):
    program = (
        "import sys\n"
        "from twolink.scene import Scene\n"
        "from twolink.simulation import Trajectory, simulate\n"
        "scene, file = sys.argv[1:]\n"
        "simulate(Scene.load(scene), samples=3).save(file)\n"
        "Trajectory.load(file)\n"
        "print('pyarrow' in sys.modules)"
    )
    arguments = [str(data_path("scenes") / "free_fall.toml"), str(tmp_path / f"run{kind}")]
    run = subprocess.run(
        [sys.executable, "-c", program, *arguments],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    assert run.stdout.split() == [str(kind == ".parquet")]


@pytest.mark.slow
def test_a_run_that_fails_after_very_short_steps_is_read_again(tmp_path):
    """Its steps over the whole duration would be too many to be repeated, and are not."""
    effects = (EndForce(1e16, friction=0.001),)
    scene = Scene(Chain.uniform_bars(), (0.0, 1.1), (0.0, 0.0), 1.0, effects)
    failed = simulate(scene)
    assert failed.failure
    assert failed.recipe.longest_step * 1e7 < scene.duration
    failed.save(tmp_path / "failed.npz")
    again = Trajectory.load(tmp_path / "failed.npz")
    assert again.failure == failed.failure
    assert np.array_equal(again.q, failed.q)
