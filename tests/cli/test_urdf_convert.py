import pytest
from typer.testing import CliRunner

from tests.urdf.drawing import arm, arm_with_elbow, at, joint, link
from twolink.cli import app
from twolink.cli.urdf_convert import SUFFIXES, Format
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
    out = tmp_path / f"other{suffix}"
    assert run(file, "--to", to, "--out", out).exit_code == 0
    assert out.read_bytes() == file.with_suffix(suffix).read_bytes()


@pytest.mark.parametrize(("to", "name"), [("mjcf", "arm.sdf"), ("sdf", "arm.xml"), ("sdf", "arm")])
def test_a_file_of_another_format_is_no_target(tmp_path, to, name):
    """Programs read a file as its suffix says."""
    result = run(SHIPPED, "--to", to, "--out", tmp_path / name)
    assert result.exit_code == 2
    assert f"--out must be a {SUFFIXES[Format(to)]} file; got " in result.stderr
    assert not any(tmp_path.iterdir())


LOCKED = arm_with_elbow('<limit effort="0" velocity="3"/>')


@pytest.mark.engines
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    ("to", "lost"),
    [
        ("sdf", ["Link 'ground' is", "Fixed joint 'wrist' is"]),
        (
            "mjcf",
            [
                "Links 'ground', 'hand' are",
                "Fixed joint 'wrist' is",
                "The limits of joint 'elbow', 0 to 0 rad, are",
                "The effort limit of joint 'elbow', 0 N m, is",
                "The velocity limit of joint 'elbow', 3 rad/s, is",
            ],
        ),
    ],
)
def test_all_that_is_lost_is_listed(tmp_path, to, lost):
    file = tmp_path / "arm.urdf"
    file.write_text(LOCKED)
    lines = run(file, "--to", to).stdout.splitlines()
    assert lines[1:-1] == [f"{what} not in the {to.upper()}." for what in lost]


@pytest.mark.engines
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("axis", ["1.0 3.6e-12 3.6e-12", "1e-9 1 0"])
def test_an_axis_that_is_almost_one_of_the_frame(tmp_path, axis):
    """Drake took it for this one, so that the file was refused for another mass matrix."""
    file = tmp_path / "arm.urdf"
    inertia = '<inertia ixx="0.9" ixy="0.1" ixz="-0.2" iyy="1.1" iyz="0.3" izz="1.2"/>'
    turned = f'<axis xyz="{axis}"/>'
    inside = f'<inertial><origin xyz="0.5 0.5 0.5"/><mass value="1"/>{inertia}</inertial>'
    shoulder = joint("shoulder", "ground", "upper", inside=turned)
    elbow = joint("elbow", "upper", "lower", inside=turned + at("1 1 1"))
    parts = {"upper": link("upper", inside), "lower": link("lower", inside)}
    file.write_text(arm(shoulder=shoulder, elbow=elbow, **parts))
    result = run(file, "--to", "sdf")
    assert result.exit_code == 0, result.stderr


@pytest.mark.engines
@pytest.mark.filterwarnings("ignore")
def test_a_file_that_the_engine_refuses(tmp_path):
    out = tmp_path / "arm.xml"
    result = run(data_path("import") / "valid" / "thin-rods.urdf", "--to", "mjcf", "--out", out)
    assert (result.exit_code, result.stdout) == (1, "")
    assert "MuJoCo refuses it" in result.stderr
    assert not out.exists()


@pytest.mark.parametrize("to", ["mjcf", "sdf"])
def test_the_input_is_not_replaced_by_default(tmp_path, to):
    file = tmp_path / f"arm{SUFFIXES[Format(to)]}"
    file.write_bytes(SHIPPED.read_bytes())
    result = run(file, "--to", to)
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr == f"twolink: --out must not replace the input {file}; got {file}\n"
    assert file.read_bytes() == SHIPPED.read_bytes()


@pytest.mark.parametrize("folder", [".", "..", "/"])
def test_a_folder_is_refused_as_input(folder):
    result = run(folder, "--to", "sdf")
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr == f"twolink: {folder}: must be a regular file; got a folder\n"


def test_refusals(tmp_path):
    assert run(tmp_path / "none.urdf", "--to", "sdf").exit_code == 2
    assert run(SHIPPED, "--to", "collada").exit_code == 2
    assert run(SHIPPED, "--to", "sdf", "--out", tmp_path / "a" / "b").exit_code == 2
