"""FMU files: wrong ones are refused in one sentence, before a binary is loaded."""

import pytest

from tests.engines.fmus import DESCRIPTION, binary, zipped
from twolink.engines.attach import attach
from twolink.engines.fmu_file import read_fmu
from twolink.errors import EngineError

pytestmark = pytest.mark.engines


def chain(tmp_path, description=DESCRIPTION, files=None):
    names = [binary()] if files is None else files
    return zipped(tmp_path / "chain.fmu", description, dict.fromkeys(names, b"no binary"))


def changed(old, new):
    assert old in DESCRIPTION
    return DESCRIPTION.replace(old, new)


def test_the_example_has_all_capabilities(tmp_path):
    file = read_fmu(chain(tmp_path))
    assert file.exchanges
    assert file.simulates
    assert not file.fmi3
    assert file.states == (0, 1, 2, 3)
    assert file.effects == ("joint_damping", "armature")
    assert file.quantities == ("kinetic_energy", "potential_energy", "position", "velocity")


def test_states_in_another_order_and_under_other_names(tmp_path):
    """A state is known by its number: variables of one number are one variable."""
    text = changed('"angle1" valueReference="17"', '"joint.phi" valueReference="17"')
    text = text.replace(
        "  </ModelVariables>",
        '    <ScalarVariable name="angle1" valueReference="17" initial="exact">\n'
        '      <Real unit="rad" start="0"/>\n    </ScalarVariable>\n  </ModelVariables>',
    )
    text = text.replace('<Unknown index="22"/>', "@", 1).replace('<Unknown index="25"/>', "#", 1)
    text = text.replace("@", '<Unknown index="25"/>').replace("#", '<Unknown index="22"/>')
    assert read_fmu(chain(tmp_path, text)).states == (3, 1, 2, 0)


@pytest.mark.parametrize(
    ("description", "words"),
    [
        (None, "must have a modelDescription.xml; got 1 other files"),
        ("<fmiModelDescription", "modelDescription.xml must be one of FMI 2.0 or 3.0; got"),
        (changed('fmiVersion="2.0"', 'fmiVersion="4.0"'), "got Unsupported FMI version: 4.0"),
        (changed('"mass1"', '"m1"').replace('"speed2"', '"w2"'), "variables mass1, speed2; got"),
        (changed('"gravity"', '"g"'), "must have the variables gravity; got none"),
        (
            changed('causality="input"', 'causality="local"'),
            "the causality of torque1 must be input; got local",
        ),
        (
            changed('initial="exact"', 'initial="calculated"'),
            "the initial of angle1 must be exact or approx; got calculated",
        ),
        (
            changed('<BaseUnit rad="1"/>', '<BaseUnit rad="1" factor="0.0174532925199433"/>'),
            "angle1 must be in SI units and rad; got rad, which is 0.0174533 of one",
        ),
        (
            changed('<Real unit="kg" start="1"/>', '<Integer start="1"/>'),
            "mass1 must be one Real or Float64; got Integer",
        ),
        (
            changed('      <Unknown index="24"/>\n      <Unknown index="25"/>\n    </D', "    </D"),
            "its states must be angle1, angle2, speed1, speed2; got angle1, angle2",
        ),
        (
            changed('<ModelExchange modelIdentifier="chain"/>', "").replace("CoSim", "Sim"),
            "must be for Model Exchange or Co-Simulation; it is for neither",
        ),
    ],
)
def test_wrong_descriptions(tmp_path, description, words):
    path = chain(tmp_path, description)
    with pytest.raises(EngineError) as error:
        attach(f"fmu:{path}")
    assert str(error.value).startswith(f"{path}: ")
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("files", "got"),
    [
        ((), "no binary"),
        (("binaries/win64/chain.dll",), "binaries/win64/chain.dll"),
        (("binaries/linux/a.so", "binaries/linux/"), "binaries/linux/a.so"),
    ],
)
def test_no_binary_for_this_platform(tmp_path, files, got):
    path = chain(tmp_path, files=files)
    with pytest.raises(EngineError) as error:
        attach(f"fmu:{path}")
    assert str(error.value) == f"{path}: must have {binary()} for this platform; got {got}"


def test_files_that_are_no_fmus(tmp_path):
    with pytest.raises(EngineError, match=r"none\.fmu: there is no file of this name"):
        attach(f"fmu:{tmp_path}/none.fmu")
    with pytest.raises(EngineError, match="must be a regular file; got a folder"):
        attach(f"fmu:{tmp_path}")
    (tmp_path / "text.fmu").write_text("not a ZIP file")
    with pytest.raises(EngineError, match=r"text\.fmu: must be a ZIP file; got another one"):
        attach(f"fmu:{tmp_path}/text.fmu")
