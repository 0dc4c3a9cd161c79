"""Motions that commands show, and their notes."""

from dataclasses import replace

from tests.viz.films import trajectory_of
from twolink.cli.trajectories import print_notes


def test_the_notes_on_all_motions_are_printed_once(capsys):
    first = replace(trajectory_of("general", 0.1, 3), notes=("one", "two"))
    print_notes([first, replace(first, notes=("two", "three"))])
    assert capsys.readouterr().err == "one\ntwo\nthree\n"
