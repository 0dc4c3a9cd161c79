"""The values of heyoka's expressions."""

import numpy as np

from twolink.integration.expressions import plain
from twolink.optional import heyoka


def evaluated(expressions, names=(), values=(), **more):
    """Return the values of expressions, or numbers, in which names have values."""
    names = list(names) or [heyoka().make_vars("unused")]
    numbers = np.array(list(values) or [0.0])
    return heyoka().cfunc([plain(x) for x in expressions], names)(numbers, **more)


def symbolic(numbers):
    """Return numbers as expressions."""
    return [heyoka().expression(float(x)) for x in numbers]
