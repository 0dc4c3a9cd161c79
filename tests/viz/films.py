"""Films for tests, each simulated once, and the browser of the tests, if any."""

from __future__ import annotations

import os
import sys
import time
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from twolink.data import data_path
from twolink.scene import Scene
from twolink.simulation import Trajectory, simulate
from twolink.viz.browser import find_browser
from twolink.viz.commands import decoded
from twolink.viz.film import Film
from twolink.viz.run import Run
from twolink.viz.themes import theme_named

REQUIRED = "TWOLINK_REQUIRE_BROWSER"


def scene_named(name: str, duration: float | None = None) -> Scene:
    scene = Scene.load(data_path("scenes") / f"{name}.toml")
    return scene if duration is None else replace(scene, duration=duration)


@cache
def trajectory_of(name: str, duration: float | None = None, samples: int = 501) -> Trajectory:
    return simulate(scene_named(name, duration), samples=samples)


def film_of(name: str, duration: float | None = None, theme: str = "light", **rates: Any) -> Film:
    run = Run(name, trajectory_of(name, duration))
    return Film((run,), theme=theme_named(theme), **rates)


def need_browser() -> None:
    """Skip a test where there is no browser, or fail it where there must be one."""
    if find_browser() is None:
        if os.environ.get(REQUIRED) == "1":
            pytest.fail(f"no Chromium or Chrome was found, and {REQUIRED} is 1")
        pytest.skip("no Chromium or Chrome")


def processes_with(word: str) -> list[int]:
    """Return the processes, but for this one, in whose command line or environment a word is."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        for name in ("cmdline", "environ"):
            try:
                if word.encode() in (folder / name).read_bytes():
                    found.append(int(folder.name))
                    break
            except OSError:
                continue
    return [number for number in found if number != os.getpid()]


def gone(word: str) -> bool:
    """Return whether all processes of a word end within a moment: the system ends killed ones."""
    end = time.monotonic() + 10
    while processes_with(word):
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


PRETENDER = """#!{python}
import base64, io, json, os, re, sys, time
from PIL import Image

size, buffer = [320, 240], b""
while part := os.read(3, 1 << 16):
    buffer += part
    while b"\\0" in buffer:
        message, _, buffer = buffer.partition(b"\\0")
        asked = json.loads(message)
        parameters, result = asked.get("params", {{}}), {{}}
        if asked["method"] == "Target.createTarget":
            result = {{"targetId": "1"}}
        if asked["method"] == "Target.attachToTarget":
            result = {{"sessionId": "1"}}
        if asked["method"] == "Emulation.setDeviceMetricsOverride":
            size = [parameters["width"], parameters["height"]]
        if asked["method"] == "Runtime.evaluate":
            number = re.search(r"picture\\((\\d+)\\)", parameters["expression"])
            value = True
            if number:
                time.sleep({pause})
                picture = io.BytesIO()
                Image.new("RGB", size, (int(number[1]) * 7 % 256, 0, 0)).save(picture, "png")
                value = "data:image/png;base64," + base64.b64encode(picture.getvalue()).decode()
            result = {{"result": {{"value": value}}}}
        os.write(4, json.dumps({{"id": asked["id"], "result": result}}).encode() + b"\\0")
        if asked["method"] == "Browser.close":
            sys.exit()
"""


def pretended_browser(folder: Path, pause: float) -> Path:
    """Return a program that answers as a browser does, with a picture after each pause (s)."""
    file = folder / "browser"
    file.write_text(PRETENDER.format(python=sys.executable, pause=pause))
    file.chmod(0o755)
    return file


def commands(sequence):
    """The commands by path and kind; of several the last, as the viewer would have it."""
    return {(c["path"], c["type"], c.get("property", "")): c for c in map(decoded, sequence)}


def matrix(found, path):
    """A path's 4 × 4 matrix, as it is written down."""
    return np.array(found[path, "set_transform", ""]["matrix"]).reshape(4, 4).T


def corners(found, path):
    """The corners of the object at a path, in the plane of motion."""
    geometry = found[path, "set_object", ""]["object"]["geometries"][0]
    points = geometry["data"]["attributes"]["position"]["array"].reshape(-1, 3)
    assert (points[:, 1] == 0).all()
    return np.column_stack([points[:, 0], -points[:, 2]])


def in_plane(pose, along):
    """Where a point along a link's own x-axis is, in the plane of motion."""
    x, y, z, _ = pose @ [along, 0, 0, 1]
    assert y == 0
    return np.array([x, -z])
