"""Trajectories in files: to the last bit, whole or not at all, and refused in one sentence."""

import json
import subprocess
import sys
import zipfile
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest

from tests.verification.chains import GENERAL
from twolink.contact.states import ContactState
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.errors import SimulationError
from twolink.scene import Scene
from twolink.shipped import shipped
from twolink.simulation import Trajectory, simulate
from twolink.simulation.hybrid.mode import Event, Mode
from twolink.simulation.storage import COLUMNS, About

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
SMOOTH = simulate(SCENE, samples=7)
STICK_SLIP = simulate(replace(SCENE, effects=(Gravity(), JointFriction((2.5, 0.6)))), samples=50)
IMPACTS = simulate(
    replace(SCENE, effects=(Gravity(), JointStop("B", lower=-0.9, upper=0.4, restitution=0.6))),
    samples=50,
)
MISSED = simulate(SCENE, accuracy=1e-9, method="semi-implicit-euler", samples=5)
TRAJECTORIES = {"smooth": SMOOTH, "sticks": STICK_SLIP, "impacts": IMPACTS, "missed": MISSED}


def test_what_is_saved_here_has_what_can_be_saved():
    assert not SMOOTH.events
    assert len(STICK_SLIP.events) > 1
    assert IMPACTS.impacts
    assert IMPACTS.events
    assert MISSED.notes


def test_a_file_says_all_that_a_trajectory_knows():
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
    trajectory = TRAJECTORIES[name]
    file = tmp_path / f"run{kind}"
    trajectory.save(file)
    back = Trajectory.load(file)
    same(back, trajectory)
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize("file", sorted(shipped("scenes").rglob("*.toml")), ids=lambda f: f.stem)
@pytest.mark.parametrize("kind", KINDS)
def test_every_shipped_scene_travels_along(kind, file, tmp_path):
    """With what no simulation makes: an infinite error, a mode and an impact of every kind."""
    names = tuple(f"of {state.name}" for state in ContactState)
    pair = (-0.0, 5e-324)
    impact = replace(
        IMPACTS.impacts[0], name="ö", regime="", speeds=pair, link_energies=(pair, pair)
    )
    trajectory = replace(
        SMOOTH,
        scene=Scene.load(file),
        error=float("inf"),
        events=(Event(0.1, Mode(names, tuple(ContactState)), 0.3),),
        impacts=(impact,),
        accuracy=np.float32(1e-3),
    )
    trajectory.save(tmp_path / f"run{kind}")
    back = Trajectory.load(tmp_path / f"run{kind}")
    same(back, replace(trajectory, accuracy=float(np.float32(1e-3))))


@pytest.mark.parametrize("kind", KINDS)
def test_every_number_is_kept(kind, tmp_path, random):
    """Any bits of float64: subnormal, huge, of either zero, and infinite."""
    bits = random.integers(0, 2**64, (5, 200), dtype=np.uint64).view(float)
    bits[np.isnan(bits)] = -0.0
    bits[:, :3] = [5e-324, -np.inf, np.finfo(float).max]
    file = tmp_path / f"run{kind}"
    replace(SMOOTH, t=bits[0], q=bits[1:3], u=bits[3:]).save(file)
    back = Trajectory.load(file)
    assert np.vstack([back.t, back.q, back.u]).tobytes() == bits.tobytes()


@pytest.mark.parametrize("kind", KINDS)
def test_a_loaded_trajectory_works(kind, tmp_path):
    IMPACTS.save(tmp_path / f"run{kind}")
    back = Trajectory.load(tmp_path / f"run{kind}")
    assert np.array_equal(back.position(back.chain.D), IMPACTS.position(IMPACTS.chain.D))
    assert np.array_equal(back.velocity(back.chain.D), IMPACTS.velocity(IMPACTS.chain.D))
    assert np.array_equal(back.kinetic_energy, IMPACTS.kinetic_energy)
    assert np.array_equal(back.reactions(), IMPACTS.reactions())
    assert back.effects == ("Gravity", "JointStop")
    assert back.events[-1].mode["B on its upper stop"] is IMPACTS.events[-1].mode.states[-1]
    assert [impact.what for impact in back.impacts] == [impact.what for impact in IMPACTS.impacts]
    with pytest.raises(ValueError, match="read-only"):
        back.q[...] = 0
    for of_samples_alone in (lambda: back.at(0.5), back.work):
        with pytest.raises(SimulationError, match="known at its samples alone; allowed is a traj"):
            of_samples_alone()


