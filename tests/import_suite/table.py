"""`python -m tests.import_suite.table` prints the results of engines on the files, as Markdown.

A valid file is read as it stands, and once more repaired by `twolink urdf repair`; an invalid one
as it stands, each in a process of its own.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from tests.import_suite.engines import ENGINES, mass_matrices
from tests.import_suite.index import FOLDER, INVALID, VALID, named
from tests.import_suite.truth import ANGLES, mass_matrix, worst
from twolink.errors import EngineError
from twolink.urdf import read_planar_urdf
from twolink.urdf.repair import repair_urdf

CLOSE = 1e-9
SECONDS = 120


def verdict(engine: str, text: str, expected: object) -> str:
    """Return how well an engine's M agrees: "agrees", "wrong by …", or "refuses"."""
    try:
        matrices = mass_matrices(engine, text, ANGLES)
    except EngineError:
        return "refuses"
    truth = [mass_matrix(expected, theta) for theta in ANGLES]
    off = max(worst(ours, theirs) for ours, theirs in zip(truth, matrices, strict=True))
    return "agrees" if off < CLOSE else f"wrong by {off:.2g}"


def verdicts(test: Any, engine: str) -> tuple[str, str]:
    """Return an engine's verdict on a valid file as it stands, and on the repaired file."""
    text = read_planar_urdf(FOLDER / test["file"]).xml
    first, second = (
        verdict(engine, each, test["parameters"]) for each in (text, repair_urdf(text).text)
    )
    return first, second


def on_invalid(engine: str, file: str) -> str:
    """Return an engine's result on an invalid file: "refuses", "accepts", or "NaN"."""
    text = (FOLDER / file).read_bytes().decode("utf-8", errors="replace")
    try:
        matrices = mass_matrices(engine, text, ANGLES)
    except EngineError:
        return "refuses"
    return "accepts" if all(map(math.isfinite, matrices[0].flat)) else "accepts, NaN"


def isolated(engine: str, file: str) -> str:
    """Return the same from a process of its own, or "crashes" or "hangs"."""
    # PyBullet leaves the last line that it prints open.
    program = (
        "from tests.import_suite.table import on_invalid\n"
        f"print('\\n' + on_invalid({engine!r}, {file!r}))"
    )
    try:
        done = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", program],
            capture_output=True,
            text=True,
            timeout=SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return "hangs"
    lines = done.stdout.split("\n")
    if done.returncode < 0:
        return f"crashes (signal {-done.returncode})"
    return lines[-2] if done.returncode == 0 and len(lines) > 1 else "raises an error of its own"


@contextmanager
def quiet() -> Iterator[None]:
    """Keep C++ from writing to the terminal."""
    sys.stdout.flush()
    kept = os.dup(1), os.dup(2)
    nothing = os.open(os.devnull, os.O_WRONLY)
    try:
        for number in (1, 2):
            os.dup2(nothing, number)
        yield
    finally:
        for number, copy in zip((1, 2), kept, strict=True):
            os.dup2(copy, number)
            os.close(copy)
        os.close(nothing)


def main() -> None:
    """Print a table of valid files and one of invalid files."""
    print(f"| valid file | {' | '.join(ENGINES)} |\n|---|{'---|' * len(ENGINES)}")
    for test in VALID:
        cells = []
        for engine in ENGINES:
            with quiet():
                as_is, repaired = verdicts(test, engine)
            cells.append(as_is if as_is == repaired else f"{as_is}; repaired: {repaired}")
        print(f"| {named(test)} | {' | '.join(cells)} |", flush=True)
    print(f"\n| invalid file | {' | '.join(ENGINES)} | repair |\n|---|{'---|' * len(ENGINES)}---|")
    for test in INVALID:
        cells = [isolated(engine, test["file"]) for engine in ENGINES]
        repair = "repairs" if test["repairable"] else "refuses"
        print(f"| {named(test)} | {' | '.join(cells)} | {repair} |", flush=True)


if __name__ == "__main__":
    main()
