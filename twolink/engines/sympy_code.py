"""Code that SymPy generates from its own mechanics, integrated by SciPy."""

from __future__ import annotations

import functools
from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.engines.isolated import run_isolated
from twolink.engines.joint_model import JointModel, at_state, joint_model, why_not
from twolink.engines.peer import Installed, PeerMethod, PeerRun, Prepared, check_method, heard
from twolink.engines.protocol import Array
from twolink.engines.sympy_derivation import derived_code
from twolink.errors import EngineError
from twolink.scene import Scene

_EVENTS = "solve_ivp integrates smooth equations; events and modes would have to be written anew"
_REASONS = dict.fromkeys(
    ("joint_friction", "joint_stop", "surface", "compliant_surface", "end_force"), _EVENTS
)
_EXPRESSES = frozenset({"torque", "stiffness", "damping", "armature", "waves", "drive"})

# So long (s) SymPy may take; it takes some three.
_PATIENCE = 300.0


class SympyCode:
    """`sympy.physics.mechanics` and `scipy.integrate`; see `twolink.engines.peers.Peer`.

    The code is generated in another process: where SymPy is imported, heyoka would load it too,
    which takes it seconds.
    """

    name = "SymPy-generated code"
    methods = (
        PeerMethod("DOP853", 8, "tolerance"),
        PeerMethod("RK45", 5, "tolerance"),
        PeerMethod("Radau", 5, "tolerance"),
        PeerMethod("LSODA", None, "tolerance"),
    )
    _installed = Installed(name, (("sympy", "sympy"), ("scipy", "scipy")))

    def missing(self) -> str | None:
        """Return the sentence that it is not installed; None if it is."""
        return self._installed.missing()

    def version(self) -> str:
        """Return the versions of SymPy and of SciPy."""
        return self._installed.version()

    def cannot(self, scene: Scene) -> str | None:
        """Return why it cannot express a scene; None if it can."""
        return why_not(scene, self.name, _EXPRESSES, _REASONS)

    def prepared(self, scene: Scene, method: str) -> Prepared:
        """Return what runs a scene; the code is generated once."""
        self._installed.check()
        check_method(self.name, self.methods, method)
        sentence = self.cannot(scene)
        if sentence:
            raise EngineError(sentence)
        from scipy import integrate

        solve: Any = integrate.solve_ivp
        begin = perf_counter()
        model = joint_model(scene)
        function, numbers, generating = _accelerations(model)
        start = [*model.q, *model.u]
        setup = max(perf_counter() - begin, generating)

        def rates(t: float, x: Array) -> Array:
            q1, q2, u1, u2 = x.tolist()
            return np.array([u1, u2, *function(q1, q2, u1, u2, t, *numbers)])

        def run(tolerance: float, times: Array) -> PeerRun:
            span = (float(times[0]), float(times[-1]))
            with heard() as warnings:
                begin = perf_counter()
                try:
                    found = solve(rates, span, start, method, times, rtol=tolerance, atol=tolerance)
                except (ArithmeticError, ValueError) as error:
                    raise EngineError(f"SymPy's code gives up: {error}") from error
                seconds = perf_counter() - begin
            if not found.success:
                raise EngineError(f"SciPy's {method} gives up: {found.message}")
            return PeerRun(
                found.y[:2], found.y[2:], seconds, setup, int(found.nfev), None, tuple(warnings)
            )

        return run

    def accelerations(
        self,
        chain: Chain,
        q: Pair,
        u: Pair,
        *,
        gravity: Pair = (0.0, 9.81),
        torque: Pair = (0.0, 0.0),
    ) -> Pair:
        """Return du (rad/s²) at a state, by the generated code."""
        self._installed.check()
        model = at_state(chain, q, u, gravity, torque)
        function, numbers, _ = _accelerations(model)
        try:
            du1, du2 = function(*model.q, *model.u, 0.0, *numbers)
        except ArithmeticError as error:
            raise EngineError(f"SymPy's code refuses the state: {error}") from error
        return float(du1), float(du2)


def _accelerations(model: JointModel) -> tuple[Callable[..., Any], list[float], float]:
    """Return the generated function, what comes after its state, and the time it took (s)."""
    numbers = _numbers(model)
    function, seconds = _function(frozenset(numbers))
    return function, [numbers[name] for name in sorted(numbers)], seconds


@functools.lru_cache(maxsize=32)
def _function(present: frozenset[str]) -> tuple[Callable[..., Any], float]:
    """Return the function that SymPy writes for chains with these parameters, and its time (s)."""
    begin = perf_counter()
    outcome = run_isolated(derived_code, present, seconds=_PATIENCE)
    if outcome.kind != "finished":
        raise EngineError(f"SymPy's derivation ends as {outcome.kind}: {outcome.said}")
    home: dict[str, Any] = {}
    exec(compile(outcome.result, "<generated by SymPy>", "exec"), home)
    return home["accelerations"], perf_counter() - begin


def _numbers(model: JointModel) -> dict[str, float]:
    """Return all parameters that are not zero, by their names in the derivation."""
    chain, (gx, gy) = model.chain, model.gravity
    found = {"L1": chain.L1, "gx": gx, "gy": gy}
    for index, link in enumerate("12"):
        a, b = chain.centre[index]
        found |= {f"m{link}": chain.mass[index], f"I{link}": chain.inertia[index]}
        found |= {f"a{link}": a, f"b{link}": b}
        found |= {f"tau{link}": model.torque[index], f"c{link}": model.damping[index]}
        found |= {f"k{link}": model.stiffness[index], f"rest{link}": model.rest[index]}
        found |= {f"J{link}": model.armature[index]}
    for number, wave in enumerate(model.waves):
        place = f"{wave.joint + 1}_{number}"
        found |= {f"amplitude{place}": wave.amplitude, f"frequency{place}": wave.frequency}
        found |= {f"phase{place}": wave.phase}
    return {name: value for name, value in found.items() if value}