def test_an_archive_is_read_by_numpy(tmp_path):
    STICK_SLIP.save(tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz") as archive:
        assert np.array_equal(archive["q"], STICK_SLIP.q)
        assert np.array_equal(archive["u"], STICK_SLIP.u)
        about = json.loads(str(archive["about"]))
    assert about["effects"] == ["Gravity", "JointFriction"]
    assert about["error"] == STICK_SLIP.error
    assert about["events"][0]["mode"] == {
        "names": ["A", "B"],
        "states": [state.value for state in STICK_SLIP.events[0].mode.states],
        "dents": [],
    }


def test_a_table_is_read_by_numpy(tmp_path):
    file = tmp_path / "run.csv"
    SMOOTH.save(file)
    lines = file.read_text(encoding="utf-8").splitlines()
    comments = [line for line in lines if line.startswith("# ")]
    assert lines[: len(comments)] == comments
    assert f"# error: {SMOOTH.error!r}" in comments
    assert lines[len(comments)] == "t_s,q1_rad,q2_rad,u1_rad_per_s,u2_rad_per_s"
    table = np.loadtxt(file, delimiter=",", skiprows=len(comments) + 1)
    assert np.array_equal(table.T, np.vstack([SMOOTH.t, SMOOTH.q, SMOOTH.u]))
    named = np.genfromtxt(file, delimiter=",", skip_header=len(comments), names=True)
    assert np.array_equal(named["u2_rad_per_s"], SMOOTH.u[1])


def test_a_table_with_other_line_ends_is_the_same(tmp_path):
    file = tmp_path / "run.csv"
    SMOOTH.save(file)
    file.write_bytes(file.read_bytes().replace(b"\n", b"\r\n"))
    same(Trajectory.load(file), SMOOTH)


def test_columns_are_read_by_pyarrow(tmp_path):
    SMOOTH.save(tmp_path / "run.parquet")
    table = pyarrow.parquet.read_table(tmp_path / "run.parquet")
    assert tuple(table.column_names) == COLUMNS
    assert table["u2_rad_per_s"].to_pylist() == SMOOTH.u[1].tolist()
    about = json.loads(table.schema.metadata[b"about"])
    assert Scene.parse(about["scene"]) == SCENE


# What is refused.


def refusal(file):
    """The one sentence with which a file is refused."""
    with pytest.raises(SimulationError) as caught:
        Trajectory.load(file)
    sentence = str(caught.value)
    assert sentence.startswith(f"{file}: ")
    assert "\n" not in sentence
    assert "; allowed " in sentence
    return sentence


@pytest.mark.parametrize("file", ["run.xlsx", "run", "run.npy", "run.CSV"])
def test_other_kinds_of_files_are_refused(file, tmp_path):
    words = r"the suffix is '.*'; allowed are \.npz, \.csv, \.parquet"
    with pytest.raises(SimulationError, match=words):
        SMOOTH.save(tmp_path / file)
    with pytest.raises(SimulationError, match=words):
        Trajectory.load(tmp_path / file)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("kind", KINDS)
def test_files_that_are_not_there_are_refused(kind, tmp_path):
    assert "there is no file of this name" in refusal(tmp_path / f"run{kind}")
    (tmp_path / f"folder{kind}").mkdir()
    assert "cannot be read" in refusal(tmp_path / f"folder{kind}")


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
            SMOOTH.save(tmp_path / f"run{other}")
            file = (tmp_path / f"run{other}").rename(tmp_path / f"run{kind}")
            refusal(file)


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_that_was_cut_off_is_refused(kind, tmp_path):
    file = tmp_path / f"run{kind}"
    SMOOTH.save(file)
    content = file.read_bytes()
    for size in range(0, len(content), 7):
        file.write_bytes(content[:size])
        refusal(file)
    file.write_bytes(content[:-1])
    refusal(file)


def test_a_table_says_how_much_of_it_is_there(tmp_path):
    file = tmp_path / "run.csv"
    SMOOTH.save(file)
    file.write_text(file.read_text(encoding="utf-8")[:-1], encoding="utf-8")
    assert "t has 6 samples; allowed are the 7 that were saved" in refusal(file)
    head = file.read_text(encoding="utf-8").partition("u2_rad_per_s")
    file.write_text(head[0] + head[1] + "\n", encoding="utf-8")
    assert "t has 0 samples; allowed are the 7 that were saved" in refusal(file)


@pytest.mark.parametrize("kind", KINDS)
def test_damage_is_refused_or_harmless(kind, tmp_path, random):
    """Any byte may be another: never a traceback, and with checksums no other number."""
    file = tmp_path / f"run{kind}"
    IMPACTS.save(file)
    saved = [IMPACTS.t, *IMPACTS.q, *IMPACTS.u]
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
        assert kind == ".csv" or np.array_equal([back.t, *back.q, *back.u], saved)
    assert refused > 0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("t_s,q1_rad", "t_s,q1_deg", "its columns are t_s, q1_deg, q2_rad"),
        ("t_s,", "", "its columns are q1_rad, q2_rad"),
        ("\n0.0,", "\n", "cannot be read (the number of columns changed from 4 to 5 at row"),
        ("\n0.0,", "\nzero,", "cannot be read (could not convert string 'zero'"),
        ("\n0.0,", "\n# 0.0,", "cannot be read (could not convert string '# 0.0'"),
        ("# samples: 7", "# samples: 8", "t has 7 samples; allowed are the 8 that were saved"),
        ("# samples: 7", "# samples: many", "cannot be read (Expecting value"),
        ("# samples: 7", '# samples: "many"', "what it says of samples is wrong (Input should be"),
        ("# samples: 7\n", "", "what it says of samples is wrong (Field required)"),
        ('"steps": ', '"jumps": ', "what it says of statistics.steps is wrong (Field required)"),
        ("[effects.gravity]", "[effects.gravitas]", "its scene: effect 'gravitas' is unknown"),
    ],
)
def test_a_table_with_other_text_is_refused(old, new, words, tmp_path):
    file = tmp_path / "run.csv"
    SMOOTH.save(file)
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    assert words in refusal(file)


