"""Films: frames that memory cannot hold are refused with an estimate."""

import pytest
from typer.testing import CliRunner

from twolink.cli import app
from twolink.data import data_path

FALL = str(data_path("scenes") / "free_fall.toml")


@pytest.mark.parametrize("options", [["--fps", "240", "--speed", "0.001"], ["--speed", "1e-6"]])
def test_too_many_frames_are_refused(options, tmp_path):
    out = tmp_path / "never.html"
    result = CliRunner().invoke(app, ["record", FALL, "--out", str(out), *options])
    assert result.exit_code == 2
    assert "of memory; the limit is 4 GB" in result.stderr
    assert not list(tmp_path.iterdir())
