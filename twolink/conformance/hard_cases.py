"""The hard cases put to any engine, as questions and motions of the protocol.

The judge, the marks and the bounds are those of `twolink.hardcases`; the engine is isolated as in
any other suite.
"""

from __future__ import annotations

import math

from twolink.conformance.results import TestResult
from twolink.conformance.suites import tests_of
from twolink.engines.remote_engine import RemoteEngine
from twolink.engines.session import Session
from twolink.hardcases import Case
from twolink.hardcases.run import of_engine


def hard_case(session: Session, suite: str, case: Case) -> TestResult:
    """Return the result of a hard case."""
    (name,) = tests_of(suite, case)
    found = of_engine(case, RemoteEngine(session, name))
    return TestResult(
        name,
        suite,
        name,
        case.group,
        (),
        found.mark,
        math.nan if found.factor is None else found.factor,
        said=found.said,
        output=found.output,
    )
