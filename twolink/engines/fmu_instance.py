"""Instances of an FMU with their parameters set, through FMPy, for FMI 2.0 and 3.0 alike."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from twolink.engines.fmu_file import STATES, FmuFile
from twolink.errors import EngineError

# Updates of discrete states after which an FMU does not settle.
_MOST_UPDATES = 100


class Instance:
    """An instance whose variables are known by their names."""

    def __init__(self, file: FmuFile, instance: Any) -> None:
        """Take an instance that FMPy made."""
        self._file, self._instance = file, instance

    def set(self, values: Mapping[str, float]) -> None:
        """Set variables."""
        references = [self._file.reference(name) for name in values]
        write = self._instance.setFloat64 if self._file.fmi3 else self._instance.setReal
        write(references, list(values.values()))

    def get(self, names: Sequence[str]) -> list[float]:
        """Return variables."""
        references = [self._file.reference(name) for name in names]
        read = self._instance.getFloat64 if self._file.fmi3 else self._instance.getReal
        return list(read(references))

    def _begin(self, values: Mapping[str, float], tolerance: float | None) -> None:
        """Go through the initialization, with parameters and start values."""
        self.set(values)
        if self._file.fmi3:
            self._instance.enterInitializationMode(tolerance=tolerance)
        else:
            self._instance.setupExperiment(tolerance=tolerance)
            self._instance.enterInitializationMode()
        self._instance.exitInitializationMode()


class Exchange(Instance):
    """An instance for Model Exchange, in continuous-time mode at t = 0."""

    def __init__(self, file: FmuFile, instance: Any, values: Mapping[str, float]) -> None:
        """Initialize an instance. Raises `EngineError` if its discrete states do not settle."""
        super().__init__(file, instance)
        self._begin(values, None)
        update = instance.updateDiscreteStates if file.fmi3 else instance.newDiscreteStates
        if not any(not update()[0] for _ in range(_MOST_UPDATES)):
            raise EngineError("the FMU's discrete states must settle; they change again and again")
        instance.enterContinuousTimeMode()
        self._places = file.states
        self._numbers = (ctypes.c_double * len(STATES))()

    def go_to(self, state: Sequence[float]) -> None:
        """Set the continuous states, given in the order of `STATES`."""
        self._instance.setTime(0.0)
        self._numbers[:] = [state[place] for place in self._places]
        self._instance.setContinuousStates(self._numbers, len(STATES))

    def rates(self) -> tuple[float, ...]:
        """Return the derivatives, in the order of `STATES`."""
        instance = self._instance
        read = (
            instance.getContinuousStateDerivatives if self._file.fmi3 else instance.getDerivatives
        )
        read(self._numbers, len(STATES))
        found = dict(zip(self._places, self._numbers, strict=True))
        return tuple(found[place] for place in range(len(STATES)))


class Simulation(Instance):
    """An instance for Co-Simulation, at t = 0."""

    def __init__(
        self, file: FmuFile, instance: Any, values: Mapping[str, float], tolerance: float
    ) -> None:
        """Initialize an instance whose own solver is to keep a relative tolerance."""
        super().__init__(file, instance)
        self._begin(values, tolerance)

    def step(self, time: float, size: float) -> None:
        """Do one communication step (s). Raises `EngineError` for one that ends early."""
        done = self._instance.doStep(time, size)
        # FMI 2.0 reports it by its status, of which FMPy raises an exception.
        if done is not None and (done[1] or done[2]):
            raise EngineError(f"a step of the FMU at {time:g} s ends early, at {done[3]:g} s")


@contextmanager
def exchange(file: FmuFile, folder: Path, values: Mapping[str, float]) -> Iterator[Exchange]:
    """Yield an instance for Model Exchange of a file that is unpacked in a folder."""
    with made(file, folder, "ModelExchange") as instance:
        yield Exchange(file, instance, values)


@contextmanager
def simulation(
    file: FmuFile, folder: Path, values: Mapping[str, float], tolerance: float
) -> Iterator[Simulation]:
    """Yield an instance for Co-Simulation of a file that is unpacked in a folder."""
    with made(file, folder, "CoSimulation") as instance:
        yield Simulation(file, instance, values, tolerance)


@contextmanager
def made(file: FmuFile, folder: Path, kind: str) -> Iterator[Any]:
    """Yield FMPy's instance, for "ModelExchange" or "CoSimulation", before its initialization."""
    from fmpy.simulation import instantiate_fmu

    instance = instantiate_fmu(str(folder), file.description, kind)
    try:
        yield instance
    finally:
        instance.freeInstance()
