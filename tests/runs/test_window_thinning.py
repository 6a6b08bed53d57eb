"""Thinning of the samples of a window, from which the error of the sampling is estimated."""

import numpy as np
from numpy.testing import assert_array_equal

from patchfem.core import Response
from patchfem.runs.rig.evaluation import thin_samples

HISTORIES = [name for name in Response.__dataclass_fields__ if name != "extra"]


def make_window(time) -> Response:
    """Return a window with these sample times [s], at which every history is equal to the time."""
    return Response(**dict.fromkeys(HISTORIES, np.asarray(time, float)))


def test_exact_thinning_keeps_even_samples_events_and_last_sample():
    """Even samples, samples between the equal steps, and the last sample stay; odd samples go."""
    thinned = thin_samples(make_window([0, 1, 2, 3, 3.5, 4, 5, 6, 7, 8, 9]))
    for name in HISTORIES:
        assert_array_equal(getattr(thinned, name), [0, 2, 3.5, 4, 6, 8, 9])
