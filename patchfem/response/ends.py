"""Errors of the measures because the last sample does not lie at the requested end time.

In: the samples of the last cycles, and the distance of the last sample from the requested end.
Out: errors by measure name. A march ends at a whole step, whereas a recorded drive or a sweep may
end between two steps. Coarse runs do not show this error, because they end at the same sample.
"""

import numpy as np

from ..core import Response
from .events import slips_and_displacements
from .measures import Values


def estimate_window_error(window: Response, period: float, offset: float) -> Values:
    """Return the changes of the measures if the window is shifted by a number of time steps.

    The peak of a measure changes only if it lies at an end of the window.

    Parameters
    ----------
    window : Response
        Equally spaced samples (k,).
    period : float
        Period of the drive [s].
    offset : float
        Distance of the last sample from the requested end, in time steps.
    """
    if abs(offset) < 1e-9 or window.time.size < 4:
        return {}

    offset = abs(offset)
    cycles = (window.time[-1] - window.time[0]) / period
    slips, slides = slips_and_displacements(window)
    forces = window.extra.get("forces", window.force[:, None])
    step_works = (forces[1:] + forces[:-1]) / 2 * np.diff(slides, axis=0)

    # A shift by one step adds the last step and, in a window of fixed length, removes the first one.
    changes = {
        "relative_displacement_amplitude": _change_of_maximum_at_end(window.output) / 2
        + _change_of_maximum_at_end(-window.output) / 2,
        "absolute_acceleration_peak": _change_of_maximum_at_end(np.abs(window.acceleration)),
        "drift_per_cycle": _change_of_drift(slides[:, 0], cycles),
        "friction_work": abs(float(step_works[-1].sum())),
    }
    changes["energy_dissipated"] = changes["friction_work"]

    for k in range(slides.shape[1]):
        suffix = f"_{k + 1}" if k else ""
        changes |= {
            f"loop_area{suffix}": abs(float(step_works[-1, k] - step_works[0, k])) / cycles,
            f"friction_force_peak{suffix}": _change_of_maximum_at_end(np.abs(forces[:, k])),
            f"slip_amplitude{suffix}": _change_of_maximum_at_end(slips[:, k]) / 2
            + _change_of_maximum_at_end(-slips[:, k]) / 2,
            f"stick_fraction{suffix}": 1 / (window.time.size - 1),
        }

    return {name: offset * change for name, change in changes.items()}


def _change_of_maximum_at_end(values) -> float:
    """Return the change of a maximum over one step if it is the first or last sample, else 0."""
    largest = int(np.argmax(values))
    if largest == 0:
        return abs(float(values[0] - values[1]))
    if largest == len(values) - 1:
        return abs(float(values[-1] - values[-2]))
    return 0.0


def _change_of_drift(slide, cycles: float) -> float:
    """Return the change of the drift per cycle [m] if the window is shifted by one step.

    The drift is defined as in `loops.mean_drift`: by the ends of a window below 1.5 cycles, else by the
    means of two cycles.
    """
    if cycles < 1.5:
        return abs(float((slide[-1] - slide[-2]) - (slide[1] - slide[0]))) / cycles
    cycle = round((len(slide) - 1) / cycles)
    return (
        abs(float((slide[-1] - slide[-1 - cycle]) - (slide[cycle] - slide[0])))
        / cycle
        / (cycles - 1)
    )
