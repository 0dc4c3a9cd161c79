"""Any engine beside the formulations of this library at random states: `verify` as a suite.

The plan, the states and the tolerances are those of `twolink verify`, on the shipped URDF. An
engine's own operations are not known, so that its share of a tolerance is that of the vectors.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

from twolink.conformance.bounds import EPSILONS, ROUNDINGS, sizes_of
from twolink.conformance.results import TestResult, without_answer
from twolink.conformance.spatial import FLOATS
from twolink.conformance.suites import tests_of
from twolink.conformance.urdf_model import model_of_urdf
from twolink.data import data_path
from twolink.engines.chain_engine import ChainEngine, Sizes
from twolink.engines.faults import EngineFault
from twolink.engines.marks import Mark
from twolink.engines.remote_engine import RemoteEngine
from twolink.engines.session import Session
from twolink.errors import EngineError
from twolink.limits import DEFAULT_LIMITS
from twolink.urdf import read_planar_urdf
from twolink.verification.quantities import ASKED
from twolink.verification.states import Array
from twolink.verification.tolerance import EPSILON, Problem, tolerance
from twolink.verification.verdict import Comparison
from twolink.verification.verify import motion_plan

STATES, SEED = 200, 1


class _Chain(ChainEngine):
    """The chain in an engine under test."""

    roundings = ROUNDINGS

    @cached_property
    def sizes(self) -> Sizes:
        """The sizes of the numbers in the file, with the ways through all frames."""
        text = data_path("twolink.urdf").read_text(encoding="utf-8")
        plane, origin = self._plane.tolist(), self._origin.tolist()
        return sizes_of(model_of_urdf(text, FLOATS, plane=plane, origin=origin, gravity=(0, 0, 0)))


def at_random_states(session: Session, suite: str, quantity: str) -> Iterator[TestResult]:
    """Yield a result for each formulation that a quantity of the engine is compared with."""
    (name,) = tests_of(suite, quantity)
    result = TestResult(name, suite, name, quantity, (), Mark.CANNOT)
    engine = RemoteEngine(session, name)
    if "urdf" not in engine.reads:
        yield replace(result, said=f"the engine reads {' and '.join(engine.reads)} only")
        return
    if quantity not in engine.answers:
        # A file that is refused is no failure of a quantity that the engine does not have.
        yield replace(result, said="the engine does not answer this quantity")
        return
    try:
        found = tuple(_comparisons(engine, quantity))
    except (EngineError, EngineFault) as error:
        yield without_answer(result, error)
    else:
        for each in found:
            yield replace(
                result,
                id=f"{name}/{each.source.casefold().rpartition(' ')[2]}",
                mark=each.mark,
                factor=each.share,
                said="" if each.passed else _wrong(each),
            )


def _comparisons(engine: RemoteEngine, quantity: str) -> Iterator[Comparison]:
    """Yield the comparisons of one quantity with each formulation."""
    # A potential has an error of its zero, too.
    share = EPSILONS[engine.precision] / EPSILON * (2 if quantity == "potential_energy" else 1)

    def bound(name: str, problem: Problem) -> Array:
        return share * tolerance(name, problem)

    urdf = read_planar_urdf(data_path("twolink.urdf"))
    chain = _Chain(urdf, engine)
    plan = replace(motion_plan(urdf, engine=chain, quantities=ASKED[quantity]), bound=bound)
    comparisons, _ = plan.worst(STATES, SEED, lambda share: None, DEFAULT_LIMITS)
    return (each for each in comparisons if each.against == chain.name)


def _wrong(found: Comparison) -> str:
    return (
        f"it differs from {found.source} by {found.difference:.2g} {found.unit}, with a tolerance"
        f" of {found.allowed:.2g}, at {found.state}"
    )
