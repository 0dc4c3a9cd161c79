"""Reports as data: a JSON document, and JUnit's XML."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

from twolink.conformance.convergence import Curve
from twolink.conformance.diagnosis import SENTENCES
from twolink.conformance.results import Report, TestResult
from twolink.conformance.vectors import RELEASE
from twolink.engines.marks import Mark
from twolink.engines.messages import PROTOCOL
from twolink.environment import package_versions, this_machine
from twolink.text import printable


def document(report: Report) -> dict[str, Any]:
    """Return a report as JSON-compatible data."""
    return {
        "protocol": PROTOCOL,
        "vectors": RELEASE,
        "engine": report.engine.model_dump(),
        "attachment": report.attachment,
        "suites": list(report.suites),
        "limits": {"seconds": report.seconds, "memory": report.memory},
        "versions": package_versions("numpy"),
        "machine": this_machine(),
        "printed": {"warnings": report.printed[0], "first": report.printed[1]},
        "verdict": report.sentence,
        "agrees": report.agrees,
        "causes": {
            name: {"sentence": SENTENCES[name], "tests": [result.id for result in results]}
            for name, results in report.causes().items()
        },
        "results": [_table(result) for result in report.results],
    }


def _table(result: TestResult) -> dict[str, Any]:
    table = {**vars(result), "mark": result.mark.value, "convergence": None}
    if result.curve is not None:
        table["convergence"] = curve_table(result.curve)
    return {key: value for key, value in table.items() if key not in ("group", "causes", "curve")}


def curve_table(curve: Curve) -> dict[str, Any]:
    """Return a method's errors against its settings as JSON-compatible data."""
    verdict = curve.verdict
    return {
        "parameter": curve.parameter,
        "settings": list(curve.settings),
        "errors": list(verdict.errors),
        "limit": verdict.limit.value,
        "order": verdict.order,
        "limit_error": verdict.limit_error,
    }


def junit(report: Report) -> str:
    """Return a report in JUnit's XML, which build servers read."""
    root = ElementTree.Element("testsuites", name="twolink conform")
    for suite in report.suites:
        results = [result for result in report.results if result.suite == suite]
        element = ElementTree.SubElement(
            root,
            "testsuite",
            name=f"{suite} ({report.engine.name} {report.engine.version})",
            tests=str(len(results)),
            failures=str(sum(not result.passed for result in results)),
            errors="0",
            skipped=str(sum(result.mark is Mark.CANNOT for result in results)),
        )
        for result in results:
            _add_case(element, result)
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, "unicode") + "\n"


def _add_case(suite: ElementTree.Element, result: TestResult) -> None:
    case = ElementTree.SubElement(
        suite, "testcase", classname=result.group.replace("/", "."), name=result.id
    )
    if result.mark is Mark.CANNOT:
        ElementTree.SubElement(case, "skipped", message=printable(result.said))
    elif not result.passed:
        words = f"{result.verdict}: {result.reason}"
        failure = ElementTree.SubElement(
            case, "failure", type=result.verdict, message=printable(words)
        )
        failure.text = printable("\n".join([result.said, *result.warnings, result.output]))
