"""Reasons why a run has no value of a measure.

In: the measures of a run, its window and its drive. Out: measures without a value by name, each with
the reason as a sentence.
"""

from dataclasses import replace

import numpy as np

from .. import structure
from ..core import Measure, Outcome
from ..formatting import format_number
from .measures import Measures
from .rows import MOTION_TABLE, STEADY_AMPLITUDE, select_names

# Largest contribution of other modes to the relative displacement, as a fraction, at which the
# damping ratio is attributed to mode 1.
MAX_OTHER_MODES_FRACTION = 0.05
CYCLE_MEASURES = select_names("cycle")
# The first of them is the amplitude of the other.
ACCELERATION_MEASURES = tuple(
    name for name in CYCLE_MEASURES if MOTION_TABLE[name].group == "motion"
)
ALWAYS_STICKS_REASON = "the whole interface sticks throughout the last cycles"
OUTPUT_AT_REST_REASON = (
    "the output does not move: "
    "the first harmonic of its acceleration is 0 within the accuracy of the computation"
)
APERIODIC_REASON = "the drive is not periodic at the end of the run, so no period is known over which to take the mean slide"
BEATS_REASON = (
    "under tones, or a drive and a load with other periods, the mean slide over one cycle changes within their beat without "
    "any drift; this measure exists only if drive and load repeat in every cycle"
)
COMMON_PERIOD_MESSAGE = "load and drive repeat together only after"
STICKS_AT_REVERSAL_REASON = (
    "the interface sticks where its slide is largest: during this stick the friction force takes different values "
    "at the same slide"
)
CHANGE_NOT_RESOLVED_REASON = (
    "the motion changes in such a way that the run does not show what it settles to: "
    "a longer run does"
)
OPEN_LOOP_REASON = (
    "the friction loop does not close: during the last cycles the stored energy changes by more than friction "
    "dissipates; the energy dissipated in the whole run is given by energy_dissipated"
)


def find_missing(
    values, span: float, drive, has_loaded_interface: bool, other_modes_fraction: float = 0.0
) -> Measures:
    """Return the measures for which a run has no value, each with the reason, by name.

    Parameters
    ----------
    values : dict
        Values or Measures of the run by name.
    span : float
        Duration of the last cycles [s].
    drive
        Drive of the last cycles.
    has_loaded_interface : bool
        Whether an interface carries a load.
    other_modes_fraction : float
        Fraction of the relative displacement due to modes other than the first [1].
    """
    reasons = {}
    for name in CYCLE_MEASURES if has_loaded_interface else ACCELERATION_MEASURES:
        reasons[name] = _explain_missing_cycle_value(
            name, values, span, drive, other_modes_fraction
        )
    if hasattr(drive, "band"):
        reasons |= dict.fromkeys(
            ("response_frequency", "response_damping"),
            "the frequency response (H1) has no peak within the frequency band of the drive",
        )
    if has_loaded_interface:
        reasons["slip_start_phase"] = _explain_missing_phase(values, drive)
    return {
        name: _make_missing_measure(name, reason)
        for name, reason in reasons.items()
        if name not in values
    }


def find_invalid(
    measures: Measures, motion: tuple, outcome: Outcome, *, is_rigid: bool
) -> Measures:
    """Return the measures whose values have no meaning in a motion, without value and with the reason, by name.

    - The secant stiffness of rigid friction that sticks at the largest displacement, where its force is not unique.
    - The drift unless drive and load repeat in every cycle: otherwise mean values differ even if there is no drift.
    - The areas of friction loops that are not closed.
    - The steady amplitude of a transient that cannot be extrapolated, or whose load has no common period with the
      drive in the window.

    Parameters
    ----------
    measures : dict of str to Measure
        Measures of the run by name.
    motion : tuple
        Response of the last cycles, their drive, and the number of cycles after which drive and load repeat.
    outcome : Outcome
        Outcome of the run.
    is_rigid : bool
        Whether the interface sticks without displacement.
    """
    window, drive, repeat = motion
    repeat = repeat or 1.0
    reasons = {}
    stick = measures.get("stick_fraction")
    if is_rigid and stick is not None and stick.value is not None:
        if stick.value > MOTION_TABLE["stick_fraction"].floor + (stick.error or 0.0):
            reasons["secant_stiffness"] = STICKS_AT_REVERSAL_REASON
    is_periodic = structure.drive_sizes.is_periodic(drive)
    if not is_periodic or repeat != 1:
        has_beat = is_periodic or hasattr(drive, "beat")
        reasons["drift_per_cycle"] = BEATS_REASON if has_beat else APERIODIC_REASON
    if not is_periodic:
        reasons |= dict.fromkeys(_list_open_loops(measures, window, drive), OPEN_LOOP_REASON)

    # Without a steady estimate, a transient motion states why.
    invalid = {}
    for name, reason in reasons.items():
        if name in measures:
            invalid[name] = replace(measures[name], value=None, error=None, reason=reason)
    if outcome is Outcome.TRANSIENT and is_periodic and STEADY_AMPLITUDE not in measures:
        reason = CHANGE_NOT_RESOLVED_REASON
        if structure.drive_sizes.count_cycles(window.time, drive) % repeat:
            reason = f"{COMMON_PERIOD_MESSAGE} {repeat:.0f} cycles of the drive, more than the run has to compare"
        invalid[STEADY_AMPLITUDE] = _make_missing_measure(STEADY_AMPLITUDE, reason)
    return invalid


