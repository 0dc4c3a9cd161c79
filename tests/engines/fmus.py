"""FMUs of the chain in examples/fmu, compiled for tests."""

import os
import re
import shutil
import subprocess
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import pytest

FOLDER = Path(__file__).parents[2] / "examples" / "fmu"
SOURCE = (FOLDER / "chain.c").read_text(encoding="utf-8")
DESCRIPTION = (FOLDER / "modelDescription.xml").read_text(encoding="utf-8")


def require_compiler():
    if shutil.which("cc") is None:
        assert not os.environ.get("TWOLINK_REQUIRE_TOOLS"), "cc is not installed"
        pytest.skip("cc is not installed: examples/fmu/chain.c is not checked")


def binary(*, fmi3=False):
    """Return the place of the chain's binary in an FMU."""
    import fmpy

    place = fmpy.platform_tuple if fmi3 else fmpy.platform
    return f"binaries/{place}/chain{fmpy.sharedLibraryExtension}"


def built(folder, source=SOURCE, description=DESCRIPTION, *, fmi3=False):
    """Return the FMU of a C source and a description, in a folder."""
    require_compiler()
    (folder / "chain.c").write_text(source, encoding="utf-8")
    file = "chain.c"
    if fmi3:
        description = of_fmi3(description)
        shutil.copy(Path(__file__).with_name("chain_fmi3.c"), folder)
        (folder / "missing.h").write_text(missing_functions(), encoding="utf-8")
        file = "chain_fmi3.c"
    library = binary(fmi3=fmi3)
    (folder / library).parent.mkdir(parents=True)
    flags = "-Wall -Wextra -Werror -O2 -shared -fPIC"
    command = ["cc", *flags.split(), "-o", library, file, "-lm"]
    subprocess.run(command, cwd=folder, check=True, timeout=120)
    return zipped(folder / "chain.fmu", description, {library: (folder / library).read_bytes()})


def zipped(path, description, files):
    """Write an FMU of a description, if there is one, and files; return its path."""
    with zipfile.ZipFile(path, "w") as archive:
        if description is not None:
            archive.writestr("modelDescription.xml", description)
        for name, content in files.items():
            archive.writestr(name, content)
    return path


def of_fmi3(description):
    """Return a description of FMI 2.0 as one of FMI 3.0."""
    old = ElementTree.fromstring(description)
    new = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=old.get("modelName"),
        instantiationToken=old.get("guid"),
    )
    new.extend(child for child in old if child.tag in ("ModelExchange", "CoSimulation"))
    new.append(old.find("UnitDefinitions"))
    variables = ElementTree.SubElement(new, "ModelVariables")
    for variable in old.find("ModelVariables"):
        number = variable.find("Real").attrib
        if "derivative" in number:
            number["derivative"] = str(int(number["derivative"]) - 1)
        ElementTree.SubElement(variables, "Float64", {**variable.attrib, **number})
    structure = ElementTree.SubElement(new, "ModelStructure")
    names = {"Outputs": "Output", "Derivatives": "ContinuousStateDerivative"}
    for tag, name in names.items():
        for unknown in old.find(f"ModelStructure/{tag}"):
            reference = str(int(unknown.get("index")) - 1)
            ElementTree.SubElement(structure, name, valueReference=reference)
    return ElementTree.tostring(new, encoding="unicode")


def missing_functions():
    """Return C of the functions of FMI 3.0 that the chain does not offer; they must exist."""
    from fmpy.fmi3 import FMU3Model, FMU3Slave

    source = Path(__file__).with_name("chain_fmi3.c").read_text(encoding="utf-8")
    there = set(re.findall(r"\b(fmi3\w+)\(", source))
    names = {name for kind in (FMU3Model, FMU3Slave) for name in dir(kind)}
    wanted = sorted(name for name in names - there if re.match("fmi3[A-Z]", name))
    return "".join(f"NOT_OFFERED({name})\n" for name in wanted)
