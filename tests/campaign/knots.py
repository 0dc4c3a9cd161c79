"""A trajectory against that of the same scene with one more torque, of zero, sampled beside events.

Both formulations share the treatment of events, so that a reference does not show its faults.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from numpy.random import Generator

from tests.campaign.reference import leaves_a_choice, parting
from twolink import simulate
from twolink.effects.sampled_torque import SampledTorque
from twolink.errors import TwolinkError

# Distances (s) of knots from events, before or after them.
_BESIDE = 0.0, 1e-12, 1e-9, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3

# Knots at most, and events beside the first of which they are.
_KNOTS, _EVENTS = 4, 80


def undisturbed(trajectory: Any, rng: Generator) -> tuple[list[tuple[str, str]], str]:
    """Return where knots of a zero torque change a motion, and a remark on the comparison."""
    times = _times(trajectory, rng)
    if not times:
        return [], "no knots: there is no event"
    zeros = (0.0,) * (len(times) + 1)
    knots = SampledTorque((0.0, *times), zeros, zeros, "hold")
    scene = trajectory.scene
    try:
        other = simulate(replace(scene, effects=(*scene.effects, knots)))
    except TwolinkError as error:
        return [("knots", f"with knots at {times} s: {error}")], "refused"
    except Exception as error:
        return [("knots crash", f"{type(error).__name__}: {str(error)[:200]}")], "crash"
    if leaves_a_choice(trajectory, other):
        return [], "knots not compared: the laws of contact leave a choice"
    found = [
        (f"knots: {name}", f"{sentence}; knots at {times} s")
        for name, sentence in parting(trajectory, other)
    ]
    return found, f"knots to {other.error:.1g}"


def _times(trajectory: Any, rng: Generator) -> tuple[float, ...]:
    """Return the times (s) of knots, rising, none if there is no event."""
    moments = [impact.time for impact in trajectory.impacts[:_EVENTS]]
    moments += [event.time for event in trajectory.events[1:_EVENTS]]
    if not moments:
        return ()
    found = set()
    for _ in range(rng.integers(1, _KNOTS + 1)):
        time = rng.choice(moments) + rng.choice((-1, 1)) * rng.choice(_BESIDE)
        if 0 < time < trajectory.scene.duration:
            found.add(float(time))
    return tuple(sorted(found))
