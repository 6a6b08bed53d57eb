"""Average of the histories of strips that slide independently.

In: a run in which each strip is an interface, and the Patch. Out: the run with the histories of a
single interface.
"""

from dataclasses import replace

import numpy as np


def compute_strip_loads(patch) -> np.ndarray:
    """Return the normal load (s,) [N] on each strip of a patch."""
    return patch.strips.force.sum(axis=1)


def average_over_strips(run, patch):
    """Return a run with the histories of independently sliding strips averaged, in `response` and `window`.

    Displacement, velocity and slip are means weighted by the loads; the force is the resultant.
    `extra` retains the histories of the strips, and gets the yaw moment (k,) [N m], i.e. the sum of
    y f of the friction on the upper piece at the lateral positions y of the strips.
    """
    loads = compute_strip_loads(patch)
    weights = loads / loads.sum()

    def average(histories):
        """Return the histories of the strips as those of one interface that carries the whole load."""
        return replace(
            histories,
            slide=histories.slides @ weights,
            slide_rate=histories.extra["slide_rates"] @ weights,
            force=histories.forces.sum(axis=1),
            slip=histories.slips @ weights,
            extra=histories.extra | {"yaw_moment": histories.forces @ patch.strips.offsets},
        )

    return replace(run, response=average(run.response), window=average(run.window))
