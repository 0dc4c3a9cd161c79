"""An FMU as an engine: Model Exchange answers at states, Co-Simulation simulates.

The variables of the chain are found by name; see `twolink.engines.fmu_file`.
"""

from __future__ import annotations

import weakref
from contextlib import AbstractContextManager, ExitStack
from functools import cached_property
from pathlib import Path
from time import perf_counter

import numpy as np

from twolink.engines.contract import Array, Engine
from twolink.engines.faults import CannotError, ModelRefusedError
from twolink.engines.fmu_file import OUTPUTS, PARAMETERS, STATES, TORQUES, read_fmu
from twolink.engines.fmu_instance import Exchange, Simulation, exchange, made, simulation
from twolink.engines.messages import Method, Model, Move, Moved
from twolink.engines.simulation_engine import stretches
from twolink.errors import EngineError
from twolink.files import scratch_folder
from twolink.text import one_line

# The relative tolerance asked of an FMU's own solver: only communication steps shall count.
_TOLERANCE = 1e-12

# The rate of an angle is its speed, but for the rounding of a few operations.
_SAME = 1e-12


class FmuEngine(Engine):
    """An FMU; see `Engine`. Parameters and states are set in a new instance for each question."""

    name = "FMU"
    packages = (("FMPy", "fmpy"),)
    extra = "fmi"
    reads = ("parameters",)

    def __init__(self, path: Path) -> None:
        """Read a file, without its binary. Raises `EngineError` for one that is no chain's FMU."""
        self.check_installed()
        file = read_fmu(path)
        self._file = file
        self.name = file.description.modelName or path.stem
        self.effects = file.effects
        if file.simulates:
            self.methods = (Method(name="co-simulation", parameter="step"),)

    @property
    def version(self) -> str:
        """The versions of the model, of FMI and of FMPy."""
        about = self._file.description
        own = f"{about.version}, " if about.version else ""
        return f"{own}FMI {about.fmiVersion}, FMPy {super().version}"

    @property
    def answers(self) -> tuple[str, ...]:
        """Forward dynamics and the outputs of an FMU for Model Exchange."""
        return ("forward_dynamics", *self._file.quantities) if self._file.exchanges else ()

    def start(self) -> None:
        """Load the binary. Raises `EngineError` for one that cannot be loaded."""
        kind = "ModelExchange" if self._file.exchanges else "CoSimulation"
        try:
            with made(self._file, self._folder, kind):
                pass
        except Exception as error:
            got = one_line(str(error).replace(f"{self._folder}/", ""), 200)
            raise self._file.fault(f"its binary must load, and make an instance; {got}") from error

    def load(self, model: Model) -> None:
        """Store the parameters, and check them by the initialization of an instance.

        Raises `ModelRefusedError` if its initialization fails.
        """
        assert model.parameters is not None
        self._given = model.parameters
        try:
            with self._exchange() if self._file.exchanges else self._simulation({}):
                pass
        except CannotError:
            # A missing parameter is reported by the questions.
            pass
        except Exception as error:
            raise ModelRefusedError(f"{self.name} does not start: {error}") from error

    def forward_dynamics(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """Return the derivatives of the speeds (rad/s²).

        Raises `EngineError` if those of the angles are not the speeds.
        """
        driven = self._file.has(TORQUES)
        if not driven and torques.any():
            raise CannotError(f"{self.name} has no inputs {' and '.join(TORQUES)}")
        found = []
        with self._exchange() as instance:
            for state, torque in zip(np.hstack([angles, speeds]), torques, strict=True):
                if driven:
                    instance.set(dict(zip(TORQUES, torque.tolist(), strict=True)))
                instance.go_to(state.tolist())
                found.append(instance.rates())
        rates = np.array(found)
        self._check_kinematics(rates[:, :2], speeds)
        return rates[:, 2:]

    def _check_kinematics(self, rates: Array, speeds: Array) -> None:
        """Raise `EngineError` for rates of the angles that are not the speeds (rad/s)."""
        same = np.abs(rates - speeds) <= _SAME * np.abs(speeds).sum(axis=1, keepdims=True)
        wrong = np.flatnonzero(~same.all(axis=1))
        if wrong.size:
            got, wanted = rates[wrong[0]].tolist(), speeds[wrong[0]].tolist()
            raise EngineError(
                f"the derivatives of {STATES[0]} and {STATES[1]} must be {STATES[2]} and"
                f" {STATES[3]}, {wanted} rad/s; got {got}"
            )

    def kinetic_energy(self, angles: Array, speeds: Array) -> Array:
        """Return the output (J)."""
        return self._outputs("kinetic_energy", angles, speeds)[:, 0]

    def potential_energy(self, angles: Array) -> Array:
        """Return the output (J)."""
        return self._outputs("potential_energy", angles, 0 * angles)[:, 0]

    def position(self, angles: Array) -> Array:
        """Return the outputs (m)."""
        return self._outputs("position", angles, 0 * angles)

    def velocity(self, angles: Array, speeds: Array) -> Array:
        """Return the outputs (m/s)."""
        return self._outputs("velocity", angles, speeds)

    def move(self, request: Move) -> Moved:
        """Simulate with communication steps of at most the request's parameter (s)."""
        times = np.array(request.times)
        sizes = tuple(stretches(times, request.parameter))
        self._check_equal([size for _, size in sizes])
        start = dict(zip(STATES, (*request.angles, *request.speeds), strict=True))
        begin = perf_counter()
        with self._simulation(start) as instance:
            ready = perf_counter()
            rows = [instance.get(STATES)]
            for time, (count, size) in zip(times.tolist(), sizes, strict=False):
                for step in range(count):
                    instance.step(time + step * size, size)
                rows.append(instance.get(STATES))
            done = perf_counter()
        return Moved(
            seq=request.seq,
            angles=tuple((row[0], row[1]) for row in rows),
            speeds=tuple((row[2], row[3]) for row in rows),
            seconds=done - ready,
            setup_seconds=ready - begin,
        )

    def _outputs(self, quantity: str, angles: Array, speeds: Array) -> Array:
        """Return the outputs of a quantity, a row for each state."""
        found = []
        with self._exchange() as instance:
            for state in np.hstack([angles, speeds]).tolist():
                instance.go_to(state)
                found.append(instance.get(OUTPUTS[quantity]))
        return np.array(found)

    def _exchange(self) -> AbstractContextManager[Exchange]:
        return exchange(self._file, self._folder, self._values())

    def _simulation(self, start: dict[str, float]) -> AbstractContextManager[Simulation]:
        return simulation(self._file, self._folder, self._values() | start, _TOLERANCE)

    def _values(self) -> dict[str, float]:
        """Return the values of the FMU's parameters. Raises `CannotError` for one it lacks."""
        values = {}
        for each in PARAMETERS:
            value = each.value(self._given)
            if self._file.has((each.name,)):
                values[each.name] = value
            elif each.neutral is None or value != each.neutral(self._given):
                raise CannotError(f"{self.name} has no {each.name}; the chain's is {value:g}")
        return values

    def _check_equal(self, sizes: list[float]) -> None:
        """Raise `CannotError` for steps of several sizes in an FMU that has one."""
        varies = self._file.description.coSimulation.canHandleVariableCommunicationStepSize
        if not varies and max(sizes) - min(sizes) > 1e-9 * max(sizes):
            raise CannotError(f"{self.name} must have equal communication steps")

    @cached_property
    def _folder(self) -> Path:
        """A folder with the unpacked file, which is removed with this engine."""
        from fmpy import extract

        kept = ExitStack()
        folder = kept.enter_context(scratch_folder("fmu"))
        weakref.finalize(self, kept.close)
        extract(self._file.path, folder)
        return folder
