"""The thresholds are all in one module, all explained, and all in use."""

import ast
import io
import re
import tokenize
from functools import cache
from pathlib import Path

import pytest

import twolink.contact
import twolink.simulation.hybrid
from twolink.contact import elements
from twolink.simulation.hybrid import tolerances

HYBRID = Path(twolink.simulation.hybrid.__file__).parent
CONTACT = Path(twolink.contact.__file__).parent
SOURCE = (HYBRID / "tolerances.py").read_text(encoding="utf-8")
MODULES = sorted(path for path in HYBRID.glob("*.py") if path.name != "tolerances.py")
CONSTANTS = re.findall(r"^([A-Z_]+) = ", SOURCE, flags=re.MULTILINE)

# Numbers that no decision of the simulator depends on: `mode` says with one whether the law of
# restitution has created energy, `measure` compares finished runs with the others.
OF_REPORTS = {"mode.py": {"1e-12"}, "differences.py": {"1e-300"}}


@cache
def names_read(path):
    """Return all names and attributes that a module uses, other than in an import."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    return names | {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}


def small_numbers(text):
    """Return the numbers in a module's code below 0.1 that are not zero, and powers like 2**-20."""
    tokens = list(tokenize.generate_tokens(io.StringIO(text).readline))
    written = [token.string for token in tokens if token.type == tokenize.NUMBER]
    found = {
        word
        for word in written
        if not word.lower().startswith("0x") and 0 < abs(complex(word.replace("_", ""))) < 0.1
    }
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            base, power = node.left, node.right
            negative = isinstance(power, ast.UnaryOp) and isinstance(power.op, ast.USub)
            if (
                isinstance(base, ast.Constant)
                and negative
                and isinstance(power.operand, ast.Constant)
            ):
                found.add(ast.unparse(node))
    return found


def test_the_constants_are_found():
    assert len(CONSTANTS) >= 15
    assert set(CONSTANTS) <= set(vars(tolerances))


@pytest.mark.parametrize("name", [*CONSTANTS, "zeno_time"])
def test_every_threshold_is_read_by_a_module(name):
    assert [path.name for path in MODULES if name in names_read(path)]


@pytest.mark.parametrize("name", CONSTANTS)
def test_the_comment_of_every_threshold_names_its_readers(name):
    lines = SOURCE.splitlines()
    row = next(i for i, line in enumerate(lines) if line.startswith(f"{name} = "))
    comment = []
    while row > 0 and lines[row - 1].startswith("#"):
        row -= 1
        comment.insert(0, lines[row].removeprefix("# "))
    said = re.search(r"Read by ([a-z_, ]+)\.", " ".join(comment))
    assert said is not None
    readers = {path.stem for path in MODULES if name in names_read(path)}
    assert set(re.split(r", | and ", said[1])) == readers


@pytest.mark.parametrize("name", CONSTANTS)
def test_every_threshold_is_positive(name):
    assert getattr(tolerances, name) > 0


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.name)
def test_no_other_module_has_a_small_number_of_its_own(path):
    text = path.read_text(encoding="utf-8")
    assert small_numbers(text) <= OF_REPORTS.get(path.name, set())


def test_small_numbers_are_found_in_code_and_not_in_comments():
    assert small_numbers("x = 1e-7  # not 1e-8\ny = '1e-9'\n") == {"1e-7"}
    assert small_numbers("x = 0.25 + 0.5 + 0.75 + 0.0 + 1 + 3e2\n") == set()
    assert small_numbers("x = 2.0**-40 * 1_0e-9\n") == {"2.0 ** (-40)", "1_0e-9"}


ELEMENT_CLASSES = {
    name
    for name, kind in vars(elements).items()
    if isinstance(kind, type) and issubclass(kind, elements.ContactElement)
}


def element_checks(path):
    """Return the element classes that a module's calls of isinstance ask for."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    asked = [
        node.args[1]
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id in ("isinstance", "issubclass")
    ]
    names = {name.id for kind in asked for name in ast.walk(kind) if isinstance(name, ast.Name)}
    return names & ELEMENT_CLASSES


def test_the_element_classes_are_found():
    assert {"DryFriction", "RigidContact", "CompliantContact"} <= ELEMENT_CLASSES


@pytest.mark.parametrize(
    "path", sorted([*HYBRID.glob("*.py"), *CONTACT.glob("*.py")]), ids=lambda path: path.name
)
def test_no_module_checks_the_class_of_an_element(path):
    """The impact module alone does: only rigid contacts have a law of restitution."""
    assert element_checks(path) <= ({"RigidContact"} if path.name == "impact.py" else set())


@pytest.mark.parametrize(("step", "rounding"), [(1.0, 2.0**-52), (0.25, 2.0**-64), (3, 2.0**-112)])
def test_the_square_of_the_zeno_time_is_lost_beside_that_of_a_step(step, rounding):
    """The neglected part is of the order of T², so of ε h²."""
    time = tolerances.zeno_time(step, rounding)
    assert time * time == pytest.approx(rounding * step * step, rel=1e-15)
