"""Errors of a run that ends at a sample next to the requested end time.

In: the samples of the last cycles, and by how many steps their end misses the requested end.
Out: errors by measure name. A recorded drive or a sweep ends at a given time, a march at a
whole step. All coarse runs end at the same sample, so that they do not show this error.
"""

import numpy as np

from ..core import Response
from .run_events import slips_and_displacements


def estimate_window_error(window: Response, period: float, offset: float) -> dict:
    """Return the changes of the measures if the window is shifted by some time steps, as a dict.

    An extreme value changes only if it lies at an end of the window.

    Parameters
    ----------
    window : Response
        Equally spaced samples (k,).
    period : float
        Period of the drive [s].
    offset : float
        Distance of the last sample from the requested end, in steps.
    """
    if abs(offset) < 1e-9 or window.time.size < 4:
        return {}
    offset = abs(offset)
    span = window.time[-1] - window.time[0]
    cycles = span / period
    slips, slides = slips_and_displacements(window)
    forces = window.extra.get("forces", window.force[:, None])
    parts = (forces[1:] + forces[:-1]) / 2 * np.diff(slides, axis=0)
    if "lateral_slides" in window.extra:
        pull, place = (window.extra[f"lateral_{name}"] for name in ("forces", "slides"))
        parts = parts + (pull[1:] + pull[:-1]) / 2 * np.diff(place, axis=0)
        forces = np.hypot(forces, pull)
    out = {
        "relative_displacement_amplitude": _change_of_end_maximum(window.output) / 2
        + _change_of_end_maximum(-window.output) / 2,
        "absolute_acceleration_peak": _change_of_end_maximum(np.abs(window.acceleration)),
        "drift_per_cycle": _change_of_drift(slides[:, 0], cycles),
        "friction_work": abs(float(parts[-1].sum())),
    }
    out["energy_dissipated"] = out["friction_work"]
    for k in range(slides.shape[1]):
        tail = f"_{k + 1}" if k else ""
        out |= {
            f"loop_area{tail}": abs(float(parts[-1, k] - parts[0, k])) / cycles,
            f"friction_force_peak{tail}": _change_of_end_maximum(np.abs(forces[:, k])),
            f"slip_amplitude{tail}": _change_of_end_maximum(slips[:, k]) / 2
            + _change_of_end_maximum(-slips[:, k]) / 2,
            f"stick_fraction{tail}": 1 / (window.time.size - 1),
        }
    return {name: offset * change for name, change in out.items()}


def _change_of_end_maximum(values) -> float:
    """Return the change of a maximum over one step if it lies at an end of the samples, else 0."""
    largest = int(np.argmax(values))
    if largest == 0:
        return abs(float(values[0] - values[1]))
    if largest == len(values) - 1:
        return abs(float(values[-1] - values[-2]))
    return 0.0


def _change_of_drift(slide, cycles: float) -> float:
    """Return the change of the drift per cycle [m] for a window shifted by one step.

    As in `loops.mean_drift`, below 1.5 cycles the drift is the motion between the ends of the window,
    else the difference between the means of two cycles.
    """
    if cycles < 1.5:
        return abs(float((slide[-1] - slide[-2]) - (slide[1] - slide[0]))) / cycles
    each = round((len(slide) - 1) / cycles)
    return (
        abs(float((slide[-1] - slide[-1 - each]) - (slide[each] - slide[0]))) / each / (cycles - 1)
    )
