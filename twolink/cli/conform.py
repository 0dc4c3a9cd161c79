"""The command `twolink conform`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twolink.cli.options import check_unused
from twolink.cli.progress import progress_bar
from twolink.cli.terminal import (
    FAILED,
    check_target,
    console,
    print_table,
    refuse,
    say,
    write_json,
)
from twolink.suffixes import PLOTS
from twolink.text import either, one_line

if TYPE_CHECKING:
    from twolink.conformance.results import Report, TestResult

# The table fits a terminal of this width.
_WIDE = 80

# Tests that are printed with a cause; --json has all.
_SHOWN = 3

_GIGABYTE = 2**30

_Engine = Annotated[
    str,
    typer.Argument(
        metavar="ENGINE",
        help="A name of an installed engine, such as mujoco; module:object of a Python class; "
        "'cmd: COMMAND' to start a program; or fmu:FILE.",
    ),
]
_Suite = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME",
        help="Only this suite of tests, such as motion. May be repeated. Default: all but "
        "hardcases and verify; a wrong name lists all.",
    ),
]
_Seconds = Annotated[
    float,
    typer.Option(help="Time limit (s) of the engine's start, and of each answer."),
]
_Memory = Annotated[float, typer.Option(help="Memory limit of the engine, in GB.")]
_Check = Annotated[
    bool,
    typer.Option(
        "--check-harness",
        help="Run no suite, but check that the engine keeps to the protocol of messages.",
    ),
]
_Expect = Annotated[
    Path | None,
    typer.Option(
        help="A TOML file of tests that are known to fail. They do not count as failures, but "
        "one of them that passes does."
    ),
]
_JsonFile = Annotated[
    Path | None, typer.Option("--json", help="Write the report to this file as JSON.")
]
_JunitFile = Annotated[
    Path | None, typer.Option("--junit", help="Write the report to this file as JUnit XML.")
]
_Plot = Annotated[
    Path | None,
    typer.Option(
        help="Plot how the errors of the engine's motions fall with smaller steps or tolerances, "
        f"to this {either(PLOTS)} file."
    ),
]


def conform(
    context: typer.Context,
    engine: _Engine,
    suite: _Suite = None,
    seconds: _Seconds = 60.0,
    memory: _Memory = 4.0,
    check: _Check = False,
    expect: _Expect = None,
    json_file: _JsonFile = None,
    junit_file: _JunitFile = None,
    plot: _Plot = None,
) -> None:
    """Check a dynamics engine, and name its mistakes.

    It is asked for quantities and motions of two-link chains, and its answers are compared with
    certified ones; see docs/check_your_engine.md. Exit code 0: all agree. 1: some do not, or
    none is compared. 2: the input was refused.
    """
    _check_limits(seconds, memory)
    _check_targets(engine, expect, json_file, junit_file, plot)
    if check:
        check_unused(
            context, "--check-harness", "suite", "expect", "json_file", "junit_file", "plot"
        )
        _check_harness(engine, seconds, int(memory * _GIGABYTE))
        return
    report = _report(engine, suite, seconds, int(memory * _GIGABYTE), expect)
    _print_report(report)
    _write(report, json_file, junit_file)
    if plot is not None:
        _plot(report, plot)
    if not report.agrees:
        raise typer.Exit(FAILED)


def _check_targets(
    engine: str, expect: Path | None, json_file: Path | None, junit_file: Path | None,
    plot: Path | None,
) -> None:  # fmt: skip
    """Refuse files that cannot be written, are inputs, or would replace each other."""
    from twolink.engines.attach import files_of

    inputs = [expect, *files_of(engine)]
    check_target("--json", json_file, inputs=inputs)
    check_target("--junit", junit_file, inputs=inputs)
    check_target("--plot", plot, PLOTS, inputs=inputs)
    before: dict[Path, str] = {}
    for option, path in (("--json", json_file), ("--junit", junit_file), ("--plot", plot)):
        other = option if path is None else before.setdefault(path.resolve(), option)
        if other != option:
            refuse(f"{option} must be another file than {other}; got {one_line(path, 200)}")


def _check_limits(seconds: float, memory: float) -> None:
    if not 0 < seconds < math.inf:
        refuse(f"--seconds must be a positive number; got {seconds:g}")
    if not 0 < memory < math.inf:
        refuse(f"--memory must be a positive number of GB; got {memory:g}")


def _report(
    engine: str, suite: list[str] | None, seconds: float, memory: int, expect: Path | None
) -> Report:
    """Run the suites under a progress bar, and take known failures out."""
    from twolink.conformance.expectations import read_expectations, with_expectations
    from twolink.conformance.runner import conform as run
    from twolink.conformance.suites import items
    from twolink.engines.attach import attach

    start = attach(engine, memory=memory)
    suites = items(suite)
    known = () if expect is None else read_expectations(expect)
    with progress_bar() as bar:
        task = bar.add_task("conformance", total=1.0)
        report = run(
            engine,
            start,
            suites,
            seconds=seconds,
            memory=memory,
            progress=lambda share: bar.update(task, completed=share),
        )
    return with_expectations(report, known)


def _check_harness(engine: str, seconds: float, memory: int) -> None:
    """Print each check of the protocol, and end with exit code 1 if one fails."""
    from twolink.conformance.harness_check import check_harness
    from twolink.engines.attach import attach

    checks = check_harness(attach(engine, memory=memory), seconds)
    for check in checks:
        say(f"{'✓' if check.passed else '✗'} {check.name}: {check.said}")
    failed = sum(not check.passed for check in checks)
    if failed:
        say(f"{failed} of {len(checks)} checks of the protocol fail.")
        raise typer.Exit(FAILED)
    say(f"All {len(checks)} checks of the protocol pass.")


def _write(report: Report, json_file: Path | None, junit_file: Path | None) -> None:
    """Write the report to the files that are given."""
    from twolink.conformance.report import document, junit
    from twolink.files import atomic_write

    if json_file is not None:
        write_json(json_file, document(report))
    if junit_file is not None:
        with atomic_write(junit_file) as temporary:
            temporary.write_text(junit(report), encoding="utf-8")


def _plot(report: Report, target: Path) -> None:
    """Plot the convergence of motions, or say that there is none."""
    from twolink.conformance.curves import curves_by_scene

    about = report.engine
    scenes = curves_by_scene([(about.name, report.results)])
    if not scenes:
        say(f"{target} is not written: there is no motion to plot.")
        return
    from twolink.viz.plots.convergence import convergence_plot
    from twolink.viz.plots.style import save

    save(convergence_plot(scenes, f"{about.name} {about.version}: errors of motions"), target)


def _print_report(report: Report) -> None:
    """Print the table, the causes, and the verdict."""
    from twolink.conformance.scoreboard_tables import results_table

    page = console(_WIDE)
    about = report.engine
    page.print(f"{about.name} {about.version}, {about.precision}, {report.attachment}\n")
    print_table(page, results_table(report.results))
    page.print("digits: correct digits of the worst answer (LRE).\n", style="dim")
    for name, results in report.causes().items():
        _print_cause(name, results)
    for result in report.failed:
        if not result.cause:
            say(f"{result.id}: {result.verdict}; {one_line(result.said, 300)}")
    count, first = report.printed
    if count:
        many = f"{count} warnings" if count > 1 else "a warning"
        say(f"{about.name} printed {many} to its standard error; the first: {first}")
    page.print(report.sentence, style="bold green" if report.agrees else "bold red", soft_wrap=True)


def _print_cause(name: str, results: tuple[TestResult, ...]) -> None:
    from twolink.conformance.diagnosis import SENTENCES

    count = f"{len(results)} test{'' if len(results) == 1 else 's'}"
    shown = ", ".join(result.id for result in results[:_SHOWN])
    more = ", …" if len(results) > _SHOWN else ""
    say(f"{SENTENCES[name]} ({name}, {count}): {shown}{more}")
