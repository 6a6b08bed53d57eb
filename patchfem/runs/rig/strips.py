"""Several interfaces of one rig: each with its own law and load, and the springs that stand beside them."""

from dataclasses import replace

import numpy as np


def strip_loads(patch) -> np.ndarray:
    """Normal load (s,) [N] of every strip of a solved patch."""
    return patch.strips.force.sum(axis=1)


def run_of_strips(done, patch):
    """A MarchResult of strips as that of the patch, averaged by `as_one`."""
    loads, offsets = strip_loads(patch), patch.strips.offsets
    window = as_one(done.window, loads, offsets)
    return replace(
        done,
        response=as_one(done.response, loads, offsets),
        window=window,
        marks=tuple(mark_as_one(mark, patch) for mark in done.marks),
        step_force=(window.force[1:] + window.force[:-1]) / 2,
    )


def mark_as_one(mark, patch):
    """A Mark of strips as that of the patch, averaged by `as_one`."""
    window = as_one(mark.window, strip_loads(patch), patch.strips.offsets)
    return replace(mark, window=window, step_force=(window.force[1:] + window.force[:-1]) / 2)


def as_one(response, loads, offsets):
    """Histories of strips as those of the patch: slide, speed and slip averaged with the loads, the resultant force;
    `extra` keeps the strips and has yaw_moment (k,) [N m], sum y f of the friction about +z on the upper piece."""
    extra, share = response.extra, np.asarray(loads) / np.sum(loads)
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


def across(patch, window, period: float) -> tuple:
    """What strips that yaw leave out: (amplitude [m] of the ends of the patch across x, share by which the slide path
    of the last cycle is longer with it, in the mean under the pressure).

    The yaw turns the patch about its middle: a point slides by s_j along x and by its rotation times x across.
    """
    last = window.time >= window.time[-1] - period * (1 + 1e-9)
    slides, y, x = window.extra["slides"][last], patch.strips.offsets, np.abs(patch.x)
    turned = (slides[:, -1] - slides[:, 0]) / (y[-1] - y[0])
    steps, turns, along, whole = np.abs(np.diff(slides, axis=0)), np.abs(np.diff(turned)), 0.0, 0.0
    for step, force in zip(steps.T, patch.strips.force):
        bears = force > 0
        along += float(step.sum() * force.sum())
        whole += float(
            np.hypot(step[:, None], turns[:, None] * x[bears]).sum(axis=0) @ force[bears]
        )
    return float(np.ptp(turned)) / 2 * float(x.max()), whole / along - 1 if along > 0 else 0.0
