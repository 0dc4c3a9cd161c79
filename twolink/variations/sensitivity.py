"""`sensitivity`: a smooth motion with its derivatives by its start and its parameters."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.family import Family
from twolink.ensembles.file import scene_tables
from twolink.ensembles.parameters import keys_of
from twolink.errors import ParameterError, SimulationError
from twolink.inputs import as_path, as_tuple, check_callback, check_instance, refuse
from twolink.limits import DEFAULT_LIMITS, UNLIMITED, Budget, Limits
from twolink.scene import Scene
from twolink.simulation.motion import motion_run
from twolink.simulation.options import RunOptions
from twolink.tables import Column, Table, table
from twolink.text import quoted
from twolink.variations.directions import directions
from twolink.variations.measure import MeasuredVariation, largest, measured_variation
from twolink.variations.smooth import check_smooth
from twolink.variations.system import check_form
from twolink.variations.uncertainty import VARIABLES, Uncertainty, factor_of, propagated

Array = NDArray[np.float64]

# Bytes of a sample of a variable in all runs: numbers of the longest precision, and their copies.
_BYTES = 64


@dataclass(frozen=True, repr=False)
class Sensitivity:
    """A motion q (rad), u (rad/s) of shape (2, n) at times t (s), and its derivatives.

    `dq` and `du`, shape (k, 2, n), are those by each of the k parameters `by`, in rad and rad/s for
    a unit of the parameter, at the `values` of the scene. `error` is the measured global error of q
    and u, and `errors`, shape (k, n), the measured error of dq and du so far, both bounds from runs
    that differ in precision and equations. `accuracy` is the one asked for: absolute for q and u,
    relative to the largest derivative by the same parameter over the run for dq and du; it is met
    until `holds_until` (s). `notes` has a sentence for each departure from the request.
    """

    scene: Scene
    by: tuple[str, ...]
    values: tuple[float, ...]
    t: Array
    q: Array
    u: Array
    dq: Array
    du: Array
    error: float
    errors: Array
    accuracy: float
    holds_until: float
    precision: str
    notes: tuple[str, ...]
    _family: Family = field(repr=False, compare=False)

    @property
    def met(self) -> bool:
        """Whether the accuracy is met over the whole run."""
        return self.holds_until == self.t[-1]

    @property
    def relative_errors(self) -> Array:
        """The errors of dq and du at the end by each parameter, as shares of the largest, (k,)."""
        sizes = largest(self.dq, self.du)
        return np.divide(self.errors[:, -1], sizes, out=np.zeros(len(sizes)), where=sizes > 0)

    def of(self, name: str) -> tuple[Array, Array]:
        """Return dq and du, shape (2, n), by one of the parameters."""
        if name not in self.by:
            refuse("the name of a derivative", name, f"one of {', '.join(self.by)}")
        place = self.by.index(name)
        return self.dq[place], self.du[place]

    def uncertainty(
        self, deviations: Mapping[str, float] | None = None, *, covariance: Any = None
    ) -> Uncertainty:
        """Return the covariance of the motion, to first order, and how far that holds.

        Give the standard deviations of independent parameters by their names (those without one
        are certain), or the covariance of all, shape (k, k), in the order of `by`. Raises
        `ParameterError` for arguments that are no uncertainty, and the error of a scene that a
        standard deviation makes impossible, such as a negative mass.
        """
        factor = factor_of(self.by, deviations, covariance)
        states = np.concatenate([self.q, self.u])
        slopes = np.concatenate([self.dq, self.du], axis=1)

        def neighbour(difference: Array) -> Array:
            scene = self._family.scene(np.array(self.values) + difference)
            # Its own errors are those of double precision, far below what it is compared with.
            run = motion_run(scene, self.t, formulation="momenta", limits=UNLIMITED)
            return np.concatenate([run.q, run.u])

        return propagated(self.t, states, slopes, self.errors, factor, neighbour)

    def summary(self) -> Table:
        """Return a table of the derivatives at the end, with their errors."""
        columns = [Column("by"), Column("value", number=True, spare=1)]
        columns += [Column(f"d{name}", number=True) for name in VARIABLES]
        columns += [Column("error", number=True)]
        slopes = np.concatenate([self.dq, self.du], axis=1)[:, :, -1]
        rows = (
            (name, f"{value:.6g}", *(f"{slope:.6g}" for slope in own), f"{error:.1e}")
            for name, value, own, error in zip(
                self.by, self.values, slopes, self.errors[:, -1], strict=True
            )
        )
        return table(f"Derivatives at {self.t[-1]:.6g} s", columns, rows)

    def document(self) -> dict[str, Any]:
        """Return the result as plain data."""
        return {
            "scene": self.scene.title,
            "accuracy": self.accuracy,
            "holds_until": self.holds_until,
            "precision": self.precision,
            "error": self.error,
            "notes": list(self.notes),
            "t": self.t.tolist(),
            "q": self.q.tolist(),
            "u": self.u.tolist(),
            "by": {
                name: {
                    "value": value,
                    "dq": self.dq[k].tolist(),
                    "du": self.du[k].tolist(),
                    "error": self.errors[k].tolist(),
                }
                for k, (name, value) in enumerate(zip(self.by, self.values, strict=True))
            },
        }

    def csv(self) -> str:
        """Return the motion, its derivatives and their errors as comma-separated values."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        names = [[*(f"d{v}/d{name}" for v in VARIABLES), f"error of d/d{name}"] for name in self.by]
        writer.writerow(["t", *VARIABLES, *(each for group in names for each in group)])
        own = [[*self.dq[k], *self.du[k], self.errors[k]] for k in range(len(self.by))]
        columns = [self.t, *self.q, *self.u, *(column for group in own for column in group)]
        writer.writerows(np.array(columns).T.tolist())
        return text.getvalue()

    def __repr__(self) -> str:
        """Return the parameters and the errors in a line."""
        worst = self.relative_errors.max()
        return (
            f"<Sensitivity of {self.scene.title!r} by {', '.join(self.by)}: {len(self.t)} samples,"
            f" relative error {worst:.1e}>"
        )


