"""`python -m tests.fuzz --inputs N --seed S`: run N inputs, print the faults."""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
import warnings
from collections import Counter
from importlib import import_module
from pathlib import Path

from tests.fuzz.calls import trajectories
from tests.fuzz.draw import drawn
from tests.fuzz.files import prepare, restore
from tests.fuzz.run import faults, run


def campaign(inputs: int, seed: int, first: int = 0) -> tuple[list[str], Counter[object]]:
    """Return the faults, a line for each input, and how often each exit code was seen."""
    lines, codes = [], Counter()
    # Their integrators are compiled once, for all forks.
    trajectories()
    with tempfile.TemporaryDirectory() as place:
        folder, out = Path(place, "in"), Path(place, "out")
        folder.mkdir()
        prepare(folder)
        for number in range(first, first + inputs):
            out.mkdir()
            restore(folder)
            given = drawn(seed, number, folder, out)
            ended = run(given, Path(place))
            codes[ended.code] += 1
            for fault in faults(given, ended, set(), out):
                lines.append(f"{number}: {fault}")
                said = f"{given.words} {given.shut} {given.environment} {ended.err[-300:]!r}"
                sys.stdout.write(
                    f"{number}: {fault}: {said[:900]}\n".encode(errors="backslashreplace").decode()
                )
                sys.stdout.flush()
            shutil.rmtree(out)
            if (number + 1) % 1000 == 0:
                sys.stdout.write(f"{number + 1 - first} inputs so far, {len(lines)} faults\n")
                sys.stdout.flush()
    return lines, codes


def main() -> None:
    """Run the campaign of the command line; exit code 1 where anything is wrong."""
    warnings.simplefilter("ignore")
    # Imported once, so that forks need not.
    for name in (
        "twolink.cli",
        "twolink.viz.recording",
        "twolink.viz.plots.phase",
        "twolink.viz.plots.angles",
        "pinocchio",
    ):
        import_module(name)
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz")
    parser.add_argument("--inputs", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    asked = parser.parse_args()
    begin = time.monotonic()
    lines, codes = campaign(asked.inputs, asked.seed, asked.first)
    counted = ", ".join(f"{count} with {code}" for code, count in sorted(codes.items(), key=str))
    sys.stdout.write(
        f"{asked.inputs} inputs, seed {asked.seed}: {len(lines)} faults; exit codes: {counted}; "
        f"{time.monotonic() - begin:.0f} s\n"
    )
    sys.exit(1 if lines else 0)


if __name__ == "__main__":
    main()
