"""Conversions, read back by MuJoCo and Drake: every valid file of the import suite."""

from dataclasses import replace

import pytest

from tests.import_suite.index import FOLDER, VALID, named
from twolink.engines import urdf_conversion
from twolink.engines.urdf_conversion import FORMATS, convert
from twolink.errors import EngineError
from twolink.urdf import read_planar_urdf

pytestmark = [pytest.mark.engines, pytest.mark.filterwarnings("ignore")]

# Files of the import suite that MuJoCo refuses (test_engines), or only the other engine reads.
REFUSED = {("mjcf", "thin-rods"), ("mjcf", "millimetres")}


@pytest.mark.parametrize("test", VALID, ids=named)
@pytest.mark.parametrize("to", FORMATS)
def test_files_of_the_import_suite(test, to):
    read = read_planar_urdf(FOLDER / test["file"])
    if (to, named(test)) in REFUSED:
        with pytest.raises(EngineError, match="MuJoCo refuses it"):
            convert(read, to)
        return
    made = convert(read, to)
    assert max(made.difference, made.of_forces) <= (1e-5 if to == "mjcf" else 1e-13)


@pytest.mark.parametrize("to", FORMATS)
def test_a_conversion_to_another_chain_is_caught(to):
    read = read_planar_urdf(FOLDER / "valid" / "general.urdf")
    heavier = replace(read.links[1], mass=read.links[1].mass * 1.001)
    with pytest.raises(EngineError, match="must find the same mass matrix"):
        convert(replace(read, links=(read.links[0], heavier)), to)


@pytest.mark.parametrize("to", FORMATS)
@pytest.mark.parametrize("name", ["general", "horizontal", "oblique-gravity"])
def test_a_conversion_that_stands_elsewhere_is_caught(to, name):
    """A turn of the whole arm changes gravity in its plane, and not the mass matrix."""
    read = read_planar_urdf(FOLDER / "valid" / f"{name}.urdf")
    turned = replace(read, gravity=read.gravity + 0.01)
    with pytest.raises(EngineError, match="must find the same gravity and velocity terms"):
        convert(turned, to)


def test_a_rotation_that_is_wrong_in_the_text_is_caught(monkeypatch):
    real = urdf_conversion.sdf_of

    def turned(text, *, source):
        old = '<link name="upper">\n    <pose>0.0 0.0 0.0 0.0 '
        made = real(text, source=source)
        assert old in made
        return made.replace(old, old.replace("0.0 0.0 0.0 0.0 ", "0.0 0.0 0.0 1e-9 "))

    monkeypatch.setattr(urdf_conversion, "sdf_of", turned)
    read = read_planar_urdf(FOLDER / "valid" / "horizontal.urdf")
    with pytest.raises(EngineError, match="must find the same gravity and velocity terms"):
        convert(read, "sdf")


def test_an_engine_that_is_missing(monkeypatch):
    import builtins

    real = builtins.__import__

    def absent(name, *rest):
        if name.split(".")[0] in ("mujoco", "pydrake"):
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", absent)
    read = read_planar_urdf(FOLDER / "valid" / "general.urdf")
    for to in FORMATS:
        with pytest.raises(EngineError, match="is not installed"):
            urdf_conversion.convert(read, to)