def sensitivity(
    scene: Scene | str | PathLike[str] | Mapping[str, Any],
    by: Iterable[str],
    *,
    accuracy: float | None = None,
    samples: int = 501,
    progress: Callable[[str, float], None] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Sensitivity:
    """Return a smooth motion with its derivatives by its start and parameters, and their errors.

    `scene` may be a scene file, the name of a scene, or the tables of a file. `by` names numbers as
    sweep files do: by their keys in the scene, such as start.q.0 or
    effects.joint_spring.stiffness.1, or by a symbol, such as q1 or m2. As in sweeps, all that the
    scene file derives from a number changes with it.
    `accuracy` defaults to that of the scene. Variational equations are integrated by Taylor series,
    through the corners of a sampled torque from sample to sample.

    Raises `SimulationError` for a scene with contact or friction, and where a parameter has no
    derivative; `ParameterError` and `SceneError` for invalid arguments.
    """
    options = RunOptions(accuracy=accuracy, samples=samples)
    check_callback("progress", progress, ("name", "share"))
    check_instance("limits", limits, Limits)
    names = _names(by)
    tables, folder = scene_tables(_given(scene), Path())
    family = Family(tables, folder, tuple(map(keys_of, names)), "by.{}")
    own = family.scene(family.values)
    if own.method != "taylor":
        raise SimulationError(
            "the method of the scene must be taylor, which integrates derivatives; got"
            f" {quoted(own.method)}"
        )
    check_smooth(own, corners=True)
    size = options.samples * 4 * (1 + len(names)) * _BYTES
    limits.check_memory(f"{options.samples} samples", size)
    return _measured(family, own, names, options, progress, limits)


def _measured(
    family: Family,
    scene: Scene,
    names: tuple[str, ...],
    options: RunOptions,
    progress: Callable[[str, float], None] | None,
    limits: Limits,
) -> Sensitivity:
    """Return the sensitivity of checked arguments."""
    accuracy = scene.accuracy if options.accuracy is None else options.accuracy
    times = np.linspace(0.0, scene.duration, options.samples)
    budget = Budget(limits, f"derivatives over {scene.duration:g} s")

    def report(name: str) -> Callable[[float], None]:
        named = None if progress is None else lambda share: progress(name, share)
        return budget.timed(named)

    along = directions(family)
    for name, direction in zip(names, along, strict=True):
        check_form(scene, direction, name)
    found = measured_variation(scene, along, times, accuracy, report)
    return _noted(_of_run(found, family, scene, names, times, accuracy))


def _of_run(
    found: MeasuredVariation,
    family: Family,
    scene: Scene,
    names: tuple[str, ...],
    times: Array,
    accuracy: float,
) -> Sensitivity:
    """Return the sensitivity that a measured run has found, with arrays that are read-only."""
    met = found.within(accuracy)
    made = Sensitivity(
        scene=scene,
        by=names,
        values=family.values,
        t=times,
        q=found.q,
        u=found.u,
        dq=found.dq,
        du=found.du,
        error=float(found.error[-1]),
        errors=found.errors,
        accuracy=accuracy,
        holds_until=float(times[-1] if met.all() else times[max(int(met.argmin()) - 1, 0)]),
        precision=found.precision,
        notes=scene.notes,
        _family=family,
    )
    for array in (made.t, made.q, made.u, made.dq, made.du, made.errors):
        array.setflags(write=False)
    return made


def _noted(made: Sensitivity) -> Sensitivity:
    """Return a sensitivity with a note if its accuracy does not hold to the end."""
    if made.met:
        return made
    note = (
        f"The accuracy {made.accuracy:.1e} holds until {made.holds_until:.6g} s; at the end the"
        f" error of the motion is {made.error:.1e}, and that of the derivatives"
        f" {made.relative_errors.max():.1e} of the largest."
    )
    return replace(made, notes=(*made.notes, note))


def _given(scene: Any) -> Any:
    """Return a scene, its tables, or the text of its path, or raise `ParameterError`."""
    if isinstance(scene, Scene):
        return scene
    return dict(scene) if isinstance(scene, Mapping) else str(as_path("scene", scene))


def _names(by: Any) -> tuple[str, ...]:
    """Return the names of parameters, each once, or raise `ParameterError`."""
    wanted = "a sequence of names, such as ('q1', 'm2')"
    names = as_tuple("by", (by,) if isinstance(by, str) else by, wanted)
    if not names or not all(isinstance(name, str) for name in names):
        refuse("by", by, wanted)
    keys = [keys_of(name) for name in names]
    twice = next((name for k, name in enumerate(names) if keys[k] in keys[:k]), None)
    if twice is not None:
        raise ParameterError(f"by must name each parameter once; got {quoted(twice)} again")
    return names
