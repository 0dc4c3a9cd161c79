"""The general chain, its state and its loads as SymPy symbols."""

import sympy as sp

from twolink.arithmetic import Scalar
from twolink.chain import Chain, Point
from twolink.loads import Force, Loads, Torque


def positive(names: str) -> tuple[sp.Symbol, ...]:
    return sp.symbols(names, positive=True)


def real(names: str) -> tuple[sp.Symbol, ...]:
    return sp.symbols(names, real=True)


Q = real("q1 q2")
U = real("u1 u2")
DU = real("du1 du2")
GRAVITY = real("g_x g_y")

CHAIN = Chain(
    mass=positive("m1 m2"),
    length=positive("L1 L2"),
    centre=(real("a1 b1"), real("a2 b2")),
    inertia=positive("I_C1 I_C2"),
)

# Gravity in any direction, a force at any point of each link, and a torque on each.
LOADS: Loads = (
    Force(CHAIN.C1, tuple(CHAIN.m1 * g for g in GRAVITY)),
    Force(CHAIN.C2, tuple(CHAIN.m2 * g for g in GRAVITY)),
    Force(Point(1, *real("s1 n1")), real("F1x F1y")),
    Force(Point(2, *real("s2 n2")), real("F2x F2y")),
    Torque(1, real("tau1 tau1")[0]),
    Torque(2, real("tau2 tau2")[0]),
)


def vanishes(expression: Scalar) -> bool:
    """Return whether an expression is exactly zero, with sines and cosines of sums expanded."""
    expanded = sp.expand(sp.expand_trig(sp.sympify(expression)))
    for angle in Q:
        # Every even power of a sine by that of the cosine: a normal form.
        expanded = sp.expand(
            expanded.replace(
                lambda e, angle=angle: e.is_Pow and e.base == sp.sin(angle) and e.exp >= 2,
                lambda e: (1 - sp.cos(e.base.args[0]) ** 2) ** (e.exp // 2) * e.base ** (e.exp % 2),
            )
        )
    return bool(expanded == 0)
