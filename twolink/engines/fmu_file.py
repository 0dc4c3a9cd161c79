"""An FMU file: its description, and the variables of a planar chain in it, by name.

A Functional Mock-up Unit (FMI 2.0 or 3.0, https://fmi-standard.org) is a ZIP file with a
description of its variables and a binary for each platform. No binary is loaded to read the
description.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from twolink.engines.messages import Effect, Parameters
from twolink.errors import EngineError, FileError
from twolink.files import check_readable, scratch_folder
from twolink.text import one_line

STATES = ("angle1", "angle2", "speed1", "speed2")
"""Angles (rad) and speeds (rad/s) of the joints."""

TORQUES = ("torque1", "torque2")
"""Inputs: torques of the joints (N m)."""

OUTPUTS: Mapping[str, tuple[str, ...]] = {
    "kinetic_energy": ("kinetic_energy",),
    "potential_energy": ("potential_energy",),
    "position": ("position_x", "position_y"),
    "velocity": ("velocity_x", "velocity_y"),
}
"""Outputs that are quantities, by the quantity."""

EFFECTS: Mapping[Effect, tuple[str, ...]] = {
    "joint_damping": ("damping1", "damping2"),
    "joint_friction": ("friction1", "friction2"),
    "joint_spring": ("stiffness1", "stiffness2", "rest1", "rest2"),
    "armature": ("armature1", "armature2"),
}
"""The parameters of an effect: an FMU has it if it has all of them."""

_LARGEST = 2**30
_LONGEST_DESCRIPTION = 64 * 2**20
_DESCRIPTION = "modelDescription.xml"


@dataclass(frozen=True)
class ChainParameter:
    """A parameter of an FMU, and its value for a chain.

    An FMU may leave it out for chains with its `neutral` value; without one it is required.
    """

    name: str
    value: Callable[[Parameters], float]
    neutral: Callable[[Parameters], float] | None = None


def _zero(_: Parameters) -> float:
    return 0.0


def _of_link(index: int) -> tuple[ChainParameter, ...]:
    """Return the parameters of a link and of its joint."""
    number = index + 1

    def kinetic(given: Parameters) -> float:
        return given.friction[index]

    return (
        ChainParameter(f"mass{number}", lambda given: given.mass[index]),
        ChainParameter(f"length{number}", lambda given: given.length[index]),
        ChainParameter(f"centre_along{number}", lambda given: given.centre[index][0]),
        ChainParameter(f"centre_across{number}", lambda given: given.centre[index][1], _zero),
        ChainParameter(f"inertia{number}", lambda given: given.inertia[index]),
        ChainParameter(f"damping{number}", lambda given: given.damping[index], _zero),
        ChainParameter(f"friction{number}", kinetic, _zero),
        ChainParameter(
            f"static_friction{number}",
            lambda given: (given.static_friction or given.friction)[index],
            kinetic,
        ),
        ChainParameter(f"stiffness{number}", lambda g: (g.stiffness or (0, 0))[index], _zero),
        ChainParameter(f"rest{number}", lambda given: (given.rest or (0, 0))[index], _zero),
        ChainParameter(f"armature{number}", lambda given: given.armature[index], _zero),
    )


PARAMETERS = (
    *_of_link(0),
    *_of_link(1),
    ChainParameter("gravity", lambda given: given.gravity),
)
"""The parameters of a chain, in SI units; see `twolink.engines.messages.Parameters`."""


@dataclass(frozen=True)
class FmuFile:
    """A file that was read: FMPy's `description`, and its variables by name."""

    path: Path
    description: Any
    variables: Mapping[str, Any]

    @property
    def fmi3(self) -> bool:
        """Whether the version is FMI 3.0."""
        return bool(self.description.fmiVersion.startswith("3"))

    @property
    def exchanges(self) -> bool:
        """Whether the FMU is one for Model Exchange: it gives the rates of states."""
        return self.description.modelExchange is not None

    @property
    def simulates(self) -> bool:
        """Whether the FMU is one for Co-Simulation: it has a solver of its own."""
        return self.description.coSimulation is not None

    @property
    def quantities(self) -> tuple[str, ...]:
        """The quantities of which the FMU has all outputs."""
        return tuple(name for name, outputs in OUTPUTS.items() if self.has(outputs))

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects of which the FMU has all parameters."""
        return tuple(name for name, parameters in EFFECTS.items() if self.has(parameters))

    @property
    def states(self) -> tuple[int, ...]:
        """The place of each continuous state of the FMU in `STATES`."""
        places = {self.reference(name): place for place, name in enumerate(STATES)}
        found = [unknown.variable.derivative for unknown in self.description.derivatives]
        references = [getattr(state, "valueReference", -1) for state in found]
        if sorted(references) != sorted(places):
            names = ", ".join(getattr(state, "name", "none") for state in found) or "none"
            raise self.fault(f"its states must be {', '.join(STATES)}; got {one_line(names, 200)}")
        return tuple(places[reference] for reference in references)

    def has(self, names: tuple[str, ...]) -> bool:
        """Return whether the FMU has all variables of these names."""
        return all(name in self.variables for name in names)

    def reference(self, name: str) -> int:
        """Return the number by which an FMU knows a variable."""
        return int(self.variables[name].valueReference)

    def fault(self, sentence: str) -> EngineError:
        """Return an error of this file."""
        return _fault(self.path, sentence)


def read_fmu(path: Path) -> FmuFile:
    """Return an FMU file, with its variables checked. Raises `EngineError`."""
    try:
        check_readable(path, _LARGEST)
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
            if _DESCRIPTION not in names:
                raise _fault(path, f"must have a {_DESCRIPTION}; got {len(names)} other files")
            if archive.getinfo(_DESCRIPTION).file_size > _LONGEST_DESCRIPTION:
                raise _fault(path, f"{_DESCRIPTION} must be at most 64 MB; got a larger one")
            with scratch_folder("fmu") as folder:
                description = _description(path, archive.extract(_DESCRIPTION, folder))
    except (FileError, OSError) as error:
        raise _fault(path, str(error)) from error
    except zipfile.BadZipFile as error:
        raise _fault(path, f"must be a ZIP file; got another one ({error})") from error
    variables = {variable.name: variable for variable in description.modelVariables}
    file = FmuFile(path, description, variables)
    if not (file.exchanges or file.simulates):
        raise file.fault("must be for Model Exchange or Co-Simulation; it is for neither")
    _check_platform(file, names)
    _check_variables(file)
    return file


def _fault(path: Path, sentence: str) -> EngineError:
    return EngineError(f"{one_line(path, 300)}: {sentence}")


def _description(path: Path, xml: str) -> Any:
    """Return FMPy's description of a file of XML that is unpacked from an FMU."""
    from fmpy import read_model_description

    try:
        found = read_model_description(xml, validate=False)
    except Exception as error:
        got = one_line(error, 200)
        raise _fault(path, f"{_DESCRIPTION} must be one of FMI 2.0 or 3.0; got {got}") from error
    if found.fmiVersion == "1.0":
        raise _fault(path, "must be of FMI 2.0 or 3.0; got 1.0")
    return found


