"""A Warp kernel of the equations of motion, generated from the formulas of `twolink`.

The formula is traced, as `twolink.compilation` does, and the recorded operations are written as a
function of Warp: one kernel thread a trajectory, in float64, with the equations of momenta. The
method is SciPy's table of DOP853 (order 8, twelve stages) with a fixed step; a zero of the table
costs nothing. `pip install warp-lang` is needed.
"""

from __future__ import annotations

import functools
import importlib.util
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853

from twolink.compilation import Recording, TracingNumber
from twolink.scene import Scene
from twolink.simulation.smooth.equations import EQUATIONS

Array = NDArray[np.float64]

_STATE = ("q1", "q2", "p1", "p2")

_NAME = re.compile(r"-?[a-z]\w*")

_HEADER = """\
import warp as wp

wp.set_module_options({"enable_backward": False, "fast_math": False})

"""


def source(scene: Scene) -> str:
    """Return the module with the rates of a scene, and the kernels `evaluate` and `integrate`."""
    return _HEADER + "\n\n".join(
        "\n".join(lines) + "\n" for lines in (_rates(scene), _EVALUATE, _integrate())
    )


def module(scene: Scene) -> ModuleType:
    """Return the imported module of a scene."""
    return _imported(source(scene))


def rates_at(scene: Scene, states: Array, device: str = "cpu") -> Array:
    """Return the rates of states (q, p), both of shape (n, 4), by the kernel's function."""
    wp = _warp()
    given = wp.array(states, dtype=wp.vec4d, device=device)
    found = wp.empty_like(given)
    wp.launch(module(scene).evaluate, len(states), [given, found], device=device)
    return np.asarray(found.numpy())


def ends(scene: Scene, states: Array, steps: int, device: str = "cpu") -> Array:
    """Return the states (q, p), shape (n, 4), after the duration in so many steps."""
    wp = _warp()
    moving = wp.array(states, dtype=wp.vec4d, device=device)
    step = wp.float64(scene.duration / steps)
    wp.launch(module(scene).integrate, len(states), [moving, step, steps], device=device)
    # The copy waits for the kernel.
    return np.asarray(moving.numpy())


def devices() -> list[str]:
    """Return the devices of Warp: the CPU, and a GPU where there is one."""
    return ["cpu", "cuda"] if _warp().is_cuda_available() else ["cpu"]


def _warp() -> Any:
    """Return Warp, which says nothing about its devices and compilations."""
    import warp

    warp.config.log_level = warp.LOG_ERROR
    return warp


@functools.lru_cache(maxsize=4)
def _imported(text: str) -> ModuleType:
    """Return the module of a source, which Warp reads from a file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "twolink_kernel.py"
        path.write_text(text)
        spec = importlib.util.spec_from_file_location(path.stem, path)
        assert spec is not None
        assert spec.loader is not None
        made = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(made)
    return made


def _rates(scene: Scene) -> Iterator[str]:
    """Yield the lines of the function of the rates, from the recorded formula."""
    recording = Recording()
    q1, q2, p1, p2 = (TracingNumber(recording, name) for name in _STATE)
    first, second = EQUATIONS["momenta"].rates(
        scene.moving_chain, scene.effects, (q1, q2), (p1, p2), 0.0
    )
    results = [f"-{rate.name}" if rate.negative else rate.name for rate in (*first, *second)]
    yield "@wp.func"
    yield "def rates(y: wp.vec4d):"
    yield from (f"    {name} = y[{place}]" for place, name in enumerate(_STATE))
    for name, symbol, operands in recording.needed_for(" ".join(results)):
        words = [_word(operand) for operand in operands]
        text = f"wp.{symbol}({words[0]})" if len(words) == 1 else f" {symbol} ".join(words)
        yield f"    {name} = {text}"
    yield f"    return wp.vec4d({', '.join(results)})"


def _word(operand: str) -> str:
    """Return a variable, or a number in float64, which Warp would read as float32."""
    return operand if _NAME.fullmatch(operand) else f"wp.float64({operand})"


_EVALUATE = (
    "@wp.kernel",
    "def evaluate(states: wp.array(dtype=wp.vec4d), found: wp.array(dtype=wp.vec4d)):",
    "    found[wp.tid()] = rates(states[wp.tid()])",
)


def _integrate() -> Iterator[str]:
    """Yield the lines of the kernel that takes steps by the table of DOP853."""
    yield "@wp.kernel"
    yield "def integrate(states: wp.array(dtype=wp.vec4d), h: wp.float64, steps: int):"
    yield "    y = states[wp.tid()]"
    yield "    for _ in range(steps):"
    for stage in range(DOP853.n_stages):
        place = _combined(DOP853.A[stage, :stage])
        yield f"        k{stage} = rates({f'y + h * ({place})' if place else 'y'})"
    yield f"        y = y + h * ({_combined(DOP853.B)})"
    yield "    states[wp.tid()] = y"


def _combined(weights: Any) -> str:
    """Return a weighted sum of stages."""
    return " + ".join(
        f"wp.float64({float(weight)!r}) * k{stage}"
        for stage, weight in enumerate(weights)
        if weight
    )
