"""The command `twolink report`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twolink.cli.importing import importing
from twolink.cli.limits import Force, limits_of
from twolink.cli.progress import ProgressBar, progress_bar
from twolink.cli.showing import BYTES_OF_A_FRAME, check_frames
from twolink.cli.studies import check_budget
from twolink.cli.terminal import FAILED, check_folder, console, refuse, say
from twolink.files import new_folder

if TYPE_CHECKING:
    from twolink.limits import Limits
    from twolink.scene import Scene
    from twolink.simulation import Trajectory
    from twolink.verification import Verdict
    from twolink.viz.report.page import Section
    from twolink.viz.report.sections import Card

_PAGE = "index.html"

# Frames a second of the films in the page.
_FPS = 30.0

# The case of the derivation; and a smooth one, which every method can follow.
_DEFAULT = ("drop.toml", "free_fall.toml")


def report(
    scenes: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="SCENE", help="Scenes: names or TOML files. Default: drop and free_fall."
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="The folder for index.html.")] = Path("report"),
    states: Annotated[int, typer.Option(help="How many random states to verify at.")] = 10_000,
    budget: Annotated[
        float,
        typer.Option(help="Time (s) for the measurements of accuracy of all scenes together."),
    ] = 14.0,
    full: Annotated[
        bool,
        typer.Option(
            "--full", help="Run the hard cases too, on all engines installed; this takes minutes."
        ),
    ] = False,
    force: Force = False,
) -> None:
    """Verify, simulate and measure; write one self-contained page.

    The page needs no network and no server: open report/index.html. Exit code 0: all that was
    checked agrees. 1: a check failed, which the page names. 2: the input was refused.
    """
    check_folder("--out", out, names=[_PAGE], inputs=scenes or [])
    if states < 1:
        refuse(f"--states must be a positive whole number; got {states}")
    check_budget(budget)
    verdicts = _made(scenes or [], out, states, budget, full, limits_of(force))
    page = console()
    for passed, sentence in verdicts:
        page.print(sentence, style="bold green" if passed else "bold red", soft_wrap=True)
    say(out / _PAGE)
    if not all(passed for passed, _ in verdicts):
        raise typer.Exit(FAILED)


def _made(
    files: list[Path], out: Path, states: int, budget: float, full: bool, limits: Limits
) -> list[tuple[bool, str]]:
    """Write the page; return each verdict: whether the check passed, and its sentence."""
    with importing():
        from twolink.viz.page import player_head
        from twolink.viz.report import page
        from twolink.viz.report import sections as made

        # All is read before any work is done.
        loaded = _loaded(files, limits)
    share = budget / len(loaded)
    limits.check_time("a measurement with this budget", share)
    with progress_bar() as bar:
        stage = _Stages(bar, 2 + len(loaded) + full)
        with stage("verifying the shipped URDF") as report:
            verdict = _verified(states, report, limits)
        parts: list[Section] = []
        trajectories = []
        for scene in loaded:
            with stage(f"simulating, filming, measuring: {scene.title}") as report:
                trajectory, section = _scene(scene, share, report, limits)
                trajectories.append(trajectory)
                parts.append(section)
        cards = [
            made.Card("Checks", verdict.passed, verdict.sentence, "verification"),
            made.accuracy_card(trajectories),
        ]
        if full:
            with stage("hard cases") as report:
                part, card = _hard_cases(report)
                parts.append(part)
                cards.append(card)
        else:
            cards.append(_hard_cases_left_out())
        with stage("writing the page"):
            parts += [made.verification(verdict), _origin(verdict)]
            whole = page.page("twolink report", _lead(cards), parts, player_head())
            with new_folder(out):
                page.write(out / _PAGE, whole)
    return [(card.passed, card.sentence) for card in cards if card.passed is not None]


def _loaded(files: list[Path], limits: Limits) -> list[Scene]:
    """Return the scenes of files, or the default ones, whose films keep to the limits."""
    from twolink.data import data_path
    from twolink.scene import Scene

    chosen = files or [data_path("scenes") / name for name in _DEFAULT]
    loaded = [Scene.load(file) for file in chosen]
    for scene in loaded:
        check_frames(scene.duration, _FPS, 1.0, BYTES_OF_A_FRAME, limits)
    return loaded


def _verified(states: int, report: Callable[[float], None], limits: Limits) -> Verdict:
    """Return the verdict on the shipped URDF."""
    from twolink.data import data_path
    from twolink.urdf import read_planar_urdf
    from twolink.verification import verify

    urdf = read_planar_urdf(data_path("twolink.urdf"))
    return verify(urdf, states=states, progress=report, limits=limits)


def _origin(verdict: Verdict) -> Section:
    """Return the section that says how, when and from which code the page was made."""
    from datetime import UTC, datetime

    from twolink.environment import this_commit
    from twolink.viz.report import sections as made

    command = " ".join(["twolink", *sys.argv[1:]])
    now = datetime.now(UTC).isoformat(timespec="seconds")
    return made.origin(verdict, command, [("date", now), ("commit", this_commit())])


def _lead(cards: list[Card]) -> str:
    """Return the top of the page: one sentence, the verdicts, and the chain with its symbols."""
    from twolink.chain import Chain
    from twolink.viz.display import drawing
    from twolink.viz.report import page
    from twolink.viz.report import sections as made

    sentence = (
        "The planar two-link chain (double pendulum): its equations of motion checked against "
        "Pinocchio, its scenes simulated with measured errors, and the cost of accuracy."
    )
    return page.paragraph(sentence, "lead") + made.summary(cards, drawing(Chain.uniform_bars()))


class _Stages:
    """A bar of named stages, each as long as the others."""

    def __init__(self, bar: ProgressBar, count: int) -> None:
        self._bar, self._count, self._done = bar, count, 0
        self._task = bar.add_task("", total=1.0)

    @contextmanager
    def __call__(self, name: str) -> Iterator[Callable[..., None]]:
        """Name the stage; yield a callback that takes its completed share and a description."""

        def progress(share: float, at: str = "") -> None:
            whole = (self._done + share) / self._count
            description = f"{name}: {at}" if at else name
            self._bar.update(self._task, description=description, completed=whole)

        progress(0.0)
        yield progress
        self._done += 1


def _scene(
    scene: Scene, budget: float, report: Callable[[float], None], limits: Limits
) -> tuple[Trajectory, Section]:
    """Return a scene's motion and its section: film, curves and costs."""
    from twolink.accuracy.study import study
    from twolink.simulation import simulate
    from twolink.simulation.effects_cost import effects_cost
    from twolink.viz.film import Film
    from twolink.viz.page import player_body
    from twolink.viz.report import sections as made
    from twolink.viz.run import Run

    trajectory = simulate(scene, limits=limits)
    player = player_body(Film((Run(scene.title, trajectory),), fps=_FPS), dark=True)
    measured = study(scene, budget=budget, progress=lambda _, share: report(share), limits=limits)
    return trajectory, made.scene(trajectory, player, effects_cost(scene, limits=limits), measured)


def _hard_cases_left_out() -> Card:
    """Return the card of hard cases that were not run."""
    from twolink.viz.report.sections import Card

    left_out = "Not run for this report. The command that runs them:"
    return Card("Hard cases", None, left_out, command="twolink report --full")


def _hard_cases(progress: Callable[[float, str], None]) -> tuple[Section, Card]:
    """Return the section of the hard cases, and the card with their verdict."""
    from twolink.hardcases.catalogue import CASES
    from twolink.hardcases.parallel import parallel_scoreboard
    from twolink.hardcases.run import columns, verdict
    from twolink.viz.report.scoreboard import hard_cases
    from twolink.viz.report.sections import Card

    def update(done: int, running: tuple[str, ...]) -> None:
        progress(done / len(CASES), ", ".join(running))

    chosen = columns()
    board = parallel_scoreboard(CASES, chosen, update)
    part = hard_cases(CASES, chosen, board)
    passed, sentence = verdict(board)
    return part, Card("Hard cases", passed, sentence, part.anchor)
