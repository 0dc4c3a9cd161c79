"""A Python engine as a child: lines in, lines out, and what it prints elsewhere."""

import io
import json
import subprocess
import sys

import pytest

from tests.conformance.arm import Arm
from twolink.conformance.serve import serve
from twolink.engines.messages import ProtocolError, Start, Stop


def test_lines_are_answered_until_stop():
    questions = io.StringIO("\n".join([Start().line(), Stop().line(), "not read"]))
    answers = io.StringIO()
    serve(Arm(), questions, answers)
    (line,) = answers.getvalue().splitlines()
    assert json.loads(line)["engine"]["name"] == "arm"


def test_what_is_no_request_ends_it():
    with pytest.raises(ProtocolError, match="must be one JSON object"):
        serve(Arm(), io.StringIO("what?\n"), io.StringIO())


def test_what_an_engine_prints_does_not_disturb(tmp_path):
    (tmp_path / "loud.py").write_text(
        "from tests.conformance.arm import Arm\nprint('a banner')\nclass Loud(Arm):\n    pass\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", "twolink.conformance.serve", "loud:Loud"],
        input=Start().line() + "\n",
        capture_output=True,
        text=True,
        check=True,
        env={"PYTHONPATH": f"{tmp_path}:{':'.join(sys.path)}"},
    )
    assert json.loads(done.stdout)["version"] == 1
    assert "a banner" in done.stderr
