"""The import rules: modules import in one direction."""

import ast
import functools
import re
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent

# A file imports only from files above it in this list.
LAYERS = [
    "twolink.text",
    "twolink.errors",
    "twolink.names",
    "twolink.suffixes",
    "twolink.times",
    "twolink.tables",
    "twolink.files",
    "twolink.toml",
    "twolink.validation",
    "twolink.values",
    "twolink.interruptible",
    "twolink.inputs",
    "twolink.limits",
    "twolink.optional",
    "twolink.arithmetic",
    "twolink.data",
    "twolink.environment",
    "twolink.coordinates",
    "twolink.chain_checks",
    "twolink.urdf",
    "twolink.uniform_bars",
    "twolink.chain",
    "twolink.compilation",
    "twolink.points",
    "twolink.kinematics",
    "twolink.loads",
    "twolink.contact",
    "twolink.kane",
    "twolink.lagrange",
    "twolink.formulations",
    "twolink.integration",
    "twolink.effects",
    "twolink.scene",
    "twolink.engines",
    "twolink.workers",
    "twolink.simulation",
    "twolink.ensembles",
    "twolink.verification",
    "twolink.accuracy",
    "twolink.variations",
    "twolink.hardcases",
    "twolink.conformance",
    "twolink.testing",
    "twolink.viz",
    "twolink.cli",
    "twolink.__main__",
]

# The modules of a package that no row names.
OTHERS = "…"

# The same inside a package: a module imports only from rows above its own, and modules in one row
# do not import each other. "__init__" is the last row where it is not named.
ROWS = {
    "twolink.urdf": [
        "link_parameters spatial text",
        "inertia prefixes reading",
        "unread",
        "lumping",
        "tip",
        "plane",
        "planar",
        "mechanics plausibility writing",
        "description repair",
        OTHERS,
    ],
    "twolink.contact": [
        "coordinates force_laws impact_laws states",
        "elastoplastic elements reach",
    ],
    "twolink.integration": [
        "expressions method outcomes precisions tableaus",
        "operations",
        "fixed_step scipy_method",
        "methods",
    ],
    "twolink.effects": ["custom_elements effect", OTHERS, "__init__", "of_urdf"],
    "twolink.scene": ["chain_table text", "model names reading writing", "scene"],
    "twolink.engines": [
        "faults messages",
        "child marks quantities scenes transport",
        "sympy_derivation",
        "contract process session",
        "answering chain_engine joint_model pinocchio_engine remote_engine",
        "approximation in_process pinocchio_chain",
        "simulation_engine mujoco_contact fmu_file",
        "fmu_instance urdf_reading",
        "fmu_engine",
        OTHERS,
        "registry",
        "attach",
        "serve",
    ],
    "twolink.simulation": [
        "compilation_thread hybrid.mode memo pool series shortened",
        "run",
        "formats smooth",
        "storage",
        "hybrid log",
        "forces motion options views",
        "resolved work",
        "trajectory",
        "effects_cost simulate",
    ],
    "twolink.simulation.smooth": [
        "equations judging moved_start sized",
        "balance bundles changes load_sizes",
        "bundle_plan longest_step pieces",
        "flows quadrature rates steps visited",
        "growth_along integrators lane_run",
        "bundled",
        "measured numeric stiffness taylor",
        "linear",
        "correction defect error_bounds residuals round_off",
        "prediction runs step_errors",
        "corrected pairs",
        "bundle_search",
        "measure",
    ],
    "twolink.simulation.hybrid": [
        "block jet mode pace tally stepper tolerances",
        "bernstein compliant_state configurations constraint kind",
        "polishing pose scales state",
        "roots",
        "dynamics",
        "system",
        "compiled conditions event_functions impact mode_at",
        "event_polynomials missed_change noise recovery steepness zeros",
        "complementarity leaving",
        "breakaway_order compile confirm doubts impact_log other_motions resolution trials",
        "impact_order",
        "collision start_of_arc",
        "ahead arc certificate course fastest_rate grip singular_pose zeno",
        "edge_of_dent effort end_of_arc no_motion steps_of_arc unseen",
        "painleve",
        "dense flow reactions select",
        "doubts_of_jump doubts_of_zeros",
        "ends_of_events jump replayed_order start",
        "doubts_of_start event_order",
        "history",
        "run",
        "doubted_changes",
        "differences",
        "judged",
        "measure",
    ],
    "twolink.ensembles": [
        "parameters",
        "axes comparisons family numbers speeds",
        "blocks deviations terms",
        "compiled linear_flow motion_terms peaks quantity",
        "alone error lane_rows later_errors states",
        "step",
        "carried_bounds following",
        "marching",
        "watching",
        "carried",
        "extremes first_time impact_counts",
        "extreme_speeds",
        "quantities single",
        "ensemble",
        "file stages",
        "chunk",
        "store",
        "executing results",
        "run",
    ],
    "twolink.verification": [
        "jointspace states verdict",
        "quantities tolerance",
        "contact_tolerance verify",
        "contact differences",
    ],
    "twolink.accuracy": [
        "certain divergence dual error_growth frames interval method_configurations multiprecision "
        "peak precise_steps reference_trajectory series step_maps",
        "across_events defect_bound engine_configurations long_runs reference roundoff_floor",
        "drift gap_bound work_precision",
        "enclosed_impact",
        "enclosed_run",
        "enclosure",
        "pareto",
        "study",
        "tables",
    ],
    "twolink.variations": [
        "directions smooth",
        "pieces",
        "system",
        "measure",
        "uncertainty spectrum",
        "sensitivity",
    ],
    "twolink.hardcases": [
        "exact hostile_urdf reference_integrator record",
        "state_trial stored_references trajectory_trial",
        "input_trial",
        "run",
        "evaluation friction input smooth tables",
        "contact",
        "catalogue",
        "parallel",
    ],
    "twolink.conformance": [
        "contract convergence spatial vectors",
        "quantities urdf_model",
        "bounds capabilities flags",
        "judge mistakes suites understanding",
        "answer_mistakes golden model_mistakes",
        "diagnosis",
        "motion_diagnosis results",
        "curves hard_cases motions random_states",
        "expectations report runner scoreboard",
        "scoreboard_tables",
        "harness_check",
        "pytest_plugin",
    ],
    "twolink.conformance.suites": ["building motion", "evaluation imports", "__init__"],
    "twolink.viz": [
        "browser encoding shapes themes",
        "commands framing labels motion plots schematic",
        "animation run urdf_bodies",
        "grid surfaces",
        "contacts links",
        "impacts",
        "film",
        "page",
        "live recording report",
        "display",
    ],
    "twolink.viz.plots": ["style", "moments", "curves", OTHERS, "path", "kinds strip"],
    "twolink.viz.report": ["page", "conformance map scoreboard sections"],
    "twolink.cli": [
        "importing limits options terminal",
        "progress",
        "program studies trajectories",
        "showing",
        OTHERS,
        "urdf",
        "__init__",
        "__main__",
    ],
}

