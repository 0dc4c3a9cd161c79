"""The command `twolink record`: options that do not go together."""

import pytest
from typer.testing import CliRunner

from twolink.cli import app


@pytest.mark.parametrize("suffix", [".html", ".mp4", ".webm", ".gif"])
def test_a_time_goes_with_a_picture_alone(suffix, tmp_path):
    words = ["record", "general", "--at", "3", "--out", str(tmp_path / f"a{suffix}")]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 2
    assert result.stderr == f"twolink: --at must be left out with a {suffix} file; got 3 s\n"
    assert result.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_a_page_has_no_size(tmp_path):
    words = ["record", "general", "--size", "640x480", "--out", str(tmp_path / "a.html")]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 2
    assert result.stderr == (
        "twolink: --size must be left out with a .html file, which fills its window; got both\n"
    )
    assert list(tmp_path.iterdir()) == []


def test_a_choice_that_the_laws_leave_is_printed(tmp_path):
    result = CliRunner().invoke(app, ["record", "elbow_and_tip", "--out", str(tmp_path / "a.html")])
    assert result.exit_code == 0
    assert "do not determine the order of simultaneous impacts" in result.stderr