def test_a_table_of_too_few_columns_is_refused(tmp_path):
    file = tmp_path / "run.csv"
    SMOOTH.save(file)
    lines = file.read_text(encoding="utf-8").splitlines()
    short = [line.rpartition(",")[0] if line[0].isdigit() else line for line in lines]
    file.write_text("\n".join(short) + "\n", encoding="utf-8")
    assert "its lines have 4 numbers; allowed are 5 in each" in refusal(file)


def test_a_table_that_was_written_elsewhere_is_refused(tmp_path):
    file = tmp_path / "run.csv"
    np.savetxt(file, np.ones((3, 5)), delimiter=",", header=",".join(COLUMNS), comments="")
    assert "what it says of title is wrong (Field required)" in refusal(file)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"q": None}, "it has no q; allowed are t, q, u, about"),
        ({"t": None, "about": None}, "it has no t and no about"),
        (
            {"q": SMOOTH.q.T},
            "q is of float64 and shape (7, 2); allowed is float64 and shape (2, 7)",
        ),
        ({"q": SMOOTH.q[0]}, "q is of float64 and shape (7,); allowed is float64"),
        ({"t": np.float64(0)}, "t is of float64 and shape (); allowed is float64 and shape (7,)"),
        ({"u": SMOOTH.u.astype(np.float32)}, "u is of float32 and shape (2, 7); allowed is"),
        ({"u": SMOOTH.u[:, :6]}, "u has 6 samples; allowed are the 7 that were saved"),
        ({"u": np.array([None] * 7)}, "cannot be read (Object arrays cannot be loaded when"),
        ({"about": "[]"}, "what it says of the trajectory is wrong"),
        ({"about": "{"}, "cannot be read (Expecting property name"),
    ],
)
def test_an_archive_of_other_arrays_is_refused(changes, words, tmp_path):
    file = tmp_path / "run.npz"
    SMOOTH.save(file)
    with np.load(file) as archive:
        arrays = {**archive, **changes}
    np.savez(file, **{name: array for name, array in arrays.items() if array is not None})
    assert words in refusal(file)


def test_an_array_alone_is_refused(tmp_path):
    file = tmp_path / "run.npz"
    with file.open("wb") as stream:
        np.save(stream, np.ones(3))
    assert "it is a single array" in refusal(file)


