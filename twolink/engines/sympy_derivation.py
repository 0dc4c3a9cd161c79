"""Derive the equations with SymPy's `LagrangesMethod` and print code from the result.

    python -m twolink.engines.sympy_derivation NAME …

prints the code as JSON. SymPy is imported only here, and only in that process.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from twolink.engines.child import tell


def derived_code(present: frozenset[str]) -> str:
    """Return Python code of a function `accelerations(q1, q2, u1, u2, t, …)` of this chain.

    After the state come the parameters in `present`, sorted by name; the others are zero and do not
    appear.
    """
    import sympy as sp
    from sympy.physics import mechanics as me

    t = me.dynamicsymbols._t
    q1, q2 = q = me.dynamicsymbols("q1 q2")
    u1, u2 = (angle.diff(t) for angle in q)
    values = {name: sp.Symbol(name) for name in present}

    def value(name: str) -> Any:
        return values.get(name, sp.Integer(0))

    ground = me.ReferenceFrame("N")
    bodies, frames = _bodies(me, ground, q, value)
    # Rotors and springs of the joints enter by their energies, everything else by torques.
    energy, torques = me.Lagrangian(ground, *bodies), []
    carriers = (ground, *frames)
    for joint, (angle, speed) in enumerate(((q1, u1), (q2 - q1, u2 - u1)), start=1):
        energy += value(f"J{joint}") * speed**2 / 2
        energy -= value(f"k{joint}") * (angle - value(f"rest{joint}")) ** 2 / 2
        moment = value(f"tau{joint}") - value(f"c{joint}") * speed
        moment += _waves(sp, values, joint, t)
        torques.append((carriers[joint], moment * ground.z))
        if joint == 2:
            torques.append((carriers[1], -moment * ground.z))
    method = me.LagrangesMethod(energy, list(q), forcelist=torques, frame=ground)
    method.form_lagranges_equations()
    # Simplifying the mass matrix takes a second and shortens it; the rest takes minutes.
    solved = sp.simplify(method.mass_matrix).LUsolve(method.forcing)
    names = sp.symbols("q1 q2 u1 u2 t")
    state = dict(zip((u1, u2, q1, q2, t), (*names[2:4], *names[:2], names[4]), strict=True))
    plain = [expression.subs(state) for expression in solved]
    return _printed(sp, plain, [*(str(name) for name in names), *sorted(present)])


def _bodies(
    me: Any, ground: Any, q: tuple[Any, ...], value: Callable[[str], Any]
) -> tuple[list[Any], list[Any]]:
    """Return the links as rigid bodies in uniform gravity, and their frames."""
    A = me.Point("A")
    A.set_vel(ground, 0)
    bodies, frames, start = [], [], A
    for link, angle in enumerate(q, start=1):
        frame = ground.orientnew(f"link{link}", "Axis", (angle, ground.z))
        place = value(f"a{link}") * frame.x + value(f"b{link}") * frame.y
        centre = start.locatenew(f"C{link}", place)
        centre.v2pt_theory(start, ground, frame)
        inertia = (me.inertia(frame, 0, 0, value(f"I{link}")), centre)
        body = me.RigidBody(f"body{link}", centre, frame, value(f"m{link}"), inertia)
        pull = value("gx") * ground.x + value("gy") * ground.y
        body.potential_energy = -body.mass * pull.dot(centre.pos_from(A))
        bodies.append(body)
        frames.append(frame)
        start = start.locatenew("B", value("L1") * frame.x)
        start.v2pt_theory(A, ground, frames[0])
    return bodies, frames


def _waves(sp: Any, values: dict[str, Any], joint: int, t: Any) -> Any:
    """Return the time-dependent torques of a joint."""
    total = sp.Integer(0)
    for name, amplitude in values.items():
        if name.startswith(f"amplitude{joint}_"):
            number = name.partition("_")[2]
            frequency = values.get(f"frequency{joint}_{number}", 0)
            total += amplitude * sp.sin(frequency * t + values.get(f"phase{joint}_{number}", 0))
    return total


def _printed(sp: Any, expressions: list[Any], arguments: list[str]) -> str:
    """Return the code of a function with common subexpressions computed once."""
    shared, results = sp.cse(expressions, symbols=sp.numbered_symbols("x"))
    printer = sp.printing.pycode
    lines = [f"    {name} = {printer(value)}" for name, value in shared]
    answer = ", ".join(printer(value) for value in results)
    head = f"import math\n\n\ndef accelerations({', '.join(arguments)}):"
    return "\n".join([head, *lines, f"    return {answer}", ""])


if __name__ == "__main__":
    tell(lambda: derived_code(frozenset(sys.argv[1:])))
