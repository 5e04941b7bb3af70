"""Numbers to draw skies from: the ends of a range about as often as what lies within.

What is drawn is the same each time; `ATMOS_SKIES=10` draws ten times as many.
"""

import math
import os

import numpy as np
from hypothesis import HealthCheck, settings, strategies as st


_STEPS = 2**20


def within(low, high, *edges):
    """A number of a range, its ends, or what else is delicate."""
    inner = st.integers(0, _STEPS).map(lambda i: low + (high - low) * i / _STEPS)
    return st.one_of(st.sampled_from([low, high, *edges]), inner)


def decades(low, high, *edges):
    """The same of numbers of any size."""
    log = math.log(high / low) / _STEPS
    inner = st.integers(0, _STEPS).map(lambda i: low * math.exp(log * i))
    return st.one_of(st.sampled_from([low, high, *edges]), inner)


def rows(count, *numbers):
    """So many draws of some numbers, as an array with a row for each."""
    return st.lists(st.tuples(*numbers), min_size=count, max_size=count).map(np.array)


def drawn(count):
    """Decorates a test that is to be tried on so many draws."""
    return settings(
        max_examples=math.ceil(count * float(os.environ.get("ATMOS_SKIES", "1"))),
        derandomize=True,
        deadline=None,
        database=None,
        suppress_health_check=[HealthCheck.too_slow],
    )
