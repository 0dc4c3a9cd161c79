"""Inputs: valid command lines with spoiled parts, environments, interrupts."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path

from tests.fuzz.calls import drawn_call
from tests.fuzz.dice import NUMBERS, Dice, Input
from tests.fuzz.files import bad_file, damaged_trajectory

Options = dict[str, str]


def drawn(seed: int, number: int, folder: Path, out: Path) -> Input:
    """Return the input of a number, of files that are in `folder`; it writes into `out`."""
    dice = Dice(seed, number)
    if dice.happens(0.5):
        return drawn_call(dice, folder, out)
    made = dice.choice((_spoiled, _spoiled, _spoiled, _damaged, _surroundings, _words))
    found = made(dice, folder, out)
    if dice.happens(0.15):
        found.environment |= _environment(dice, out)
    return found


def _right(dice: Dice, folder: Path, out: Path) -> tuple[str, list[str], Options, list[str]]:
    """Return a command that is right: its name, its file's option or none, options, numbers."""
    scene, kept = str(folder / "good.toml"), str(folder / f"good{dice.choice(('.npz', '.csv'))}")
    commands: list[tuple[str, list[str], Options, list[str]]] = [
        ("simulate", [scene], {"--samples": "5", "--out": str(out / "run.npz")},
         ["--samples", "--accuracy"]),
        ("verify", [], {"--states": "3", "--seed": "1", "--json": str(out / "v.json")},
         ["--states", "--seed"]),
        ("verify", [], {"--states": "3", "--urdf": str(folder / "good.urdf")}, ["--states"]),
        ("reference", [scene], {"--digits": "8", "--out": str(out / "r.json")}, ["--digits"]),
        ("plot", [scene], {"--kind": "phase", "--out": str(out / "p.svg"), "--samples": "21"},
         ["--samples", "--states", "--seed"]),
        ("plot", [kept], {"--kind": "phase", "--out": str(out / "p.svg")}, ["--states", "--seed"]),
        ("record", [dice.choice((scene, kept))],
         {"--out": str(out / "f.html"), "--fps": "5", "--speed": "1"}, ["--fps", "--speed"]),
        ("sensitivity", [scene], {"--by": "q1", "--samples": "5", "--out": str(out / "s.csv")},
         ["--samples", "--accuracy"]),
        ("sensitivity", [scene], {"--lyapunov": "5"}, ["--lyapunov"]),
        ("sweep", [str(folder / "sweep.toml")], {"--out": str(out / "s.zarr"), "--workers": "1"},
         ["--workers"]),
        ("hardcases", [], {"--explain": "zeno"}, []),
        ("scenes", [], {}, []),
    ]  # fmt: skip
    return dice.choice(commands)


def _line(name: str, files: list[str], options: Options) -> list[str]:
    return [name, *files, *(word for pair in options.items() for word in pair)]


def _spoiled(dice: Dice, folder: Path, out: Path) -> Input:
    """Return a command line with one thing wrong, or with nothing."""
    name, files, options, numbers = _right(dice, folder, out)
    spoilers: list[Callable[[], object]] = [lambda: None]
    if numbers:
        spoilers.append(lambda: options.update({dice.choice(numbers): dice.choice(NUMBERS)}))
    if files:
        spoilers.append(lambda: files.__setitem__(0, str(_bad(dice, folder, files[0]))))
    if "--urdf" in options:
        spoilers.append(lambda: options.update({"--urdf": str(bad_file(dice, folder, ".urdf"))}))
    for option in {"--out", "--json"} & options.keys():
        suffix = Path(options[option]).suffix
        spoilers.append(
            lambda option=option, suffix=suffix: options.update(
                {option: _target(dice, out, suffix, name)}
            )
        )
    spoilers.append(
        lambda: options.update({"--" + dice.choice(("nope", "Out", "\x1b", "x=1")): "1"})
    )
    if "--kind" in options or "--explain" in options:
        option = "--kind" if "--kind" in options else "--explain"
        spoilers.append(lambda: options.update({option: f"no{dice.text()}"}))
    which = dice.randrange(len(spoilers))
    spoilers[which]()
    # Of numbers none is right but seeds and times of a minus; all of these are refused, too.
    return Input(_line(name, files, options), refused=which > 0, out=_files(options))


