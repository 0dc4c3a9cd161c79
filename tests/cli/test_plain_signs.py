"""Terminals whose encoding lacks Greek letters or the minus sign."""

import os
import subprocess
import sys

import pytest

from twolink.cli.plain_signs import plain
from twolink.simulation.hybrid.mode import with_minus


def test_signs_and_letters_have_a_likeness():
    assert plain("θ1 = −0.5 rad, ω·Δt → m/s², kg m² ≤ 3…") == (
        "theta1 = -0.5 rad, omega*Deltat -> m/s^2, kg m^2 <= 3..."
    )
    assert plain("é 猫") == "e ?"
    assert plain(with_minus(-5.507)) == "-5.507"


@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["simulate", "drop"], "normal speed -5.507 m/s at first"),
        (["urdf", "show", "models/twolink.urdf"], "q2 = q1 + theta2 + 0"),
    ],
)
def test_no_sign_is_lost_in_other_encodings(words, line, encoding):
    ended = subprocess.run(
        [sys.executable, "-m", "twolink", *words],
        env=os.environ | {"PYTHONIOENCODING": encoding},
        capture_output=True,
        check=True,
    )
    text = ended.stdout.decode(encoding)
    assert line in text
    assert "?" not in text
