import pytest
from typer.testing import CliRunner

from twolink.cli import app
from twolink.data import data_path

SHIPPED = data_path("twolink.urdf")


def run(*arguments: object):
    return CliRunner().invoke(app, ["urdf", "convert", *map(str, arguments)])


@pytest.mark.engines
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    ("to", "suffix", "engine"), [("mjcf", ".xml", "MuJoCo"), ("sdf", ".sdf", "Drake")]
)
def test_a_file_is_converted(tmp_path, to, suffix, engine):
    file = tmp_path / "arm.urdf"
    file.write_bytes(SHIPPED.read_bytes())
    result = run(file, "--to", to)
    assert result.exit_code == 0
    assert engine in result.stdout
    assert file.with_suffix(suffix).exists()
    out = tmp_path / "other.txt"
    assert run(file, "--to", to, "--out", out).exit_code == 0
    assert out.read_bytes() == file.with_suffix(suffix).read_bytes()


@pytest.mark.engines
@pytest.mark.filterwarnings("ignore")
def test_a_file_that_the_engine_refuses(tmp_path):
    out = tmp_path / "arm.xml"
    result = run(data_path("import") / "valid" / "thin-rods.urdf", "--to", "mjcf", "--out", out)
    assert (result.exit_code, result.stdout) == (1, "")
    assert "MuJoCo refuses it" in result.stderr
    assert not out.exists()


def test_refusals(tmp_path):
    assert run(tmp_path / "none.urdf", "--to", "sdf").exit_code == 2
    assert run(SHIPPED, "--to", "collada").exit_code == 2
    assert run(SHIPPED, "--to", "sdf", "--out", tmp_path / "a" / "b").exit_code == 2
