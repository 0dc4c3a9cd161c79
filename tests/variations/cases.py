"""Scenes whose motions have known derivatives."""

from pathlib import Path

import numpy as np

from tests.ensembles.cases import UNCOUPLED
from twolink.ensembles.family import Family
from twolink.ensembles.file import scene_tables
from twolink.ensembles.parameters import keys_of

# Link 1 of the uncoupled chain, with link 2's mass at B, turns on a spring: J q1″ = −k (q1 − rest).
J, STIFFNESS, REST = 1.0 / 12 + 0.25 + 1.0, 3.0, 0.2
SPRING = {
    **UNCOUPLED,
    "start": {"q": [0.7, 0.3], "u": [-0.4, 0.5]},
    "effects": {"joint_spring": {"stiffness": [STIFFNESS, 0.0], "rest": [REST, 0.0]}},
}

# All smooth effects with numbers of their own, on a chain of no symmetry.
RICH = {
    "chain": {
        "mass": [1.3, 0.8],
        "length": [1.1, 0.7],
        "centre": [[0.6, 0.1], [0.3, -0.08]],
        "inertia": [0.12, 0.03],
        "joint_sign": [1.0, -1.0],
        "joint_offset": [0.1, 0.2],
    },
    "start": {"theta": [0.4, 0.9], "omega": [1.0, -0.5]},
    "run": {"duration": 2.0},
    "effects": {
        "gravity": {"g": 9.7},
        "joint_damping": {"coefficient": [0.1, 0.2]},
        "joint_spring": {"stiffness": [0.5, 0.8], "rest": [0.1, 0.2]},
        "motor_inertia": {"inertia": [0.001, 0.002], "ratio": [5.0, 7.0]},
        "end_drag": {"coefficient": 0.3},
    },
}

# The same effects, but for rotors, and torques with corners in time.
TORQUES = {
    **RICH,
    "start": {"theta": [0.4, 0.9], "omega": [1.0, -0.5]},
    "effects": {
        "gravity": {"g": 9.7},
        "joint_damping": {"coefficient": [0.1, 0.2]},
        "sampled_torque": {
            "times": [0.1, 0.35, 0.5, 1.25, 1.5],
            "A": [0.3, -2.0, 4.0, 0.7, 0.1],
            "B": [-0.2, 0.4, 0.0, 1.1, -0.6],
            "interpolation": "linear",
        },
    },
}


def family(scene, *parameters):
    """Return the scenes of tables, or of a name, with other values of parameters."""
    tables, folder = scene_tables(scene, Path())
    return Family(tables, folder, tuple(map(keys_of, parameters)), "by.{}")


def oscillation(t, inertia=J):
    """Return q1, u1 of `SPRING` at times (s), and their derivatives by ω, q1 and u1."""
    w, stretch, speed = np.sqrt(STIFFNESS / inertia), 0.7 - REST, -0.4
    s, c = np.sin(w * t), np.cos(w * t)
    motion = REST + stretch * c + speed / w * s, -stretch * w * s + speed * c
    by_w = (
        -stretch * t * s + speed * (t * c / w - s / w**2),
        -stretch * (s + w * t * c) - speed * t * s,
    )
    return motion, by_w, (c, -w * s), (s / w, c)
