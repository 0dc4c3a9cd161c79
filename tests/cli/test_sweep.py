import json

import pytest
from typer.testing import CliRunner

from twolink.cli import app
from twolink.ensembles.file import load
from twolink.ensembles.quantities import QUANTITIES
from twolink.ensembles.store import created

TEXT = """
title = "Six starts"
scene = "free_fall"
[[axes]]
parameter = "start.q.0"
grid = {first = -3.0, last = 3.0, count = 6}
[runs]
duration = 1.0
accuracy = 1e-6
[keep]
final = true
first = [{name = "flip"}]
"""


@pytest.fixture
def file(tmp_path):
    made = tmp_path / "sweep.toml"
    made.write_text(TEXT)
    return made


def run(*words):
    return CliRunner().invoke(app, ["sweep", *map(str, words)])


@pytest.mark.slow
def test_a_sweep_is_run_and_summed_up(file, tmp_path):
    result = run(file, "--out", tmp_path / "a.zarr", "--workers", 1)
    assert result.exit_code == 0, result.output
    assert "Six starts" in result.output
    assert "6 of 6" in result.output
    again = run(file, "--out", tmp_path / "a.zarr")
    assert again.output == result.output


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--out", "{}/a.nc"], "--out must be a .zarr folder; got"),
        (["--out", "{}/none/a.zarr"], "--out must be in a folder that exists; got"),
        (["--out", "{}/" + "a" * 300 + ".zarr"], "--out must be a folder that can be written to"),
        (["--out", "/proc/a.zarr"], "--out must be a folder that can be written to or made; got"),
        (["--out", "{}/a.zarr", "--workers", "0"], "--workers must be a whole number of 1 or more"),
        (["--out", "{}/a.zarr", "--dask", "tcp://h:1", "--workers", "2"], "--workers must be left"),
        ([], "--out is missing"),
    ],
)
def test_options_that_make_no_sense_are_refused(file, tmp_path, words, sentence):
    result = run(file, *[word.format(tmp_path) for word in words])
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert not (tmp_path / "a.zarr").exists()


def test_the_schema_has_every_key_of_sweeps_and_scenes():
    result = run("--schema")
    assert result.exit_code == 0
    schema = json.loads(result.stdout)
    assert set(schema["properties"]) == {"title", "scene", "axes", "runs", "keep"}
    assert set(schema["$defs"]["Keep"]["properties"]) == set(QUANTITIES)
    kinds = schema["properties"]["scene"]["anyOf"]
    assert [kind.get("type", kind.get("$ref")) for kind in kinds] == ["string", "#/$defs/Scene"]
    assert schema["$defs"]["Scene"]["properties"]["effects"]


def test_a_file_that_is_no_sweep_is_refused(tmp_path):
    (tmp_path / "a.toml").write_text("title = 3")
    result = run(tmp_path / "a.toml", "--out", tmp_path / "a.zarr")
    assert result.exit_code == 2
    assert "must be a valid string; got 3" in result.stderr or "'scene' is missing" in result.stderr


def test_the_results_of_another_sweep_are_refused(file, tmp_path):
    store = created(tmp_path / "a.zarr", load(file), 6)
    file.write_text(TEXT.replace("count = 6", "count = 7"))
    result = run(file, "--out", store.path)
    assert result.exit_code == 2
    assert "a.zarr: must be the result of this sweep, or not exist; got that" in result.stderr
    assert result.stderr.count("\n") == 1
    assert not store.done().any()


@pytest.mark.parametrize(
    ("before", "after"),
    [("grid =", f'name = "{"a" * 300}"\ngrid ='), ('"flip"', f'"{"a" * 300}"')],
    ids=["axis", "quantity"],
)
def test_names_that_no_file_can_have_are_refused(before, after, file, tmp_path):
    file.write_text(TEXT.replace(before, after))
    result = run(file, "--out", tmp_path / "a.zarr")
    assert result.exit_code == 2
    assert "must have 255 bytes or fewer; got 'aaa" in result.stderr
    assert result.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == [file]


SECOND = """
[[axes]]
parameter = "start.u.0"
values = [0.0, 1.0]
"""


@pytest.mark.parametrize(
    ("before", "after", "sentence"),
    [
        ('first = [{name = "flip"}]', "", "--plot must be of a sweep that keeps first times"),
        ("", "", "--plot must be of a sweep that keeps samples for a .html page; got one without"),
        ("final = true", "samples = 3", "--plot must be of a sweep over two axes for a .html page"),
    ],
)
def test_a_page_of_a_map_needs_samples_of_two_axes(before, after, sentence, file, tmp_path):
    file.write_text(TEXT.replace(before, after) if before else TEXT)
    page = tmp_path / "map.html"
    result = run(file, "--out", tmp_path / "a.zarr", "--plot", page)
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert list(tmp_path.iterdir()) == [file]


def test_one_value_twice_makes_no_second_axis(file, tmp_path):
    """The page is refused before the sweep, which may take hours."""
    twice = SECOND.replace("[0.0, 1.0]", "[1.0, 1.0]")
    head, runs, rest = TEXT.partition("[runs]")
    file.write_text(head + twice + runs + rest.replace("final = true", "samples = 3"))
    result = run(file, "--out", tmp_path / "a.zarr", "--plot", tmp_path / "map.html")
    assert result.exit_code == 2
    assert "--plot must be of a sweep over two axes for a .html page" in result.stderr
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.slow
def test_maps_are_drawn_and_have_a_page(file, tmp_path):
    head, runs, rest = TEXT.partition("[runs]")
    file.write_text(head + SECOND + runs + rest.replace("final = true", "samples = 3"))
    for name, begins in (("map.svg", "<?xml"), ("map.html", "<!doctype html>")):
        place = tmp_path / name
        result = run(file, "--out", tmp_path / "a.zarr", "--plot", place, "--workers", 1)
        assert result.exit_code == 0, result.output
        assert place.read_text().startswith(begins)
