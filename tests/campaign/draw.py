"""A random scene of a seed and an index: any chain, any start, any mixture of effects."""

from __future__ import annotations

import math
from collections.abc import Callable

from tests.campaign.dice import Dice
from tests.campaign.draw_coincidences import draw_coincidence
from tests.campaign.draw_contacts import Pose, compliant_surfaces, grazed, joint_stops, surfaces
from tests.campaign.draw_extremes import draw_extreme
from tests.campaign.draw_forces import dry_frictions, smooth_effects
from twolink import Chain, Scene

STARTS = ("random", "random", "at rest", "stretched", "folded", "contact", "contact", "grazing")
ACCURACIES = (1e-9,) * 8 + (1e-7, 1e-6)


def draw_scene(seed: int, index: int) -> Scene:
    """Return the scene of a seed and an index: always the same."""
    dice = Dice(seed, index)
    chain = draw_chain(dice)
    start = dice.pick(STARTS)
    q, u = draw_start(dice, start)
    duration = dice.size(0.5, 3.0) if dice.chance(0.96) else 10.0
    smooth = smooth_effects(dice, chain, duration)
    pose = Pose(chain, q, u)
    rough = [] if start == "grazing" and dice.chance(0.7) else dry_frictions(dice, chain)
    contacts = [
        *joint_stops(dice, pose),
        *surfaces(dice, pose, touching=start == "contact"),
        *compliant_surfaces(dice, pose, touching=start == "contact"),
    ]
    if start == "grazing":
        contacts = [*grazed(dice, pose, smooth, duration), *contacts[: int(dice.chance(0.3))]]
    effects = [*smooth, *rough, *contacts]
    if dice.chance(0.3):
        effects = [effects[int(place)] for place in dice.rng.permutation(len(effects))]
    return Scene(
        chain=chain,
        q=q,
        u=pose.u,
        duration=duration,
        effects=tuple(effects),
        accuracy=dice.pick(ACCURACIES),
        title=f"campaign {seed} {index}: {start}",
    )


def draw_chain(dice: Dice) -> Chain:
    """Return bars, point masses, or links of any proportions; masses up to 50 times each other."""
    kind = dice.pick(("unit", "bars", "bars", "points", "general", "general", "general"))
    if kind == "unit":
        return Chain.uniform_bars((1.0, 1.0), (1.0, 1.0))
    mass = dice.decades(-0.85, 0.85), dice.decades(-0.85, 0.85)
    length = dice.decades(-0.7, 0.35), dice.decades(-0.7, 0.35)
    if kind == "bars":
        return Chain.uniform_bars(mass, length)
    if kind == "points":
        return Chain.point_masses(mass, length)
    across = 0.25 if dice.chance(0.6) else 0.0
    first, second = ((L * dice.size(0.1, 1.1), L * across * dice.size(-1, 1)) for L in length)
    I1, I2 = (m * L * L * dice.size(0.01, 0.2) for m, L in zip(mass, length, strict=True))
    return Chain(mass, length, (first, second), (I1, I2))


def draw_start(dice: Dice, start: str) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return angles (rad) and speeds (rad/s); a stretched or a folded chain is exactly so."""
    q1 = dice.pick((0.0, math.pi / 2)) if dice.chance(0.15) else dice.size(-math.pi, math.pi)
    q2 = dice.size(-math.pi, math.pi)
    if start in ("stretched", "folded") or dice.chance(0.05):
        q2 = q1 + math.pi if start == "folded" else q1
    u = dice.normal(3.0), dice.normal(3.0)
    if start == "at rest" or dice.chance(0.2):
        u = 0.0, 0.0
    elif dice.chance(0.1):
        u = u[0], u[0]
    elif dice.chance(0.1):
        u = dice.pick(((0.0, u[1]), (u[0], 0.0)))
    return (q1, q2), u


DRAWS: dict[str, Callable[[int, int], Scene]] = {
    "any": draw_scene,
    "coincidences": draw_coincidence,
    "extremes": draw_extreme,
}
"""The kinds of random scenes."""