def _bad(dice: Dice, folder: Path, file: str) -> Path:
    return bad_file(dice, folder, Path(file).suffix)


def _target(dice: Dice, out: Path, suffix: str, command: str) -> str:
    # A folder is right for references, and so is "", which is this one.
    folders = [str(out / "none" / "b")] if command == "reference" else [str(out), ""]
    long = str(out / f"{'x' * 300}{suffix}")
    files = [str(out / "none" / f"a{suffix}"), "/dev/null", "/dev/full", f"/proc/a{suffix}", long]
    return dice.choice([*files, *folders])


def _files(options: Options) -> tuple[Path, ...]:
    return tuple(Path(options[key]) for key in ("--out", "--json") if key in options)


def _damaged(dice: Dice, folder: Path, out: Path) -> Input:
    """Return a command on a trajectory that is damaged; as good as the whole one, or refused."""
    file = damaged_trajectory(dice, folder)
    name, options = dice.choice(
        (("plot", {"--kind": "angles", "--out": str(out / "p.svg")}),
         ("record", {"--out": str(out / "f.html"), "--fps": "5"}))
    )  # fmt: skip
    return Input(_line(name, [str(file)], options), out=_files(options))


def _words(dice: Dice, folder: Path, out: Path) -> Input:
    """Return a command line of words that mean nothing."""
    words = [dice.text() for _ in range(dice.randrange(1, 5))]
    if dice.happens(0.5):
        words.insert(
            0,
            dice.choice(
                (
                    "simulate",
                    "verify",
                    "plot",
                    "record",
                    "reference",
                    "drift",
                    "sensitivity",
                    "sweep",
                )
            ),
        )
    words = [word.replace("\0", "") for word in words]
    if words and words[0] in ("verify",):
        words.append("--states=0")
    return Input(words, refused=True)


def _surroundings(dice: Dice, folder: Path, out: Path) -> Input:
    """Return a command that is right in an environment that is not: closed streams, signals."""
    name, files, options, _ = _right(dice, folder, out)
    if name == "simulate":
        files[0] = str(folder / dice.choice(("good.toml", "contact.toml")))
    found = Input(_line(name, files, options), refused=False, out=_files(options))
    if dice.happens(0.5):
        found.shut = dice.choice(("stdout closed", "stdout full", "stderr closed", "stdin closed",
                                  "all closed", "stdout gone", "stderr full"))  # fmt: skip
        found.refused = None
    elif dice.happens(0.5):
        found.interrupted = dice.random() * 0.5
        found.refused = None
        found.environment["SIGNAL"] = str(
            int(dice.choice((signal.SIGINT, signal.SIGTERM, signal.SIGHUP)))
        )
    return found


def _environment(dice: Dice, out: Path) -> dict[str, str]:
    """Return an environment as some users have it."""
    return dice.choice(
        (
            {"LC_ALL": "C", "PYTHONUTF8": "0"}, {"LANG": "xx_YY"}, {"HOME": "/nonexistent"},
            {"COLUMNS": "1"}, {"COLUMNS": "40"}, {"COLUMNS": "-5"}, {"COLUMNS": "many"},
            {"TERM": "dumb"}, {"TERM": ""}, {"NO_COLOR": "1"}, {"FORCE_COLOR": "1"},
            {"PYTHONIOENCODING": "ascii"}, {"TZ": "nowhere"}, {"MPLCONFIGDIR": "/proc"},
            {"TMPDIR": str(out)}, {"_TWOLINK_COMPLETE": "bash_source"},
        )
    )  # fmt: skip
