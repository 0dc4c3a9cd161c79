"""Quantities of a planar chain by its parameters alone, and Pinocchio's model of the same text."""

import math

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from twolink.urdf import PlanarUrdf


def absolute(urdf: PlanarUrdf, angles: tuple[float, float]) -> np.ndarray:
    return np.array(urdf.joints.absolute_angles(angles))


def closed_form(urdf: PlanarUrdf, angles: tuple[float, float]) -> np.ndarray:
    """Return the mass matrix over the joint angles, by the textbook formula."""
    one, two = urdf.links
    (a1, b1), (a2, b2) = one.centre, two.centre
    q1, q2 = absolute(urdf, angles)
    M11 = one.inertia + one.mass * (a1**2 + b1**2) + two.mass * one.length**2
    M12 = two.mass * one.length * (a2 * math.cos(q2 - q1) - b2 * math.sin(q2 - q1))
    M22 = two.inertia + two.mass * (a2**2 + b2**2)
    s1, s2 = urdf.joints.sign
    S = np.array([[s1, 0], [s1, s2]])
    return np.asarray(S.T @ np.array([[M11, M12], [M12, M22]]) @ S)


def planar_points(urdf: PlanarUrdf, angles: tuple[float, float]) -> np.ndarray:
    """Return C1, C2 and D in the derivation's frame (m), from the parameters alone."""
    q1, q2 = absolute(urdf, angles)
    along1, along2 = (np.array([math.cos(q), math.sin(q)]) for q in (q1, q2))
    across1, across2 = (np.array([-v[1], v[0]]) for v in (along1, along2))
    (a1, b1), (a2, b2) = urdf.links[0].centre, urdf.links[1].centre
    elbow = urdf.links[0].length * along1
    return np.array(
        [
            a1 * along1 + b1 * across1,
            elbow + a2 * along2 + b2 * across2,
            elbow + urdf.links[1].length * along2,
        ]
    )


def weight(urdf: PlanarUrdf, angles: tuple[float, float]) -> tuple[float, float]:
    """Return the joint torques of gravity (N m), from the parameters alone."""
    points = planar_points(urdf, angles)
    # The work of a weight along y: ∂y/∂q of a point is its x counted from the joint.
    elbow = urdf.links[0].length * math.cos(absolute(urdf, angles)[0])
    m1, m2 = (link.mass for link in urdf.links)
    Q1 = urdf.gravity * (m1 * points[0, 0] + m2 * elbow)
    Q2 = urdf.gravity * m2 * (points[1, 0] - elbow)
    one, two = urdf.joints.joint_forces((Q1, Q2))
    return float(one), float(two)


def in_source_frame(urdf: PlanarUrdf, points: ArrayLike) -> np.ndarray:
    return np.asarray((np.asarray(points) - urdf.origin) @ np.array(urdf.axes[:2]).T)


def pinocchio_of(urdf: PlanarUrdf, angles: tuple[float, float]):
    """Return Pinocchio's model and data of the same text, and its configuration."""
    model = pin.buildModelFromXML(urdf.xml)
    q = pin.neutral(model)
    for name, angle in zip(urdf.joint_names, angles, strict=True):
        joint = model.getJointId(name)
        start = model.idx_qs[joint]
        values = [angle] if model.nqs[joint] == 1 else [math.cos(angle), math.sin(angle)]
        q[start : start + len(values)] = values
    return model, model.createData(), q