# Kane's text and Lagrange's stay independent: without independence agreement is no evidence.
FORBIDDEN = {
    "twolink.kane": {"twolink.lagrange"},
    "twolink.lagrange": {"twolink.kane", "twolink.kinematics"},
}

# Proofs and 50 digits belong to the tests; drawing does not belong to the library.
NEVER_IN_THE_LIBRARY = {"sympy", "mpmath", "matplotlib", "meshcat", "hypothesis", "pytest"}

# An engine generates code by SymPy. The file that does runs in a process of its own.
# The plugin for pytest is imported by pytest alone.
ALLOWED = {
    "twolink.engines.sympy_derivation": {"sympy"},
    "twolink.conformance.pytest_plugin": {"pytest"},
}

FILES = sorted(ROOT.glob("twolink/**/*.py"))
TESTS = sorted(ROOT.glob("tests/**/test_*.py"))


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(part for part in parts if part != "__init__")


def layer_of(module: str) -> int:
    for index, layer in enumerate(LAYERS):
        if module == layer or module.startswith(layer + "."):
            return index
    raise AssertionError(f"{module} has no place in LAYERS")


@functools.cache
def imports_and_calls(source: str) -> tuple[list[ast.Import | ast.ImportFrom], set[str]]:
    """Return the imports of a program, and the names that it calls.

    Several tests look at all of the library, which is parsed once.
    """
    found, called = [], set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import | ast.ImportFrom):
            found.append(node)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            called.add(node.func.id)
    return found, called


def imports(source: str) -> set[str]:
    """Return every module that a file imports: at its top, inside functions, and for types only."""
    found: set[str] = set()
    for node in imports_and_calls(source)[0]:
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            assert node.module is not None
            # `from twolink import kane` names a module, and other names are the package's own.
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            found.update(name if exists(name) else node.module for name in names)
    return found - {"twolink"}


