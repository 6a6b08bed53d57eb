"""Average of the histories of strips that slide independently.

In: a run in which each strip is an interface, and the Patch. Out: the run with the histories of a
single interface.
"""

from dataclasses import replace

import numpy as np


def compute_strip_loads(patch) -> np.ndarray:
    """Return the normal load (s,) [N] on each strip of a patch."""
    return patch.strips.force.sum(axis=1)


def average_march_over_strips(march, patch):
    """Average the histories of a time integration of independently sliding strips."""
    loads = compute_strip_loads(patch)
    offsets = patch.strips.offsets
    window = average_histories_over_strips(march.window, loads, offsets)
    return replace(
        march,
        response=average_histories_over_strips(march.response, loads, offsets),
        window=window,
        step_force=(window.force[1:] + window.force[:-1]) / 2,
    )


def average_histories_over_strips(response, loads, offsets):
    """Average the histories of independently sliding strips.

    Displacement, velocity and slip are means weighted by the loads; the force is the resultant.
    `extra` retains the histories of the strips, and gets the yaw moment (k,) [N m], i.e. the sum of
    y f of the friction on the upper piece.

    Parameters
    ----------
    response : Response
        Histories in which each strip is an interface.
    loads : (s,)
        Normal loads [N].
    offsets : (s,)
        Lateral positions y of the strips [m].
    """
    weights = np.asarray(loads) / np.sum(loads)
    return replace(
        response,
        slide=response.slides @ weights,
        slide_rate=response.extra["slide_rates"] @ weights,
        force=response.forces.sum(axis=1),
        slip=response.slips @ weights,
        extra=response.extra | {"yaw_moment": response.forces @ np.asarray(offsets)},
    )