def test_nothing_in_an_archive_is_executed(tmp_path):
    """An array of objects is a pickle, which could do anything."""
    file = tmp_path / "run.npz"
    SMOOTH.save(file)
    with zipfile.ZipFile(file, "a") as archive, archive.open("v.npy", "w") as stream:
        np.save(stream, np.array([None]), allow_pickle=True)
    same(Trajectory.load(file), SMOOTH)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (
            lambda table: table.select(COLUMNS[:4]),
            "its columns are t_s, q1_rad, q2_rad, u1_rad_per",
        ),
        (lambda table: table.rename_columns(["t", *COLUMNS[1:]]), "its columns are t, q1_rad"),
        (lambda table: table.slice(0, 3), "t has 3 samples; allowed are the 7 that were saved"),
        (lambda table: table.replace_schema_metadata(None), "its schema has no metadata `about`"),
        (lambda table: table.replace_schema_metadata({"about": "no"}), "cannot be read (Expecting"),
        (
            lambda table: table.set_column(1, "q1_rad", pyarrow.array(range(7))),
            "a column is of int64 with 0 gaps; allowed is float64 without gaps",
        ),
        (
            lambda table: table.set_column(1, "q1_rad", pyarrow.array([0.0] * 6 + [None])),
            "a column is of double with 1 gaps",
        ),
    ],
)
def test_other_columns_are_refused(changed, words, tmp_path):
    file = tmp_path / "run.parquet"
    SMOOTH.save(file)
    table = pyarrow.parquet.ParquetFile(file).read()
    pyarrow.parquet.write_table(changed(table), file)
    assert words in refusal(file)


class Wind:
    """An effect of a user's own."""

    def loads(self, chain, q, u, t=0.0):
        return ()


@pytest.mark.parametrize("kind", KINDS)
def test_without_its_scene_a_trajectory_is_saved_and_not_loaded(kind, tmp_path):
    file = tmp_path / f"run{kind}"
    replace(SMOOTH, scene=replace(SCENE, effects=(Wind(),))).save(file)
    sentence = refusal(file)
    assert "its scene could not be written along (effect Wind is not one of scene" in sentence
    if kind == ".csv":
        comments = file.read_text(encoding="utf-8").splitlines()
        assert "# scene: null" in comments


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
        SMOOTH.save(file)

    def full(*arguments, **options):
        (written,) = tmp_path.glob(".run*")
        written.write_text("half")
        raise OSError("no space left on device")

    monkeypatch.setattr(WRITERS[kind], full)
    with pytest.raises(
        SimulationError, match=r"cannot be written \(no space left on device\); all"
    ):
        STICK_SLIP.save(file)
    assert list(tmp_path.iterdir()) == ([file] if older else [])
    if older:
        same(Trajectory.load(file), SMOOTH)


@pytest.mark.parametrize("kind", KINDS)
def test_a_folder_that_is_not_there_is_refused(kind, tmp_path):
    with pytest.raises(
        SimulationError, match=r"cannot be written .*; allowed is a file in a folder"
    ):
        SMOOTH.save(tmp_path / "nowhere" / f"run{kind}")


# pyarrow.


def test_a_missing_pyarrow_is_one_sentence(tmp_path, monkeypatch):
    file = tmp_path / "run.parquet"
    SMOOTH.save(file)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert 'pip install "twolink[parquet]"' in refusal(file)
    with pytest.raises(SimulationError, match=r"pyarrow, which \.parquet needs, is not installed"):
        SMOOTH.save(file)


def test_the_command_refuses_before_it_simulates(tmp_path, monkeypatch):
    from typer.testing import CliRunner

    from twolink.cli import app

    monkeypatch.setitem(sys.modules, "pyarrow", None)
    scene, file = shipped("scenes") / "free_fall.toml", tmp_path / "run.parquet"
    result = CliRunner().invoke(app, ["simulate", str(scene), "--out", str(file)])
    assert result.exit_code == 2
    assert result.stdout == ""
    assert 'pip install "twolink[parquet]"' in result.stderr


@pytest.mark.parametrize("kind", KINDS)
def test_the_command_saves_what_can_be_loaded(kind, tmp_path):
    from typer.testing import CliRunner

    from twolink.cli import app

    scene, file = shipped("scenes") / "free_fall.toml", tmp_path / f"run{kind}"
    result = CliRunner().invoke(app, ["simulate", str(scene), "--out", str(file)])
    assert result.exit_code == 0
    assert Trajectory.load(file).scene == Scene.load(scene)


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
    arguments = [str(shipped("scenes") / "free_fall.toml"), str(tmp_path / f"run{kind}")]
    run = subprocess.run(
        [sys.executable, "-c", program, *arguments],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    assert run.stdout.split() == [str(kind == ".parquet")]