def _list_open_loops(measures: Measures, window, drive) -> list[str]:
    """Return the names of those measures loop_area, loop_area_2, ... whose friction loop is not closed.

    The area of a closed loop is the dissipated energy. In a motion that is not periodic, as after a release, the
    interface also stores or returns energy. If this exceeds the dissipation, the area has no meaning. For several
    interfaces, only the sum of the energies is known: a loop does not close if its interface returns more energy than it
    takes although no energy is created. `measures` are those of the run by name, `drive` has the period, and `window` has
    the histories of the last cycles with the sums of energy.
    """
    ledger = window.extra.get("ledger")
    loop = measures.get("loop_area")
    if ledger is None or loop is None:
        return []
    _, stored, dissipated, created = np.abs(ledger[:, -1] - ledger[:, 0])
    areas = {name: one for name, one in measures.items() if name.startswith("loop_area")}
    if len(areas) == 1:
        cycles = window.span / drive.period
        return list(areas) if stored > max(dissipated, loop.floor * cycles) else []
    if created > 1e-9 * (stored + dissipated):
        return []
    return [name for name, one in areas.items() if one.value < -max(one.error or 0.0, one.floor)]


def _make_missing_measure(name: str, reason: str) -> Measure:
    """Return a measure without a value, with the reason."""
    row = MOTION_TABLE[name]
    return Measure(None, row.unit, None, row.floor, reason=reason)


def find_missing_unbounded(values) -> Measures:
    """Return the measures of a motion that grows without bound: all lose their values except the normal load."""
    out = {}
    for name, measure in values.items():
        out[name] = replace(
            measure, value=None, error=None, reason="no bounded motion exists at this drive"
        )
    if "normal_load" in values:
        out["normal_load"] = replace(values["normal_load"], error=None)
    return out


def _explain_missing_phase(values, drive) -> str:
    """Return the reason why the phase of slip onset has no value."""
    if not structure.drive_sizes.is_sinusoidal(drive):
        return "the drive is not a sine at the end of the run, so the start of slip has no phase"
    stick_fraction = getattr(values.get("stick_fraction"), "value", values.get("stick_fraction"))
    if stick_fraction == 1.0:
        return f"{ALWAYS_STICKS_REASON}, so no slip starts"
    if stick_fraction:
        return "slip does not start at one phase of the half cycles: it starts several times, or not in all of them"
    return "the interface never sticks in the last cycles, so slip never starts after stick"


def _explain_missing_cycle_value(
    name: str, values, span: float, drive, other_modes_fraction: float
) -> str:
    """Return the reason why a measure of the last cycles has no value.

    Parameters
    ----------
    name : str
        Name of the measure.
    values : dict
        Values of the measures that have one, by name.
    span : float
        Duration of the last cycles [s].
    drive
        Drive of the run.
    other_modes_fraction : float
        Contribution of other modes than the first one to the slide.
    """
    if not structure.drive_sizes.is_sinusoidal(drive):
        return "this measure exists only for a drive that is a sine at the end of the run"
    if not structure.drive_sizes.has_full_cycle(span, drive):
        return "the run contains no whole cycle of the drive"
    if name in ACCELERATION_MEASURES and ACCELERATION_MEASURES[0] in values:
        return OUTPUT_AT_REST_REASON
    if name in ACCELERATION_MEASURES:
        return "the output has no acceleration"
    if "equivalent_stiffness" not in values:
        return f"{ALWAYS_STICKS_REASON}, so the slide does not change and the loop has no width"
    if name == "equivalent_damping":
        if other_modes_fraction <= MAX_OTHER_MODES_FRACTION:
            return "mode 1 is a rigid-body mode, or does not move the interface"
        percent = format_number(100 * other_modes_fraction, 2)
        return (
            f"this measure is that of mode 1, but another mode contributes {percent} % of the slide"
        )
    return "none of the last cycles contains samples of the force both just before and just after the largest slide"
