"""The command `twolink verify`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twolink.cli.limits import Force, limits_of
from twolink.cli.progress import progress_bar
from twolink.cli.terminal import (
    FAILED,
    check_target,
    console,
    print_table,
    refuse,
    write_json,
)
from twolink.names import FORMULATION_NAMES
from twolink.text import choice, either

if TYPE_CHECKING:
    from twolink.verification import Verdict

_Urdf = Annotated[
    Path | None,
    typer.Option(help="A URDF of a planar two-link chain. Default: the shipped chain."),
]
_States = Annotated[int, typer.Option(help="How many random states to compare at.")]
_Seed = Annotated[int, typer.Option(help="Seed of the random states.")]
_Formulation = Annotated[
    str | None,
    typer.Option(help=f"Check this one alone: {either(FORMULATION_NAMES)}. Default: all."),
]
_Tip = Annotated[str | None, typer.Option(help="The URDF's link to take as the free end D.")]
_Contact = Annotated[
    bool,
    typer.Option(
        "--contact",
        help="Compare contact at D instead: impacts, constraint forces, a given force.",
    ),
]
_JsonFile = Annotated[
    Path | None, typer.Option("--json", help="Write the verdict to this file as JSON.")
]


def verify(
    urdf: _Urdf = None,
    states: _States = 10_000,
    seed: _Seed = 1,
    formulation: _Formulation = None,
    tip: _Tip = None,
    contact: _Contact = False,
    json_file: _JsonFile = None,
    force: Force = False,
) -> None:
    """Check Kane's and Lagrange's equations against Pinocchio.

    At random states, each quantity of each formulation is compared with Pinocchio's, and Kane's
    with Lagrange's. Exit code 0: all agree. 1: some do not. 2: the input was refused.
    """
    if states < 1:
        refuse(f"--states must be a positive whole number; got {states}")
    if seed < 0:
        refuse(f"--seed must be zero or a positive whole number; got {seed}")
    check_target("--json", json_file, inputs=[urdf])
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
            progress=lambda share: bar.update(task, completed=share),
            limits=limits_of(force),
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
    from twolink.verification.verdict import KEY

    page = console()
    page.print(f"{Path(verdict.urdf).name} in {verdict.engine}, seed {verdict.seed}\n")
    for table in verdict.tables("Contact at D" if contact else "Equations of motion"):
        print_table(page, table)
    page.print(f"{KEY}\n", soft_wrap=True)
    for assumption in verdict.assumptions:
        page.print(assumption, soft_wrap=True)
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


def _document(verdict: Verdict) -> dict[str, Any]:
    """Return a verdict and its derived values, for other programs."""
    comparisons = [{**asdict(c), "passed": c.passed} for c in verdict.comparisons]
    return {
        **asdict(verdict),
        "comparisons": comparisons,
        "passed": verdict.passed,
        "sentence": verdict.sentence,
    }
