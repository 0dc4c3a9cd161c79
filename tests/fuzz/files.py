"""The files that inputs name: good ones, and every kind of bad one."""

from __future__ import annotations

import io
import os
import zipfile
from pathlib import Path

import numpy as np

from tests.fuzz.dice import Dice
from twolink.data import data_path
from twolink.scene import Scene
from twolink.simulation import simulate

KINDS = (".npz", ".csv", ".parquet")


_HUGE = 2**31

SWEEP = """
[[axes]]
parameter = "start.q.0"
values = [0.1, 0.2]

[runs]
accuracy = 1e-4

[keep]
final = true
first = [{name = "x", of = "q1", level = 0.15}]

[scene.chain]
mass = [1.0, 1.0]
length = [1.0, 1.0]

[scene.start]
q = [0.0, 0.5]

[scene.run]
duration = 0.1

[scene.effects.gravity]
"""


def prepare(folder: Path) -> None:
    """Write the good files, from which bad ones are made, and paths that are no files."""
    text = (data_path("scenes") / "free_fall.toml").read_text(encoding="utf-8")
    short = text.replace("duration = 10.0", "duration = 0.2")
    (folder / "good.toml").write_text(short, encoding="utf-8")
    text = (data_path("scenes") / "bounce_to_rest.toml").read_text(encoding="utf-8")
    (folder / "contact.toml").write_text(text, encoding="utf-8")
    (folder / "sweep.toml").write_text(SWEEP, encoding="utf-8")
    (folder / "good.urdf").write_bytes(data_path("twolink.urdf").read_bytes())
    trajectory = simulate(Scene.load(folder / "good.toml"), samples=11)
    for kind in KINDS:
        trajectory.save(folder / f"good{kind}")
    restore(folder)


def restore(folder: Path) -> None:
    """Make the files that are no regular ones, where an input has put another in their place."""
    if not (folder / "fifo.toml").is_fifo():
        (folder / "fifo.toml").unlink(missing_ok=True)
        os.mkfifo(folder / "fifo.toml")
    for suffix in (".toml", ".urdf", *KINDS):
        for name, target in (("loop", f"loop{suffix}"), ("device", "/dev/zero")):
            link = folder / f"{name}{suffix}"
            if not link.is_symlink():
                link.unlink(missing_ok=True)
                link.symlink_to(target)
        (folder / f"folder{suffix}").mkdir(exist_ok=True)
        huge = folder / f"huge{suffix}"
        if not huge.exists() or huge.stat().st_size != _HUGE:
            with huge.open("wb") as stream:
                stream.truncate(_HUGE)


def bad_file(dice: Dice, folder: Path, suffix: str) -> Path:
    """Return a file of a kind that must be refused."""
    kind = dice.choice(
        ("none", "loop", "folder", "device", "huge", "empty", "noise", "mark", "cut")
    )
    if kind in ("loop", "folder", "device", "huge"):
        return folder / f"{kind}{suffix}"
    good = (folder / f"good{suffix}").read_bytes()
    made = folder / f"{dice.randrange(10**9)}-{kind}{suffix}"
    content = {
        "none": None,
        "empty": b"",
        "noise": dice.randbytes(dice.randrange(1, 4000)),
        "mark": b"\xff\xfe" + good,
        "cut": good[: dice.randrange(1, max(2, len(good) // 2))],
    }[kind]
    if content is not None:
        made.write_bytes(content)
    return made


def damaged_trajectory(dice: Dice, folder: Path) -> Path:
    """Return a trajectory of which some bytes or arrays are others: to be refused, or the same."""
    kind = dice.choice(KINDS)
    content = bytearray((folder / f"good{kind}").read_bytes())
    made = folder / f"{dice.randrange(10**9)}-damaged{kind}"
    if kind == ".npz" and dice.happens(0.5):
        made.write_bytes(_other_arrays(dice, bytes(content)))
        return made
    for _ in range(dice.choice((1, 1, 2, 10, 100))):
        place = dice.randrange(len(content) + 1)
        how = dice.randrange(3)
        if how == 0:
            content[place : place + 1] = dice.randbytes(1)
        elif how == 1:
            del content[place : place + dice.randrange(1, 200)]
        else:
            content[place:place] = dice.randbytes(dice.randrange(1, 50))
    made.write_bytes(content)
    return made


def _other_arrays(dice: Dice, content: bytes) -> bytes:
    """Return an archive in which an array is of another type, shape or value."""
    with np.load(io.BytesIO(content)) as archive:
        arrays = dict(archive)
    name = dice.choice(list(arrays))
    other = (
        np.nan, np.inf, 1e300, 5e-324, -1.0, 0, True, "text", b"\x00", np.zeros((3, 3)),
        np.zeros(0), np.arange(11)[::-1], np.full((2, 11), np.nan), np.zeros(11, dtype=complex),
    )  # fmt: skip
    arrays[name] = np.asarray(dice.choice(other))
    if dice.happens(0.2):
        del arrays[name]
    written = io.BytesIO()
    np.savez(written, **arrays)
    if dice.happens(0.2):
        with zipfile.ZipFile(written, "a") as archive, archive.open("../../evil.npy", "w") as more:
            more.write(b"x")
    return written.getvalue()
