"""Names of engines: commands, objects, registered names, and entry points."""

import sys
import textwrap

import pytest

from tests.conformance.arm import Arm
from twolink.conformance.suites import suite
from twolink.engines.attach import attach, python_engine, registered
from twolink.engines.faults import EngineFault
from twolink.engines.in_process import InProcess
from twolink.engines.messages import Model, Start
from twolink.engines.process import ProcessTransport
from twolink.errors import EngineError


def test_an_engine_is_found_by_its_path():
    assert isinstance(python_engine("tests.conformance.arm:Arm"), Arm)


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("no.such.module:Engine", "cannot be imported"),
        ("tests.conformance.arm:Leg", "cannot be imported"),
        ("tests.conformance.arm:EYE", "must be a twolink.conformance.contract.Engine"),
        ("math:pi", "must be a twolink.conformance.contract.Engine; got 3.14"),
    ],
)
def test_objects_that_are_no_engines(path, words):
    with pytest.raises(EngineError, match=words):
        python_engine(path)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("pinnochio", "did you mean 'Pinocchio'"),
        ("cmd:", "must be words; got none"),
        ("cmd: 'x", "must be words"),
        ("cmd: /no/such/engine", "/no/such/engine: there is no such command"),
        ("a b:c", "engine must be one of"),
        ("fmu:", "fmu: must be followed by the name of a file; got none"),
    ],
)
def test_names_that_are_not_known(name, words):
    with pytest.raises(EngineError, match=words):
        attach(name)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("in_process", [True, False])
def test_pinocchio_is_registered(in_process):
    transport = attach("Pinocchio", in_process=in_process)()
    assert isinstance(transport, InProcess if in_process else ProcessTransport)
    try:
        assert transport.ask(Start(), 60.0).engine.name == "Pinocchio"
        plain = suite("import")[0]
        assert transport.ask(plain.request(("urdf",)), 60.0).understood.mass == (1.0, 1.0)
        assert "XML" in transport.ask(Model(id="none", urdf="<robot>"), 60.0).refused
    finally:
        transport.close()


def test_packages_register_engines_by_entry_points(tmp_path, monkeypatch):
    package = tmp_path / "mine-1.0.dist-info"
    package.mkdir()
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    (package / "entry_points.txt").write_text(
        textwrap.dedent(
            """
            [twolink.engines]
            Mine = tests.conformance.arm:Arm
            """
        )
    )
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    assert registered()["Mine"] == "tests.conformance.arm:Arm"
    transport = attach("mine", in_process=True)()
    assert transport.ask(Start(), 1.0).engine.name == "arm"


@pytest.mark.slow
def test_a_python_engine_that_is_not_there_does_not_start():
    transport = attach("no_such_module:Engine")()
    with pytest.raises(EngineFault, match="cannot be imported: No module named 'no_such_module'"):
        transport.ask(Start(), 60.0)
    transport.close()