def _check_platform(file: FmuFile, names: list[str]) -> None:
    """Raise `EngineError` for an FMU without a binary that runs here."""
    import fmpy

    place = f"binaries/{fmpy.platform_tuple if file.fmi3 else fmpy.platform}"
    kinds = (file.description.modelExchange, file.description.coSimulation)
    wanted = {
        f"{place}/{kind.modelIdentifier}{fmpy.sharedLibraryExtension}" for kind in kinds if kind
    }
    missing = sorted(wanted - set(names))
    if missing:
        there = [name for name in names if name.startswith("binaries/") and name[-1] != "/"]
        got = one_line(", ".join(there), 200) or "no binary"
        raise file.fault(f"must have {missing[0]} for this platform; got {got}")


def _check_variables(file: FmuFile) -> None:
    """Raise `EngineError` for variables that are missing, or contradict their names."""
    required = tuple(each.name for each in PARAMETERS if each.neutral is None)
    missing = [name for name in (*required, *STATES) if name not in file.variables]
    if missing:
        raise file.fault(f"must have the variables {', '.join(missing)}; got none of these names")
    for each in PARAMETERS:
        _check_property(file, each.name, "causality", "parameter")
    for name in TORQUES:
        _check_property(file, name, "causality", "input")
    if file.simulates:
        # The start of a motion is set in them.
        for name in STATES:
            _check_property(file, name, "initial", "exact", "approx")
    for name in (*(each.name for each in PARAMETERS), *STATES, *TORQUES, *chain(*OUTPUTS.values())):
        _check_number(file, name)
    if file.exchanges:
        _ = file.states


def _check_property(file: FmuFile, name: str, key: str, *wanted: str) -> None:
    """Raise `EngineError` for a variable that is there with another value of a property."""
    found = getattr(file.variables.get(name), key, wanted[0])
    if found not in wanted:
        raise file.fault(f"the {key} of {name} must be {' or '.join(wanted)}; got {found}")


def _check_number(file: FmuFile, name: str) -> None:
    """Raise `EngineError` for a variable that is there and no number in SI units."""
    variable = file.variables.get(name)
    if variable is None:
        return
    if variable.type not in ("Real", "Float64") or variable.dimensions:
        kind = f"an array of {variable.type}" if variable.dimensions else variable.type
        raise file.fault(f"{name} must be one Real or Float64; got {kind}")
    units: dict[Any, Any] = {unit.name: unit.baseUnit for unit in file.description.unitDefinitions}
    unit = variable.unit or getattr(variable.declaredType, "unit", None)
    base = units.get(unit)
    factor, offset = (1.0, 0.0) if base is None else (float(base.factor), float(base.offset))
    if (factor, offset) != (1.0, 0.0):
        raise file.fault(
            f"{name} must be in SI units and rad; got {unit}, which is {factor:g} of one"
        )
