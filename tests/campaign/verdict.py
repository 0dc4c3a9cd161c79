"""The sentence on the worst violation among many times."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from tests.campaign.seen import Seen

Verdict = str | None
"""A sentence on a violation, or None."""


def worst(seen: Seen, name: str, amount: Any, allowed: Any, by: str, t: Any = None) -> Verdict:
    """Return a sentence on the amount that exceeds its bound most, or None if none does."""
    times = seen.t if t is None else t
    amount, allowed = np.broadcast_arrays(amount, allowed)
    if amount.size == 0:
        return None
    part = amount / np.maximum(allowed, 1e-300)
    part = np.where(np.isfinite(amount), part, np.inf)
    place = int(part.argmax())
    if part[place] <= 1:
        return None
    beyond = int((part > 1).sum())
    return (
        f"{name} {by} {amount[place]:.3g} at {times[place]:.9g} s, allowed {allowed[place]:.2g};"
        f" so at {beyond} of {len(part)} times from {times[int((part > 1).argmax())]:.9g} s"
    )
