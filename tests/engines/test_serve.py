"""A Python engine as a child: lines in, lines out, and its prints on the standard error."""

import io
import json
import subprocess
import sys

import pytest

from tests.conformance.arm import Arm
from twolink.engines.messages import ProtocolError, Start, Stop
from twolink.engines.serve import serve


def test_lines_are_answered_until_stop():
    questions = io.StringIO("\n".join([Start().line(), Stop().line(), "not read"]))
    answers = io.StringIO()
    serve(Arm(), questions, answers)
    (line,) = answers.getvalue().splitlines()
    assert json.loads(line)["engine"]["name"] == "arm"


def test_an_invalid_request_ends_the_server():
    with pytest.raises(ProtocolError, match="must be one JSON object"):
        serve(Arm(), io.StringIO("what?\n"), io.StringIO())


@pytest.mark.slow
def test_an_engine_s_prints_do_not_mix_with_the_messages(tmp_path):
    (tmp_path / "loud.py").write_text(
        "from tests.conformance.arm import Arm\nprint('a banner')\nclass Loud(Arm):\n    pass\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", "twolink.engines.serve", "loud:Loud"],
        input=Start().line() + "\n",
        capture_output=True,
        text=True,
        check=True,
        env={"PYTHONPATH": f"{tmp_path}:{':'.join(sys.path)}"},
    )
    assert json.loads(done.stdout)["version"] == 1
    assert "a banner" in done.stderr
