import pytest
from typer.testing import CliRunner

from twolink.chain import Chain
from twolink.cli import app
from twolink.data import data_path
from twolink.urdf import read_planar_urdf


def run(*arguments: object):
    return CliRunner().invoke(app, ["urdf", "write", *map(str, arguments)])


def test_the_default_parameters_give_the_shipped_file(tmp_path):
    out = tmp_path / "arm.urdf"
    result = run("--out", out)
    assert (result.exit_code, result.stdout.split()) == (0, [str(out)])
    assert out.read_bytes() == data_path("twolink.urdf").read_bytes()


def test_every_parameter(tmp_path):
    out = tmp_path / "arm.urdf"
    result = run(
        *("--out", out, "--mass", 2, 3, "--length", 1, 0.5, "--centre", 0.4, 0.1, 0.2, -0.3),
        *("--inertia", 0.7, 0.2, "--joint", "revolute", "--limits", -1, 2, -3, 0.5),
        *("--damping", 0.1, 0.2, "--friction", 0.3, 0.4, "--name", "mine"),
    )
    assert result.exit_code == 0
    read = read_planar_urdf(out)
    chain = Chain((2.0, 3.0), (1.0, 0.5), ((0.4, 0.1), (0.2, -0.3)), (0.7, 0.2))
    assert Chain.from_links(read.links) == chain
    assert read.limits == ((-1.0, 2.0), (-3.0, 0.5))
    assert (read.damping, read.friction) == ((0.1, 0.2), (0.3, 0.4))


def test_a_link_of_no_length_has_no_bar(tmp_path):
    """Its D is at B; its mass centre and inertia are given."""
    out = tmp_path / "arm.urdf"
    result = run(
        "--out", out, "--length", 1, 0, "--centre", 0.5, 0, 0.2, 0.1, "--inertia", 0.1, 0.1
    )
    assert result.exit_code == 0, result.stderr
    chain = Chain((1.0, 1.0), (1.0, 0.0), ((0.5, 0.0), (0.2, 0.1)), (0.1, 0.1))
    assert Chain.from_links(read_planar_urdf(out).links) == chain


@pytest.mark.parametrize(
    ("given", "chain"),
    [
        (
            ["--inertia", 0.7, 0.2],
            Chain((1.0, 1.0), (1.0, 1.0), ((0.5, 0.0), (0.5, 0.0)), (0.7, 0.2)),
        ),
        (
            ["--centre", 0.4, 0.1, 0.2, -0.3],
            Chain((1.0, 1.0), (1.0, 1.0), ((0.4, 0.1), (0.2, -0.3)), (1 / 12, 1 / 12)),
        ),
    ],
)
def test_what_is_not_given_is_that_of_bars(given, chain, tmp_path):
    out = tmp_path / "arm.urdf"
    assert run("--out", out, *given).exit_code == 0
    assert Chain.from_links(read_planar_urdf(out).links) == chain


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--mass", "-1", "1"], "mass must be a positive"),
        (["--length", "0", "1"], "length must be a positive"),
        (["--length", "1", "0"], "length must be a positive"),
        (["--length", "1", "0", "--inertia", "1", "1"], "length must be a positive"),
        (["--inertia", "-1", "1"], "inertia must be zero or a positive"),
        (["--joint", "revolute"], "--joint revolute needs --limits"),
        (["--joint", "continuous", "--limits", "0", "1", "0", "1"], "--joint must be revolute"),
        (["--limits", "1", "0", "0", "1"], "limits must be a lower angle below an upper one"),
        (["--damping", "-1", "0"], "damping must be zero"),
        (["--name", ""], "name must be printable"),
    ],
)
def test_refusals(tmp_path, arguments, words):
    out = tmp_path / "arm.urdf"
    result = run("--out", out, *arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    assert words in result.stderr
    assert result.stderr.count("\n") == 1
    assert not out.exists()


def test_a_target_with_another_suffix_is_refused(tmp_path):
    assert run("--out", tmp_path / "arm.txt").exit_code == 2
