"""Compare every quantity of every formulation with an engine at many random states."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from itertools import combinations
from os import PathLike

import numpy as np

from twolink.chain import Chain
from twolink.data import data_path
from twolink.engines.chain_engine import ChainEngine
from twolink.engines.marks import excess
from twolink.engines.pinocchio_chain import PinocchioChain
from twolink.environment import package_versions, this_machine
from twolink.formulations import FORMULATIONS, Formulation
from twolink.inputs import as_count, check_callback, check_instance
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.names import FormulationName
from twolink.urdf import PlanarUrdf, read_planar_urdf
from twolink.verification.jointspace import (
    JointSpace,
    PlanarModel,
    PointMotion,
)
from twolink.verification.quantities import DYNAMICS, MOTION, Formula, Quantity
from twolink.verification.states import Array, States, random_states
from twolink.verification.tolerance import EPSILON, Problem, Scale, tolerance
from twolink.verification.verdict import KINEMATICS, Comparison, Verdict

# States are processed in batches, which bounds memory and allows progress reports.
_BATCH = 4000

Progress = Callable[[float], None]


def verify(
    urdf: PlanarUrdf | str | PathLike[str] | None = None,
    *,
    states: int = 10_000,
    seed: int = 1,
    formulations: Mapping[FormulationName, Formulation] = FORMULATIONS,
    engine: ChainEngine | None = None,
    motion: PointMotion | None = None,
    progress: Progress = lambda share: None,
    limits: Limits = DEFAULT_LIMITS,
) -> Verdict:
    """Compare formulations with an engine (Pinocchio), and with each other, at random states.

    `urdf` is the path of a URDF file, or a file that was read already; by default the shipped one.
    `progress` is called with the completed fraction, from 0 to 1. `motion` replaces the library's
    kinematics. Raises `ParameterError` for less than one state, `UrdfError` for a file that does
    not describe a planar two-link chain, `EngineError` when the engine is missing or rejects it,
    and `TooMuchError` where the time would exceed the limits.
    """
    plan = motion_plan(planar_urdf(urdf), formulations, engine, motion)
    comparisons, _ = plan.worst(states, seed, progress, limits)
    return plan.verdict(comparisons, states, seed)


def planar_urdf(urdf: PlanarUrdf | str | PathLike[str] | None) -> PlanarUrdf:
    """Return a URDF that was read already, or read one from a path; by default the shipped one."""
    if isinstance(urdf, PlanarUrdf):
        return urdf
    return read_planar_urdf(data_path("twolink.urdf") if urdf is None else urdf)


def motion_plan(
    urdf: PlanarUrdf,
    formulations: Mapping[FormulationName, Formulation] = FORMULATIONS,
    engine: ChainEngine | None = None,
    motion: PointMotion | None = None,
    quantities: tuple[Iterable[Quantity], Iterable[Quantity]] = (DYNAMICS, MOTION),
) -> ComparisonPlan:
    """Return the comparison plan of `verify`: equations of motion and motion of the points."""
    of_dynamics, of_motion = quantities
    model = PlanarModel(Chain.from_links(urdf.links), urdf.joints, urdf.gravity)
    texts: dict[str, JointSpace] = {name: JointSpace(f, model) for name, f in formulations.items()}
    kinematics = {"kinematics": motion or PointMotion(model)}
    return ComparisonPlan(
        urdf,
        engine or PinocchioChain(urdf),
        groups=(*cases(of_dynamics, texts), *cases(of_motion, kinematics)),
        names={**{name: f.name for name, f in formulations.items()}, "kinematics": KINEMATICS},
    )


Group = tuple[Quantity, Mapping[str, Formula]]


def cases(quantities: Iterable[Quantity], texts: Mapping[str, object]) -> Iterator[Group]:
    """Return each quantity with the formula of every formulation."""
    for quantity in quantities:
        yield quantity, {name: Formula(quantity, text) for name, text in texts.items()}


@dataclass(frozen=True)
class ComparisonPlan:
    """Quantities, engine, random states and tolerances of a comparison on one URDF.

    `groups` are the quantities with their formulas, by the names of their formulations; `names` are
    the printed names. `draw` generates states, and `bound` is the tolerance of a quantity there:
    infinite where a constrained quantity has no value in float64 and is excluded.
    """

    urdf: PlanarUrdf
    engine: ChainEngine
    groups: tuple[Group, ...]
    names: Mapping[str, str]
    draw: Callable[..., States] = random_states
    bound: Callable[[str, Problem], Array] = tolerance

    def worst(
        self, states: int, seed: int, progress: Progress, limits: Limits
    ) -> tuple[tuple[Comparison, ...], dict[str, int]]:
        """Return each comparison at its worst state, and how often each quantity is excluded."""
        worst: dict[tuple[str, str, str], Comparison] = {}
        left_out = dict.fromkeys((quantity.name for quantity, _ in self.groups), 0)
        for quantity, met, missing in self.batches(states, seed, progress, limits):
            for comparison in (each.worst() for each in met):
                key = (quantity.name, comparison.source, comparison.against)
                if key not in worst or comparison.share > worst[key].share:
                    worst[key] = comparison
            left_out[quantity.name] += missing
        return tuple(worst.values()), left_out

    def batches(
        self, states: int, seed: int, progress: Progress, limits: Limits
    ) -> Iterator[tuple[Quantity, list[BatchResult], int]]:
        """Return, batch by batch, each result and the number of states at which it is excluded.

        Raises `ParameterError` for less than one state, `TooMuchError` for too many.
        """
        states, seed = as_count("states", states, least=1), as_count("seed", seed)
        check_callback("progress", progress, ("share",))
        check_instance("limits", limits, Limits)
        report = limits.timed(f"comparing at {states} states", progress)
        chain = Chain.from_links(self.urdf.links)
        own = Scale.of(chain, joint=True, gravity=self.urdf.gravity, joints=self.urdf.joints)
        largest = {"torque": 100 * float(own.mass_matrix.max()), "force": 10 * sum(chain.mass)}
        count = -(-states // _BATCH)
        for number in range(count):
            left = states - number * _BATCH
            drawn = self.draw(min(_BATCH, left), seed=(seed, number), **largest)
            batch = _Batch(drawn, chain, own, self.engine, self.bound)
            for index, (quantity, formulas) in enumerate(self.groups):
                met = batch.comparisons(quantity, formulas, self.names)
                yield quantity, met, int(batch.left_out.sum())
                report((number + (index + 1) / len(self.groups)) / count)

    def verdict(
        self,
        comparisons: tuple[Comparison, ...],
        states: int,
        seed: int,
        remarks: tuple[str, ...] = (),
    ) -> Verdict:
        """Return comparisons as a verdict, with remarks added to the assumptions about the URDF."""
        return Verdict(
            urdf=self.urdf.path,
            engine=self.engine.name,
            states=states,
            seed=seed,
            assumptions=(*self.urdf.notes, *self.urdf.left_out, *remarks),
            comparisons=comparisons,
            versions=package_versions("pin", "numpy"),
            machine=this_machine(),
        )


@dataclass(frozen=True)
class BatchResult:
    """One quantity from two sources at n states: differences and tolerances.

    `difference` and `allowed` have shape (…, n), `allowed_units` (see `Comparison`) shape (n,).
    """

    quantity: Quantity
    source: str
    against: str
    states: States
    difference: Array
    allowed: Array
    allowed_units: Array

    @property
    def excess(self) -> Array:
        """The differences in units of the tolerance, shape (…, n)."""
        return excess(self.difference, self.allowed)

    @property
    def shares(self) -> Array:
        """The largest excess at each state, shape (n,)."""
        return self.excess.reshape(-1, len(self.states)).max(axis=0)

    def worst(self) -> Comparison:
        """Return the comparison at the state with the largest share."""
        shares = self.excess
        worst = np.unravel_index(np.argmax(shares), shares.shape)
        at = worst[-1]
        allowed_units = float(self.allowed_units[at])
        return Comparison(
            quantity=self.quantity.name,
            algorithm=self.quantity.algorithm,
            unit=self.quantity.unit,
            source=self.source,
            against=self.against,
            difference=float(self.difference[worst]),
            allowed=float(self.allowed[worst]),
            units=float(shares[worst]) * allowed_units,
            allowed_units=allowed_units,
            state={
                field.name: [float(x) for x in getattr(self.states, field.name)[:, at]]
                for field in fields(self.states)
                if field.name in self.quantity.inputs
            },
        )


class _Batch:
    """A batch of the states, with the engine's answers computed so far."""

    def __init__(
        self,
        states: States,
        chain: Chain,
        own: Scale,
        engine: ChainEngine,
        bound: Callable[[str, Problem], Array],
    ) -> None:
        self._states = states
        self._chain = chain
        self._own = own
        self._engine = engine
        self._bound = bound
        # The states at which the last quantity has no value in float64.
        self.left_out = np.zeros(len(states), dtype=bool)
        self._answers: dict[object, Array] = {}
        self._accelerations: Array | None = None

    def comparisons(
        self, quantity: Quantity, formulas: Mapping[str, Formula], names: Mapping[str, str]
    ) -> list[BatchResult]:
        """Compare each formula with the engine, and the formulas with each other."""
        engine = self._engine
        spent = engine.contact_roundings if quantity.constrained else engine.roundings
        self.left_out = np.zeros(len(self._states), dtype=bool)
        answer = self._answer(quantity)
        values = {name: formula.values(self._states) for name, formula in formulas.items()}
        met = replace(self._own.widened(engine.sizes), from_world=quantity.from_world)
        found = []
        for name, formula in formulas.items():
            problem = self._problem(quantity, met, formula.roundings + spent, values[name])
            found.append(
                self._compare(quantity, names[name], engine.name, values[name], answer, problem)
            )
        for first, second in combinations(formulas, 2):
            roundings = formulas[first].roundings + formulas[second].roundings
            problem = self._problem(quantity, self._own, roundings, values[second])
            pair = values[first], values[second]
            found.append(self._compare(quantity, names[first], names[second], *pair, problem))
        return found

    def _answer(self, quantity: Quantity) -> Array:
        """Return the engine's answer, computed once for all quantities that are parts of it."""
        if quantity.call not in self._answers:
            self._answers[quantity.call] = quantity.call(self._engine, self._states)
        answer = self._answers[quantity.call]
        return answer if quantity.part is None else answer[quantity.part]

    def _problem(self, quantity: Quantity, scale: Scale, roundings: int, value: Array) -> Problem:
        states = self._states
        if quantity.name == "forward dynamics":
            self._accelerations = value
        if "torques" in quantity.inputs and self._accelerations is not None:
            states = states.with_accelerations(self._accelerations)
        return Problem(self._chain, scale, states, roundings, found=value)

    def _compare(
        self,
        quantity: Quantity,
        source: str,
        against: str,
        value: Array,
        other: Array,
        problem: Problem,
    ) -> BatchResult:
        difference = np.abs(quantity.of(value) - quantity.of(other))
        allowed = np.broadcast_to(self._bound(quantity.name, problem), difference.shape)
        if quantity.constrained:
            left_out = np.isinf(allowed)
            self.left_out |= left_out.any(axis=0)
            difference = np.where(left_out, 0.0, difference)
        units = problem.units / EPSILON
        return BatchResult(quantity, source, against, self._states, difference, allowed, units)
