"""Breaks a formula in one place: a sign, a function, a factor, a link's number."""

import ast
import copy
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

_SWAPS = {
    "sin": "cos",
    "cos": "sin",
    "u1": "u2",
    "u2": "u1",
    "q1": "q2",
    "q2": "q1",
    "du1": "du2",
    "du2": "du1",
    "m1": "m2",
    "m2": "m1",
    "L1": "L2",
    "I_C1": "I_C2",
    "I_C2": "I_C1",
    "C1": "C2",
    "C2": "C1",
}


@dataclass(frozen=True)
class Mutant:
    """A module broken in one place."""

    module: ModuleType
    function: str
    line: str
    change: str

    def __str__(self) -> str:
        return f"{self.module.__name__}.{self.function}: {self.line} [{self.change}]"


def _flipped(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """Return the ways to break one node, each with its name."""
    if isinstance(node, ast.BinOp):
        opposite = {ast.Add: ast.Sub(), ast.Sub: ast.Add(), ast.Mult: ast.Div()}
        operator = opposite.get(type(node.op))
        if operator is not None:
            names = type(node.op).__name__, type(operator).__name__
            change = f"{names[0]} to {names[1]} before {ast.unparse(node.right)}"
            yield change, ast.BinOp(node.left, operator, node.right)
        if isinstance(node.op, ast.Div):
            yield "dropped divisor", node.left
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield f"dropped minus of {ast.unparse(node.operand)}", node.operand
    elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id in _SWAPS:
        yield f"{node.id} to {_SWAPS[node.id]}", ast.Name(_SWAPS[node.id], node.ctx)
    elif isinstance(node, ast.Attribute) and node.attr in _SWAPS:
        changed = ast.Attribute(node.value, _SWAPS[node.attr], node.ctx)
        yield f".{node.attr} to .{_SWAPS[node.attr]}", changed


class _Replace(ast.NodeTransformer):
    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self.old, self.new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        if node is self.old:
            return ast.copy_location(self.new, node)
        return super().visit(node)


def mutants(module: ModuleType, skip: Callable[[str, str, str], bool]) -> Iterator[Mutant]:
    """Yield every mutant of a module, but those that `skip` names by function, line and change."""
    assert module.__file__ is not None
    source = Path(module.__file__).read_text(encoding="utf-8")
    lines = source.splitlines()
    tree = ast.parse(source)
    for function in [node for node in tree.body if isinstance(node, ast.FunctionDef)]:
        for statement in function.body:
            for node in ast.walk(statement):
                for change, replacement in _flipped(node):
                    line = lines[node.lineno - 1].strip()
                    if skip(function.name, line, change):
                        continue
                    # The copy shares `node`'s position in the tree, found by parallel walks.
                    broken = copy.deepcopy(tree)
                    twins = dict(zip(ast.walk(tree), ast.walk(broken), strict=True))
                    broken = _Replace(twins[node], copy.deepcopy(replacement)).visit(broken)
                    ast.fix_missing_locations(broken)
                    mutated = ModuleType(f"{module.__name__} (broken)")
                    exec(compile(broken, module.__file__, "exec"), mutated.__dict__)
                    yield Mutant(mutated, function.name, line, change)
