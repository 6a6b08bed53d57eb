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
    loads : (s,)
        Normal loads [N].
    offsets : (s,)
        Lateral positions y of the strips [m].
    """
    extra = response.extra
    weights = np.asarray(loads) / np.sum(loads)
    slides, rates, forces = (extra[name] for name in ("slides", "slide_rates", "forces"))
    slips = extra.get("slips", slides)
    return replace(
        response,
        slide=slides @ weights,
        slide_rate=rates @ weights,
        force=forces.sum(axis=1),
        slip=slips @ weights,
        extra=extra | {"yaw_moment": forces @ np.asarray(offsets)},
    )


def estimate_lateral_motion(patch, window, period: float) -> tuple:
    """Estimate the lateral amplitude and the lengthening of the slip path of a patch that yaws.

    The yaw rotates the patch about its centre. A point of strip j moves by its displacement s_j
    along x, and by the rotation times x in the lateral direction.

    Returns
    -------
    tuple
        Lateral amplitude [m], and relative increase of the path of the last cycle due to the
        lateral motion (mean over the patch, weighted by the pressure).
    """
    last = window.time >= window.time[-1] - period * (1 + 1e-9)
    slides = window.extra["slides"][last]
    y = patch.strips.offsets
    x = np.abs(patch.x)
    yaw = (slides[:, -1] - slides[:, 0]) / (y[-1] - y[0])
    steps = np.abs(np.diff(slides, axis=0))
    yaw_steps = np.abs(np.diff(yaw))
    along = 0.0
    total = 0.0
    for step, force in zip(steps.T, patch.strips.force):
        is_loaded = force > 0
        along += float(step.sum() * force.sum())
        total += float(
            np.hypot(step[:, None], yaw_steps[:, None] * x[is_loaded]).sum(axis=0)
            @ force[is_loaded]
        )
    return float(np.ptp(yaw)) / 2 * float(x.max()), total / along - 1 if along > 0 else 0.0
