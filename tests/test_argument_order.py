"""Calls by position pass q, u and du, and absolute and joint angles, in the order of the function.

All of them are pairs of one type, so that mypy does not tell them apart; their names do.
"""

import ast
import functools
import itertools
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parent.parent
LIBRARY = sorted(ROOT.glob("twolink/**/*.py"))
CALLERS = [*LIBRARY, *sorted(ROOT.glob("benchmarks/**/*.py"))]

# The names of a quantity, as a parameter or an argument.
QUANTITIES = {
    "absolute angles": {"q", "absolute_angles"},
    "absolute speeds": {"u", "absolute_speeds"},
    "accelerations": {"du"},
    "joint angles": {"theta", "joint_angles"},
    "joint speeds": {"omega", "joint_speeds"},
}
QUANTITY = {name: quantity for quantity, names in QUANTITIES.items() for name in names}

# Accelerations and changes of speeds obey the linear maps of speeds, which take them too.
LIKE_SPEEDS = {"absolute speeds", "joint speeds"}


class Signature(NamedTuple):
    """The names of the parameters of a function by position, and how many have no default."""

    names: list[str]
    required: int

    def takes(self, call: ast.Call) -> bool:
        """Return whether a call has as many arguments as the function takes."""
        given = len(call.args) + len(call.keywords)
        unpacked = any(isinstance(each, ast.Starred) for each in call.args)
        return unpacked or (len(call.args) <= len(self.names) and given >= self.required)


def signatures(sources: Iterable[str]) -> dict[str, list[Signature]]:
    """Return the signatures of all functions, methods and data classes, by name."""
    found: dict[str, list[Signature]] = defaultdict(list)
    for source in sources:
        nodes = list(ast.walk(ast.parse(source)))
        classes = [node for node in nodes if isinstance(node, ast.ClassDef)]
        methods = {id(item) for node in classes for item in node.body}
        for node in nodes:
            if isinstance(node, ast.FunctionDef):
                names = [argument.arg for argument in [*node.args.posonlyargs, *node.args.args]]
                static = any(ast.unparse(each) == "staticmethod" for each in node.decorator_list)
                bound = id(node) in methods and not static
                required = len(names) - len(node.args.defaults) - bound
                found[node.name].append(Signature(names[bound:], required))
        for node in classes:
            fields = [item for item in node.body if isinstance(item, ast.AnnAssign)]
            names = [ast.unparse(field.target) for field in fields]
            required = sum(field.value is None for field in fields)
            found[node.name].append(Signature(names, required))
    return found


def quantity_of(argument: ast.expr) -> str | None:
    """Return the quantity in a name, an attribute, the pair of its entries, or a tuple of it."""
    match argument:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return QUANTITY.get(name)
        case ast.Tuple(elts=[ast.Subscript(value=first), ast.Subscript(value=second)]):
            both = {quantity_of(first), quantity_of(second)}
            return both.pop() if len(both) == 1 else None
        case ast.Call(func=ast.Name(id="tuple"), args=[inside]):
            return quantity_of(inside)
    return None


def swapped(source: str, known: Mapping[str, list[Signature]]) -> Iterator[str]:
    """Yield the calls that pass one quantity for another, by all functions that may be called."""
    for call in ast.walk(ast.parse(source)):
        if not isinstance(call, ast.Call) or not isinstance(call.func, ast.Name | ast.Attribute):
            continue
        name = call.func.id if isinstance(call.func, ast.Name) else call.func.attr
        plain = itertools.takewhile(lambda each: not isinstance(each, ast.Starred), call.args)
        given = [quantity_of(argument) for argument in plain]
        # Most calls pass none of the quantities.
        if not any(given):
            continue
        fitting = [each.names for each in known.get(name, ()) if each.takes(call)]
        taking = [[QUANTITY.get(each) for each in names] for names in fitting]
        # Of functions with one name, those that take all the quantities of the call are meant.
        meant = [taken for taken in taking if {*given} <= {*taken, None}] or taking
        if meant and all(conflict(given, taken) for taken in meant):
            yield ast.unparse(call)


def conflict(given: list[str | None], taken: list[str | None]) -> bool:
    """Return whether a call gives a quantity in the place of another one."""
    return any(
        one and other and one != other and not (one == "accelerations" and other in LIKE_SPEEDS)
        for one, other in zip(given, taken, strict=False)
    )


@functools.cache
def known():
    return signatures(path.read_text(encoding="utf-8") for path in LIBRARY)


def test_calls_pass_quantities_in_order():
    found = {path: [*swapped(path.read_text(encoding="utf-8"), known())] for path in CALLERS}
    assert {str(path.relative_to(ROOT)): own for path, own in found.items() if own} == {}


@pytest.mark.parametrize(
    "call",
    [
        "kane.forward_dynamics(chain, u, q, loads)",
        "equations.inverse_dynamics(chain, q, du, u, loads)",
        "lagrange.kinetic_energy(chain, tuple(state.u), tuple(state.q))",
        "kinematics.position(chain, (u[0], u[1]), chain.D)",
        "HybridState(t, u, q, gaps, touching, sliding, compliant)",
        "joints.joint_angles(theta)",
        "joints.absolute_speeds(u)",
    ],
)
def test_swapped_quantities_are_found(call):
    assert [*swapped(call, known())]


@pytest.mark.parametrize(
    "call",
    ["kane.forward_dynamics(chain, q, u, loads)", "joints.joint_angles(q)", "unknown(u, q)"],
)
def test_calls_in_order_are_accepted(call):
    assert not [*swapped(call, known())]