@functools.cache
def exists(module: str) -> bool:
    path = ROOT.joinpath(*module.split("."))
    return path.with_suffix(".py").exists() or (path / "__init__.py").exists()


def row_of(package: str, module: str) -> tuple[int, str]:
    """Return the row of a module inside a package, and the entry of the row that names it."""
    inside = module[len(package) + 1 :] or "__init__"
    rows = [row.split() for row in ROWS[package]]
    entries = {entry: index for index, row in enumerate(rows) for entry in row}
    parts = inside.split(".")
    for count in range(len(parts), 0, -1):
        entry = ".".join(parts[:count])
        if entry in entries:
            return entries[entry], entry
    if inside == "__init__":
        return len(rows), inside
    assert OTHERS in entries, f"{module} has no place in ROWS[{package!r}]"
    return entries[OTHERS], parts[0]


def against_rows(module: str, name: str) -> list[str]:
    """Return the packages inside which an import points down, or to a neighbour in its row."""
    found = []
    for package in ROWS:
        if not all(f"{end}.".startswith(f"{package}.") for end in (module, name)):
            continue
        (own, entry), (other, other_entry) = row_of(package, module), row_of(package, name)
        if other > own or (other == own and entry != other_entry):
            found.append(package)
    return found


def violations(module: str, source: str) -> list[str]:
    """Return the imports of a module that break the rules."""
    names = imports(source)
    own = [name for name in names if name.split(".")[0] == "twolink"]
    foreign = {name.split(".")[0] for name in names}
    found = [
        f"{module} imports {name}, which stands below it"
        for name in own
        if layer_of(name) > layer_of(module)
    ]
    found += [
        f"{module} imports {name}, which does not stand above it in {package}"
        for name in own
        for package in against_rows(module, name)
    ]
    found += [
        f"{module} imports {name}, from which it is independent"
        for name in own
        if name in FORBIDDEN.get(module, set())
    ]
    if not module.startswith(("twolink.cli", "twolink.viz")):
        never = NEVER_IN_THE_LIBRARY - ALLOWED.get(module, set())
        found += [f"{module} imports {name}" for name in foreign & never]
    return found


def test_imports_go_in_one_direction():
    modules = {module_name(path): path for path in FILES}
    del modules["twolink"]
    found = {module: violations(module, path.read_text()) for module, path in modules.items()}
    assert {module: own for module, own in found.items() if own} == {}


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("twolink.kane", "from twolink.lagrange import coupling"),
        ("twolink.lagrange", "from twolink import kinematics"),
        ("twolink.lagrange", "import twolink.kane"),
        ("twolink.chain", "from twolink.kinematics import position"),
        ("twolink.engines.pinocchio_chain", "from twolink.verification import verify"),
        ("twolink.verification.verify", "import sympy"),
        ("twolink.engines.sympy_code", "import sympy"),
        ("twolink.engines.sympy_derivation", "import mpmath"),
        ("twolink.chain", "import twolink.viz"),
        ("twolink.urdf.reading", "def late():\n    from twolink.chain import Chain"),
        ("twolink.urdf.reading", "from twolink.urdf.planar import PlanarUrdf"),
        ("twolink.urdf.reading", "from twolink.urdf import PlanarUrdf"),
        ("twolink.effects.gravity", "from twolink.effects.surface import Surface"),
        ("twolink.effects.gravity", "from twolink.effects import of_urdf"),
        ("twolink.effects", "import twolink.effects.of_urdf"),
        ("twolink.effects.gravity", "from twolink.effects import Effect"),
        ("twolink.simulation.run", "from twolink.simulation.hybrid.flow import flow"),
        ("twolink.simulation.smooth.taylor", "import twolink.simulation.hybrid.system"),
        ("twolink.simulation.hybrid.mode", "import twolink.simulation.hybrid.impact"),
        ("twolink.cli.plot", "from twolink.cli.view import view"),
    ],
)
def test_violations_are_found(module, source):
    assert violations(module, source)


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("twolink.effects", "from twolink.effects.gravity import Gravity"),
        ("twolink.effects.of_urdf", "from twolink.effects.gravity import Gravity"),
        ("twolink.simulation.hybrid.run", "from twolink.simulation.smooth.taylor import Series"),
        ("twolink.simulation.trajectory", "import twolink.simulation.hybrid.dynamics"),
        ("twolink.cli.__main__", "from twolink.cli import main"),
    ],
)
def test_permitted_imports_are_no_violations(module, source):
    assert violations(module, source) == []


