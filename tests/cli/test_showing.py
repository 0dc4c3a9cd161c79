"""Films: frames that memory cannot hold are refused with an estimate."""

import tracemalloc
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from tests.viz.films import trajectory_of
from twolink.cli import app
from twolink.cli.showing import check_frames
from twolink.data import data_path
from twolink.errors import TooMuchError
from twolink.limits import DEFAULT_LIMITS
from twolink.viz.film import Film
from twolink.viz.run import Run

FALL = str(data_path("scenes") / "free_fall.toml")


@pytest.mark.parametrize("options", [["--fps", "240", "--speed", "0.001"], ["--speed", "1e-6"]])
def test_too_many_frames_are_refused(options, tmp_path):
    out = tmp_path / "never.html"
    result = CliRunner().invoke(app, ["record", FALL, "--out", str(out), *options])
    assert result.exit_code == 2
    assert "of memory; the limit is 4 GB" in result.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("fps", "speed"), [(1.0, 0.1), (30.0, 1.0), (30.0, 10.0), (240.0, 1.0)])
def test_the_estimate_of_memory_is_no_less_than_what_a_film_takes(fps, speed):
    film = Film((Run("general", trajectory_of("general", 10.0, 11)),), fps=fps, speed=speed)
    tracemalloc.start()
    try:
        assert film.moments[0].times[-1] == 10.0
        _, taken = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    allowed = replace(DEFAULT_LIMITS, memory=taken)
    with pytest.raises(TooMuchError, match="of memory"):
        check_frames(10.0, fps, speed, 0, allowed)
