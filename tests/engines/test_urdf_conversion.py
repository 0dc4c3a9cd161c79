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
    assert made.difference <= (1e-5 if to == "mjcf" else 1e-13)


@pytest.mark.parametrize("to", FORMATS)
def test_a_conversion_to_another_chain_is_caught(to):
    read = read_planar_urdf(FOLDER / "valid" / "general.urdf")
    heavier = replace(read.links[1], mass=read.links[1].mass * 1.001)
    with pytest.raises(EngineError, match="must find the same mass matrix"):
        convert(replace(read, links=(read.links[0], heavier)), to)


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
