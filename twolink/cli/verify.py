"""The command `twolink verify`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twolink.cli.limits import Force, limits_of
from twolink.cli.terminal import (
    FAILED,
    WIDE,
    check_target,
    console,
    progress_bar,
    refuse,
    styled,
    write_json,
)
from twolink.text import choice

if TYPE_CHECKING:
    from rich.text import Text

    from twolink.verification import Comparison, Verdict


def verify(
    urdf: Annotated[
        Path | None,
        typer.Option(help="A URDF of a planar two-link chain. Default: the shipped chain."),
    ] = None,
    states: Annotated[int, typer.Option(help="How many random states to compare at.")] = 10_000,
    seed: Annotated[int, typer.Option(help="Seed of the random states.")] = 1,
    formulation: Annotated[
        str | None, typer.Option(help="Check this one alone: kane or lagrange. Default: both.")
    ] = None,
    tip: Annotated[
        str | None, typer.Option(help="The URDF's link to take as the free end D.")
    ] = None,
    contact: Annotated[
        bool,
        typer.Option(
            "--contact",
            help="Compare contact at D instead: impacts, constraint forces, a given force.",
        ),
    ] = False,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the verdict to this file as JSON.")
    ] = None,
    force: Force = False,
) -> None:
    """Check Kane's and Lagrange's equations against Pinocchio.

    At random states, each quantity by each formulation and by Pinocchio; and Kane against
    Lagrange. Exit code 0: all agree. 1: some do not. 2: the input was refused.
    """
    if states < 1:
        refuse(f"--states must be a positive whole number; got {states}")
    if seed < 0:
        refuse(f"--seed must be zero or a positive whole number; got {seed}")
    check_target("--json", json_file)
    verdict = _verdict(urdf, states, seed, formulation, tip, contact, force)
    _print_verdict(verdict, contact)
    if json_file is not None:
        write_json(json_file, _document(verdict))
    if not verdict.passed:
        raise typer.Exit(FAILED)


def _verdict(
    urdf: Path | None,
    states: int,
    seed: int,
    formulation: str | None,
    tip: str | None,
    contact: bool,
    force: bool,
) -> Verdict:
    """Run the verification under a progress bar."""
    from twolink.data import data_path
    from twolink.formulations import FORMULATIONS
    from twolink.urdf import read_planar_urdf

    compare = _comparing(contact)
    read = read_planar_urdf(urdf or data_path("twolink.urdf"), tip=tip)
    if formulation is not None and formulation not in FORMULATIONS:
        refuse(choice("--formulation", formulation, FORMULATIONS))
    with progress_bar() as bar:
        task = bar.add_task(f"comparing at {states} states", total=1.0)
        return compare(
            read,
            states=states,
            seed=seed,
            formulations={
                name: found for name, found in FORMULATIONS.items() if formulation in (None, name)
            },
            progress=limits_of(force).timed(
                f"comparing at {states} states", lambda share: bar.update(task, completed=share)
            ),
        )


def _comparing(contact: bool) -> Callable[..., Verdict]:
    """Return the comparison of the equations of motion, or of contact at D."""
    if contact:
        from twolink.verification.contact import verify_contact

        return verify_contact
    from twolink.verification import verify

    return verify


def _print_verdict(verdict: Verdict, contact: bool) -> None:
    """Print the comparisons, and the sentence that sums them up."""
    page = console()
    page.print(f"{Path(verdict.urdf).name} in {verdict.engine}, seed {verdict.seed}\n")
    motion = [c for c in verdict.comparisons if c.source == "Section 6.1"]
    dynamics = [c for c in verdict.comparisons if c.source != "Section 6.1"]
    wide = page.width >= WIDE
    page.print(_table("Contact at D" if contact else "Equations of motion", dynamics, wide))
    if motion:
        page.print(_table("Motion of the points", motion, wide))
    page.print(
        "d/n: worst difference d and tolerance n at that state, both in units\n"
        "in the last place. Agreement means d ≤ n.\n"
    )
    for assumption in verdict.assumptions:
        page.print(assumption)
    page.print(
        verdict.sentence, soft_wrap=True, style="bold green" if verdict.passed else "bold red"
    )
    for comparison in verdict.comparisons:
        if not comparison.passed:
            page.print(
                f"  {comparison.quantity}, {comparison.source} − {comparison.against}: "
                f"{comparison.difference:.17g} {comparison.unit} at {comparison.state}",
                soft_wrap=True,
            )


def _table(title: str, comparisons: list[Comparison], wide: bool) -> Any:
    """Return a table of quantities by sources; the points C1, C2 and D share a row.

    Where the terminal is not `wide`, the engine's names for the quantities are left out.
    """
    from rich import box
    from rich.table import Table

    pairs = list(dict.fromkeys((c.source, c.against) for c in comparisons))
    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
    table.add_column("quantity", no_wrap=True)
    if wide:
        table.add_column("Pinocchio's algorithm", no_wrap=True)
    for source, against in pairs:
        table.add_column(f"{source}\n− {against.split()[0]}", justify="right", no_wrap=True)
    for row in dict.fromkeys(c.quantity.partition(" of ")[0] for c in comparisons):
        inside = [c for c in comparisons if c.quantity.partition(" of ")[0] == row]
        points = dict.fromkeys(c.quantity.partition(" of ")[2] for c in inside)
        label = f"{row} of {', '.join(points)}" if len(points) > 1 else row
        worst = (
            max((c for c in inside if (c.source, c.against) == pair), key=lambda c: c.share)
            for pair in pairs
        )
        names = (label, inside[0].algorithm) if wide else (label,)
        table.add_row(*names, *map(_cell, worst))
    return table


def _cell(comparison: Comparison) -> Text:
    mark = ("✓", "green") if comparison.passed else ("✗", "bold red")
    # Never longer than "<0.01", so that the mark is never cut off.
    units = f"{comparison.units:.2g}" if comparison.units < 100 else f"{comparison.units:.0e}"
    if 0 < comparison.units < 0.01:
        units = "<0.01"
    return styled(f"{units}/{comparison.allowed_units:.0f} ", mark)


def _document(verdict: Verdict) -> dict[str, Any]:
    """Return a verdict and its derived values, for other programs."""
    comparisons = [{**asdict(c), "passed": c.passed} for c in verdict.comparisons]
    return {
        **asdict(verdict),
        "comparisons": comparisons,
        "passed": verdict.passed,
        "sentence": verdict.sentence,
    }
