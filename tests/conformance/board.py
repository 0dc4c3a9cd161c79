"""Verdicts of pretended engines, as files of `twolink conform --json`."""

import json
import math

from twolink.cli.terminal import write_json
from twolink.conformance.convergence import Convergence, Curve, Limit
from twolink.conformance.report import document
from twolink.conformance.results import Report, TestResult
from twolink.engines.marks import Mark
from twolink.engines.messages import About, Method


def result(identity, mark=Mark.PASS, **fields):
    suite, group, name = identity.split("/", 2)
    quantity = fields.pop("quantity", name.replace("-", "_"))
    return TestResult(identity, suite, f"{suite}/{group}", quantity, (), mark, **fields)


RIGHT = (
    result("import/plain/read"),
    result("import/plain/mass-matrix", digits=15.5, factor=0.1),
    result("evaluation/bars/mass-matrix", digits=14.25, factor=0.2),
    result(
        "motion/general/motion/rk4",
        quantity="motion: rk4",
        said="converges to the truth; e",
        curve=Curve("step", (0.01, 0.005), Convergence(Limit.TRUTH, math.nan, (1e-3, 6e-5), 1e-6)),
    ),
)
WRONG = (
    result("import/plain/read", Mark.REFUSED, said="no <b>axis</b>"),
    result("import/plain/mass-matrix", Mark.CANNOT, said="not for this engine"),
    result(
        "evaluation/bars/mass-matrix", Mark.SILENT, cause="gravity-sign", digits=0.0, factor=1e9
    ),
    result("evaluation/general/mass-matrix", Mark.SILENT, digits=3.0, factor=1e8, said="wrong"),
)


def report(name="right", results=RIGHT, version="1.0", attachment=None):
    about = About(
        name=name,
        version=version,
        reads=("urdf",),
        answers=("mass_matrix",),
        methods=(Method(name="rk4", order=4.0),),
    )
    suites = ("import", "evaluation", "motion")
    return Report(about, attachment or f"cmd: {name}", suites, 60.0, 2**31, results)


def verdict_file(folder, name="right", results=RIGHT, **changes):
    """Write a verdict as the command does, with changes to its document; return the path."""
    fields = {key: changes.pop(key) for key in ("version", "attachment") if key in changes}
    path = folder / f"{name}{fields.get('version', '')}.json"
    write_json(path, document(report(name, results, **fields)) | changes)
    return path


def loaded(path):
    return json.loads(path.read_text(encoding="utf-8"))