def test_every_package_has_rows_and_every_row_a_module():
    packages = {module_name(path) for path in FILES if path.name == "__init__.py"}
    assert packages - {"twolink"} == set(ROWS)
    for package, rows in ROWS.items():
        named = [entry for row in rows for entry in row.split() if entry != OTHERS]
        assert len(named) == len(set(named))
        for entry in named:
            assert entry == "__init__" or exists(f"{package}.{entry}"), f"{package}.{entry}"


def test_the_rules_name_modules_that_exist():
    named = {*LAYERS, *FORBIDDEN, *ALLOWED}.union(*FORBIDDEN.values())
    assert {name for name in named if not exists(name)} == set()


def missing_modules(source: str) -> set[str]:
    """Return the quoted names of modules that do not exist, in a file or in a program in it.

    A name may also be that of something inside a module, which `monkeypatch` looks up.
    """
    names = re.findall(r"[\"'](twolink(?:\.\w+)+)[\"']", source)
    return {name for name in names if not exists(name) and not is_in_a_file(name)}


def is_in_a_file(name: str) -> bool:
    """Return whether a name is that of something in a module that is no package."""
    return ROOT.joinpath(*name.split(".")[:-1]).with_suffix(".py").exists()


def test_tests_name_modules_that_exist():
    """A test that a module is not loaded cannot fail once the module has another name."""
    missing = {path.stem: missing_modules(path.read_text(encoding="utf-8")) for path in TESTS}
    assert {name: own for name, own in missing.items() if own} == {}


def test_a_name_without_a_module_is_found():
    absent = "twolink.simulation." + "events"
    assert missing_modules(f"program = \"assert '{absent}' not in sys.modules\"") == {absent}


def cycle(graph: dict[str, set[str]]) -> list[str]:
    """Return modules each of which imports the next, from one back to itself; or none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_no_imports_go_round():
    sources = {module_name(path): path.read_text() for path in FILES}
    assert cycle({module: imports(text) for module, text in sources.items()}) == []


def test_a_cycle_is_found():
    late = imports("def f():\n    from twolink.chain import Chain")
    typed = imports("if TYPE_CHECKING:\n    from twolink.loads import Loads")
    assert set(cycle({"twolink.loads": late, "twolink.chain": typed})) == {*late, *typed}


def prints(source: str) -> bool:
    """Return whether a module calls `print`."""
    return "print" in imports_and_calls(source)[1]


def test_only_the_cli_prints():
    printing = {module_name(path) for path in FILES if prints(path.read_text())}
    assert {name for name in printing if not name.startswith("twolink.cli")} == set()


def test_a_print_is_found():
    assert prints("def f():\n    print(1)")
    assert not prints("console.print(1)")


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
    """SymPy, which heyoka would import, and SciPy are not needed; nor are effects left out.

    A smooth motion has no modes, and its table needs no forces.
    """
    program = (
        "from twolink.scene import Scene\n"
        "from twolink.simulation import simulate\n"
        "from twolink.data import data_path\n"
        "found = simulate(Scene.load(data_path('scenes') / 'free_fall.toml'))\n"
        "assert found.summary().rows and found.log == ()\n"
        "import sys\n"
        "print(*[m for m in sys.modules if m.startswith('twolink.effects.')])\n"
        "assert not {'sympy', 'scipy', 'matplotlib', 'pinocchio', 'rich'} & set(sys.modules)\n"
        "assert not {'twolink.simulation.hybrid.mode', 'twolink.contact.force_laws',\n"
        "            'twolink.simulation.forces', 'twolink.simulation.work',\n"
        "            'twolink.simulation.smooth.numeric'} & set(sys.modules)"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert run.stdout.split() == ["twolink.effects.effect", "twolink.effects.gravity"]


@pytest.mark.slow
def test_a_scene_of_numbers_needs_no_urdf():
    program = (
        "from twolink.data import data_path\n"
        "from twolink.scene import Scene\n"
        "import twolink.simulation\n"
        "Scene.load(data_path('scenes') / 'free_fall.toml')\n"
        "import sys\n"
        "print(*[m for m in sys.modules if m.startswith('twolink.urdf.')])\n"
        "assert not {'xml', 'twolink.contact.elements'} & set(sys.modules)"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert run.stdout.split() == ["twolink.urdf.spatial"]


@pytest.mark.slow
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
