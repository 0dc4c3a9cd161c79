"""Times of several sources in one order."""

from __future__ import annotations

from typing import Any

import numpy as np


def merged(*times: Any) -> Any:
    """Return the times in arrays or sequences (s), rising, each once."""
    # With indices: without them NumPy imports its masked arrays, which takes 30 ms.
    return np.unique(np.concatenate([np.asarray(some) for some in times]), return_index=True)[0]
