"""Quantities from the parameters in the index, by the textbook's formulas."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ANGLES = ((0.0, 0.0), (0.3, -0.8), (-1.7, 2.2))


def mass_matrix(expected: Any, theta: tuple[float, float]) -> Array:
    """Return M over the joint angles (kg m²)."""
    one, two = expected["links"]
    (a1, b1), (a2, b2) = one["centre"], two["centre"]
    s1, s2 = expected["sign"]
    delta = s2 * theta[1] + expected["offset"][1]
    M11 = one["inertia"] + one["mass"] * (a1**2 + b1**2) + two["mass"] * one["length"] ** 2
    M22 = two["inertia"] + two["mass"] * (a2**2 + b2**2)
    M12 = two["mass"] * one["length"] * (a2 * math.cos(delta) - b2 * math.sin(delta))
    S = np.array([[s1, 0], [s1, s2]])
    return np.asarray(S.T @ np.array([[M11, M12], [M12, M22]]) @ S, dtype=float)


def gravity_torque(expected: Any, theta: tuple[float, float]) -> Array:
    """Return the joint torques (N m) by which gravity drives the arm."""
    one, two = expected["links"]
    (s1, s2), (phi1, phi2) = expected["sign"], expected["offset"]
    q1 = s1 * theta[0] + phi1
    q2 = q1 + s2 * theta[1] + phi2
    x = [
        a * math.cos(q) - b * math.sin(q)
        for (a, b), q in ((one["centre"], q1), (two["centre"], q2))
    ]
    g, m2 = expected["gravity"], two["mass"]
    Q1 = g * (one["mass"] * x[0] + m2 * one["length"] * math.cos(q1))
    Q2 = g * m2 * x[1]
    S = np.array([[s1, 0], [s1, s2]])
    return np.asarray(S.T @ np.array([Q1, Q2]))


def tip(expected: Any, theta: tuple[float, float]) -> Array:
    """Return D, in the root link's frame without its component along the axis (m)."""
    one, two = expected["links"]
    (s1, s2), (phi1, phi2) = expected["sign"], expected["offset"]
    q1 = s1 * theta[0] + phi1
    q2 = q1 + s2 * theta[1] + phi2
    x = one["length"] * math.cos(q1) + two["length"] * math.cos(q2)
    y = one["length"] * math.sin(q1) + two["length"] * math.sin(q2)
    plane = np.array(expected["plane"])
    return np.asarray(np.array(expected["origin"]) + x * plane[0] + y * plane[1])


def worst(ours: Array, theirs: Array) -> float:
    """Return the largest difference, relative to the largest number."""
    return float(np.max(np.abs(ours - theirs)) / np.max(np.abs(ours)))
