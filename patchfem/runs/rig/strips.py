"""Several interfaces of one rig: each with its own law and load, and the springs that stand beside them."""

from dataclasses import replace

import numpy as np

from ...response.events import stuck_time
from ...response.measures import slip_measures
from ...response.run_events import of_log


def strip_loads(patch) -> np.ndarray:
    """Normal load (s,) [N] of every strip of a solved patch."""
    return patch.strips.force.sum(axis=1)


def joined(done, patch):
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


def other_windows(window) -> list:
    """The histories of the interfaces after the first as windows of their own."""
    extra = window.extra
    if "slides" not in extra:
        return []
    slips = extra.get("slips", extra["slides"])
    return [replace(window, slide=extra["slides"][:, k], slide_rate=extra["slide_rates"][:, k],
                    force=extra["forces"][:, k], slip=slips[:, k]) for k in range(1, slips.shape[1])]


def other_measures(window, drive, steps: int, log=None) -> dict:
    """Measures of the interfaces after the first, their number behind the name: slip_amplitude_2, stick_fraction_2,
    friction_force_peak_2, loop_area_2 (by the trapezoidal rule, which leaves nothing out where the friction is constant
    in slip). With the log of an exact run the stick fraction is that of its events."""
    out, events = {}, None
    if log is not None and "slides" in window.extra:
        events = of_log(log)
    for k, one in enumerate(other_windows(window), 2):
        found, length = slip_measures(one, drive, steps), one.time[-1] - one.time[0]
        found.pop("slip_start_phase", None)
        if events is not None:
            held = stuck_time(events, k, one.time[0], one.time[-1], bool(np.ptp(one.slip)))
            found["stick_fraction"] = min(held / length, 1.0)
        found |= {"friction_force_peak": float(np.abs(one.force).max()),
                  "loop_area": float(np.trapezoid(one.force, one.slide)) / max(length / drive.period, 1e-300)}
        out |= {f"{name}_{k}": value for name, value in found.items()}
    return out
