import pytest
from typer.testing import CliRunner

from tests.urdf.robots import edited
from twolink.cli import app
from twolink.data import data_path

FAULTY = edited(('<link name="base"/>', ""))


def run(*arguments: str):
    return CliRunner().invoke(app, ["urdf", "repair", *arguments])


@pytest.mark.slow
def test_a_file_is_repaired(tmp_path):
    file, out = tmp_path / "arm.urdf", tmp_path / "sound.urdf"
    file.write_text(FAULTY)
    result = run(str(file), "--out", str(out))
    assert result.exit_code == 0
    for words in ("declared link 'base'", "comparisons agree at 200 states", str(out)):
        assert words in result.stdout
    once = out.read_bytes()
    again = run(str(out), "--out", str(tmp_path / "again.urdf"))
    assert "nothing to repair" in again.stdout
    assert (tmp_path / "again.urdf").read_bytes() == once
    run(str(file), "--out", str(out))
    assert out.read_bytes() == once
    assert file.read_text() == FAULTY


def test_a_valid_file_is_written_unchanged(tmp_path):
    out = tmp_path / "sound.urdf"
    assert "nothing to repair" in run(str(data_path("twolink.urdf")), "--out", str(out)).stdout
    assert out.read_bytes() == data_path("twolink.urdf").read_bytes()


def test_refusals(tmp_path):
    file, out = tmp_path / "arm.urdf", tmp_path / "sound.urdf"
    file.write_text("<sdf/>")
    result = run(str(file), "--out", str(out))
    assert (result.exit_code, result.stdout) == (2, "")
    assert "this is SDF" in result.stderr
    assert not out.exists()
    assert run(str(file), "--out", str(tmp_path / "nowhere" / "x")).exit_code == 2


def test_a_file_that_pinocchio_refuses_still(tmp_path):
    file, out = tmp_path / "arm.urdf", tmp_path / "sound.urdf"
    broken = '<axis xyz="0 1.0 0"/><safety_controller k_velocity="x"/>'
    file.write_text(edited(('<axis xyz="0 1.0 0"/>', broken)))
    result = run(str(file), "--out", str(out))
    assert result.exit_code == 1
    assert "Pinocchio rejects the file" in result.stderr
    assert not out.exists()
