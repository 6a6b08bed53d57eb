"""Why a run has no value of a measure: sentences that stand in its place."""

from ..core import Measure
from ..structure.drive_sizes import sinusoidal, whole
from .rows import TABLE

ACCELERATIONS = ("absolute_acceleration_fundamental", "acceleration_distortion")
CYCLIC = ("equivalent_stiffness", "secant_stiffness", "equivalent_damping", *ACCELERATIONS)
HOLDS = "the interface holds as a whole throughout the last cycles"


def without_value(values, window, drive, rubs: bool) -> dict:
    """Measures without a value, with the reason, by name: those that a coupled run can have and this one has not.

    values: name -> value or Measure of those it has; window: Response of its last cycles; drive; rubs: whether an
    interface bears a load.
    """
    lacking = {name: _of_cycles(name, values, window, drive) for name in CYCLIC
               if rubs or name in ACCELERATIONS}
    if rubs:
        lacking["slip_start_phase"] = _of_phase(values, drive)
    return {name: Measure(None, TABLE[name].unit, None, TABLE[name].floor, reason=reason)
            for name, reason in lacking.items() if name not in values}


def _of_phase(values, drive) -> str:
    if not sinusoidal(drive):
        return "the drive does not end as a sine, so it gives a slip no phase"
    stuck = getattr(values.get("stick_fraction"), "value", values.get("stick_fraction"))
    if stuck == 1.0:
        return f"{HOLDS}, so no slip starts"
    return "the interface never sticks in the last cycles, so no slip starts out of a stick"


def _of_cycles(name: str, values, window, drive) -> str:
    if not sinusoidal(drive):
        return "only a drive that ends as a sine has it"
    if not whole(window.time[-1] - window.time[0], drive):
        return "the run holds no whole cycle of the drive"
    if name in ACCELERATIONS:
        return "the output has no acceleration"
    if "equivalent_stiffness" not in values:
        return f"{HOLDS}, so its loop has no width"
    if name == "equivalent_damping":
        return "the first mode is rigid, so 2 pi K A^2 is 0"
    return "none of the last cycles shows the force on both sides of its largest slides"
