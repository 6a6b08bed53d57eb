"""Histories of strips that slide independently, averaged to those of the patch.

In: a run in which each strip is an interface, and the pressed patch. Out: the run with the
histories of a single interface.
"""

from dataclasses import replace

import numpy as np


def strip_loads(patch) -> np.ndarray:
    """Return the normal load (s,) [N] on each strip of a solved patch."""
    return patch.strips.force.sum(axis=1)


def average_march(done, patch):
    """Average a march of independently sliding strips over the patch."""
    loads = strip_loads(patch)
    offsets = patch.strips.offsets
    window = average_strips(done.window, loads, offsets)
    return replace(
        done,
        response=average_strips(done.response, loads, offsets),
        window=window,
        marks=tuple(average_mark(mark, patch) for mark in done.marks),
        step_force=(window.force[1:] + window.force[:-1]) / 2,
    )


def average_mark(mark, patch):
    """Average one stored cycle of independently sliding strips over the patch."""
    window = average_strips(mark.window, strip_loads(patch), patch.strips.offsets)
    return replace(mark, window=window, step_force=(window.force[1:] + window.force[:-1]) / 2)


def average_strips(response, loads, offsets):
    """Average the histories of independently sliding strips over the patch.

    Slide, speed and slip are means weighted by the loads, the force is the resultant. `extra` keeps
    the strips, and has the yaw moment (k,) [N m], the sum of y f of the friction about +z on the
    upper piece.

    Parameters
    ----------
    response : Response
    loads : (s,)
        Normal loads [N].
    offsets : (s,)
        Lateral positions y of the strips [m].
    """
    extra = response.extra
    share = np.asarray(loads) / np.sum(loads)
    slides, rates, forces = (extra[name] for name in ("slides", "slide_rates", "forces"))
    slips = extra.get("slips", slides)
    return replace(
        response,
        slide=slides @ share,
        slide_rate=rates @ share,
        force=forces.sum(axis=1),
        slip=slips @ share,
        extra=extra | {"yaw_moment": forces @ np.asarray(offsets)},
    )


def estimate_lateral_motion(patch, window, period: float) -> tuple:
    """Estimate the lateral amplitude and the longer slide path of a patch that yaws.

    The yaw rotates the patch about its middle: a point slides by s_j along x, and by the rotation
    times x across it.

    Returns
    -------
    tuple
        Amplitude [m], and fraction by which the lateral motion makes the slide path of the last
        cycle longer (mean over the patch, weighted by the pressure).
    """
    last = window.time >= window.time[-1] - period * (1 + 1e-9)
    slides = window.extra["slides"][last]
    y = patch.strips.offsets
    x = np.abs(patch.x)
    turned = (slides[:, -1] - slides[:, 0]) / (y[-1] - y[0])
    steps = np.abs(np.diff(slides, axis=0))
    turns = np.abs(np.diff(turned))
    along = 0.0
    whole = 0.0
    for step, force in zip(steps.T, patch.strips.force):
        bears = force > 0
        along += float(step.sum() * force.sum())
        whole += float(
            np.hypot(step[:, None], turns[:, None] * x[bears]).sum(axis=0) @ force[bears]
        )
    return float(np.ptp(turned)) / 2 * float(x.max()), whole / along - 1 if along > 0 else 0.0
