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
    return replace(done, response=as_one(done.response, loads, offsets), window=window,
                   marks=tuple(mark_as_one(mark, patch) for mark in done.marks),
                   step_force=(window.force[1:] + window.force[:-1]) / 2)


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
    return replace(response, slide=slides @ share, slide_rate=rates @ share, force=forces.sum(axis=1),
                   slip=slips @ share, extra=extra | {"yaw_moment": forces @ np.asarray(offsets)})
