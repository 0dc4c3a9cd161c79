"""Bounds on the change of u by an impact, or a press, that a run may have missed."""

from __future__ import annotations

import math

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.contact.coordinates import ConstraintCoordinate
from twolink.simulation.hybrid.impact import Impacts, largest, speed_along
from twolink.simulation.hybrid.pose import Pose

# Margin of the change by an impact of which only the size of the speed is known.
_UNSURE = 2


def change_by_impact(impacts: Impacts, index: int, speed: float, u: Pair) -> float:
    """Return a bound on the change of u (rad/s) by an impact at about a normal speed.

    It is large where the row of the normal is short: a point that only just meets a surface at the
    end of its reach turns the chain around.
    """
    row, most = impacts.row(index), _most_by_energy(impacts, index, u)
    usual = usual_change(impacts.contact(index).normal, impacts.pose.chain, speed)
    long = row[0] * row[0] + row[1] * row[1]
    if long == 0 or speed == math.inf:
        return max(usual, most)
    miss = speed_along(row, u) + speed
    u = u[0] - miss * row[0] / long, u[1] - miss * row[1] / long
    after = impacts.impact(index, u).u[1]
    changed = float(largest((after[0] - u[0], after[1] - u[1])))
    return max(usual, min(_UNSURE * changed, most))


def _most_by_energy(impacts: Impacts, index: int, u: Pair) -> float:
    """Return the most by which an impact changes u (rad/s) that gives no energy.

    It is infinite for Newton's law with friction, which may give some.
    """
    contact = impacts.contact(index)
    if contact.law == "newton" and contact.tangent is not None:
        return math.inf
    return _turned_around(impacts.pose, impacts.energy(u))


def usual_change(coordinate: ConstraintCoordinate, chain: Chain, speed: float) -> float:
    """Return the change of u (rad/s) by an impact at a normal speed, far from singular poses.

    It is that of a point that is the shorter link away from its axis, and changes by twice its
    speed (m/s). A stop at a speed (rad/s) counts like the end of the stretched chain that turns so.
    """
    # Link 2 may have no length: D is then at B.
    lengths = [float(length) for length in (chain.L1, chain.L2) if length]
    return 2 * speed * sum(lengths) / min(lengths) / coordinate.size(chain)


def change_by_press(
    pose: Pose, coordinate: ConstraintCoordinate, speed: float, energy: float
) -> float:
    """Return a bound on the change of u (rad/s) by a soft surface that a point meets at a speed.

    The point gets twice its speed at the most, and the chain keeps its kinetic energy (J).
    """
    row = pose.row(coordinate)
    x, y = pose.impulse_response(row)
    along = float(row[0] * x + row[1] * y)
    pushed = 2 * speed * float(largest((x, y))) / along if along > 0 else math.inf
    return max(
        usual_change(coordinate, pose.chain, speed), min(pushed, _turned_around(pose, energy))
    )


def _turned_around(pose: Pose, energy: float) -> float:
    """Return the largest change of u (rad/s) that keeps a kinetic energy (J)."""
    ((M11, M12), (_, M22)), _ = pose.inertia
    a, b, c = float(M11), float(M12), float(M22)
    least = 2 * (a * c - b * b) / (a + c + math.hypot(a - c, 2 * b))
    return 2 * math.sqrt(2 * energy / least)
