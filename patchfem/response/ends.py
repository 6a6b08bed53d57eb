"""What a run leaves open that ends at a sample beside the end that was asked for.

A record or a sweep ends where it ends, a march at a whole step. All coarser runs of it end at the same place, so they
do not show what that changes.
"""

import numpy as np

from ..core import Response
from .run_events import slips_of


def end_error(window: Response, period: float, offset: float) -> dict:
    """Change by name of what is read off the last cycles where they lie `offset` [steps] elsewhere.

    window: equally spaced samples (k,); period [s]. Extremes change where they lie at an end of the window only.
    """
    if abs(offset) < 1e-9 or window.time.size < 4:
        return {}
    offset, span = abs(offset), window.time[-1] - window.time[0]
    cycles, (slips, slides) = span / period, slips_of(window)
    forces = window.extra.get("forces", window.force[:, None])
    parts = (forces[1:] + forces[:-1]) / 2 * np.diff(slides, axis=0)
    if "lateral_slides" in window.extra:
        pull, place = (window.extra[f"lateral_{name}"] for name in ("forces", "slides"))
        parts = parts + (pull[1:] + pull[:-1]) / 2 * np.diff(place, axis=0)
        forces = np.hypot(forces, pull)
    out = {
        "relative_displacement_amplitude": _edge(window.output) / 2 + _edge(-window.output) / 2,
        "absolute_acceleration_peak": _edge(np.abs(window.acceleration)),
        "drift_per_cycle": _of_drift(slides[:, 0], cycles),
        "friction_work": abs(float(parts[-1].sum())),
    }
    out["energy_dissipated"] = out["friction_work"]
    for k in range(slides.shape[1]):
        tail = f"_{k + 1}" if k else ""
        out |= {
            f"loop_area{tail}": abs(float(parts[-1, k] - parts[0, k])) / cycles,
            f"friction_force_peak{tail}": _edge(np.abs(forces[:, k])),
            f"slip_amplitude{tail}": _edge(slips[:, k]) / 2 + _edge(-slips[:, k]) / 2,
            f"stick_fraction{tail}": 1 / (window.time.size - 1),
        }
    return {name: offset * change for name, change in out.items()}


def _edge(values) -> float:
    """Change over a step of the largest value (k,) where it lies at an end, else 0."""
    top = int(np.argmax(values))
    return (
        abs(float(values[0] - values[1]))
        if top == 0
        else abs(float(values[-1] - values[-2]))
        if top == len(values) - 1
        else 0.0
    )


def _of_drift(slide, cycles: float) -> float:
    """Change of the drift over a step: that of the motion from end to end, or of the means of two cycles."""
    if cycles < 1.5:
        return abs(float((slide[-1] - slide[-2]) - (slide[1] - slide[0]))) / cycles
    each = round((len(slide) - 1) / cycles)
    return (
        abs(float((slide[-1] - slide[-1 - each]) - (slide[each] - slide[0]))) / each / (cycles - 1)
    )
