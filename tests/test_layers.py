"""The import rules of the design: one direction, like water."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent

# A file imports only from files above it in this list.
LAYERS = [
    "twolink.errors",
    "twolink.files",
    "twolink.finite",
    "twolink.optional",
    "twolink.arithmetic",
    "twolink.shipped",
    "twolink.provenance",
    "twolink.coordinates",
    "twolink.urdf",
    "twolink.chain",
    "twolink.compilation",
    "twolink.kinematics",
    "twolink.loads",
    "twolink.contact",
    "twolink.kane",
    "twolink.lagrange",
    "twolink.effects",
    "twolink.scene",
    "twolink.engines",
    "twolink.simulation",
    "twolink.verification",
    "twolink.accuracy",
    "twolink.hardcases",
    "viz",
    "twolink.cli",
]

# Kane's text and Lagrange's stay independent: independence is what makes agreement evidence.
FORBIDDEN = {
    "twolink.kane": {"twolink.lagrange"},
    "twolink.lagrange": {"twolink.kane", "twolink.kinematics"},
}

# Proofs and 50 digits belong to the tests; drawing does not belong to the library.
NEVER_IN_THE_LIBRARY = {"sympy", "mpmath", "matplotlib", "meshcat", "viz", "hypothesis", "pytest"}

# A peer generates code by SymPy. The file that does runs in a process of its own.
ALLOWED = {"twolink.engines.sympy_derivation": {"sympy"}}

FILES = sorted([*ROOT.glob("twolink/**/*.py"), *ROOT.glob("viz/**/*.py")])


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(part for part in parts if part != "__init__")


def layer_of(module: str) -> int:
    for index, layer in enumerate(LAYERS):
        if module == layer or module.startswith(layer + "."):
            return index
    raise AssertionError(f"{module} has no place in LAYERS")


def imports(tree: ast.AST) -> set[str]:
    """Return every module that a file imports, at its top or inside its functions."""
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            assert node.module is not None
            found.add(node.module)
            # `from twolink import kane` names a module too.
            submodules = {f"{node.module}.{alias.name}" for alias in node.names}
            found.update(name for name in submodules if exists(name))
    return found - {"twolink"}


def exists(module: str) -> bool:
    path = ROOT.joinpath(*module.split("."))
    return path.with_suffix(".py").exists() or (path / "__init__.py").exists()


def violations(module: str, source: str) -> list[str]:
    """Return what a module's imports do against the rules."""
    own = [name for name in imports(ast.parse(source)) if name.split(".")[0] in ("twolink", "viz")]
    foreign = {name.split(".")[0] for name in imports(ast.parse(source))}
    found = [
        f"{module} imports {name}, which stands below it"
        for name in own
        if layer_of(name) > layer_of(module)
    ]
    found += [
        f"{module} imports {name}, from which it is independent"
        for name in own
        if name in FORBIDDEN.get(module, set())
    ]
    if module.startswith("twolink") and not module.startswith("twolink.cli"):
        never = NEVER_IN_THE_LIBRARY - ALLOWED.get(module, set())
        found += [f"{module} imports {name}" for name in foreign & never]
    return found


@pytest.mark.parametrize("path", FILES, ids=module_name)
def test_imports_go_one_way(path):
    module = module_name(path)
    if module in ("twolink", "viz"):
        return
    assert violations(module, path.read_text()) == []


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("twolink.kane", "from twolink.lagrange import coupling"),
        ("twolink.lagrange", "from twolink import kinematics"),
        ("twolink.lagrange", "import twolink.kane"),
        ("twolink.chain", "from twolink.kinematics import position"),
        ("twolink.engines.pinocchio", "from twolink.verification import verify"),
        ("twolink.verification.verify", "import sympy"),
        ("twolink.engines.sympy_code", "import sympy"),
        ("twolink.engines.sympy_derivation", "import mpmath"),
        ("twolink.chain", "import viz"),
        ("twolink.urdf.reading", "def late():\n    from twolink.chain import Chain"),
    ],
)
def test_the_rules_can_be_broken(module, source):
    assert violations(module, source)


@pytest.mark.parametrize("path", FILES, ids=module_name)
def test_only_the_front_door_prints(path):
    prints = [
        node
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id == "print"
    ]
    assert module_name(path).startswith("twolink.cli") or not prints


def loaded_after(statement: str) -> set[str]:
    """Return the packages that a fresh interpreter has loaded after a statement."""
    program = f"import sys\n{statement}\nprint(*sorted({{m.split('.')[0] for m in sys.modules}}))"
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT
    )
    return set(run.stdout.split())


def test_help_imports_nothing_heavy():
    heavy = {"numpy", "scipy", "pinocchio", "rich", "yourdfpy", "pydantic", "matplotlib"}
    assert not loaded_after("import twolink.cli") & heavy


def test_simulate_imports_only_the_effects_of_its_scene():
    """SymPy, which heyoka would import, and SciPy are not needed; nor are effects left out."""
    program = (
        "from twolink.scene import Scene\n"
        "from twolink.simulation import simulate\n"
        "from twolink.shipped import shipped\n"
        "simulate(Scene.load(shipped('scenes') / 'free_fall.toml'))\n"
        "import sys\n"
        "print(*[m for m in sys.modules if m.startswith('twolink.effects.')])\n"
        "assert 'twolink.simulation.events' not in sys.modules\n"
        "assert not {'sympy', 'scipy', 'matplotlib', 'pinocchio', 'rich'} & set(sys.modules)"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert run.stdout.split() == ["twolink.effects.gravity"]


def test_verify_imports_no_more_than_it_needs():
    needed = {"numpy", "pinocchio", "rich", "typer"}
    # Typer itself imports pydantic where it finds it.
    never = {"scipy", "yourdfpy", "trimesh", "matplotlib", "meshcat", "sympy", "mpmath"}
    loaded = loaded_after(
        "from typer.testing import CliRunner\n"
        "from twolink.cli import app\n"
        "result = CliRunner().invoke(app, ['verify', '--states', '3'])\n"
        "assert result.exit_code == 0, result.output"
    )
    assert needed <= loaded
    assert not loaded & never
