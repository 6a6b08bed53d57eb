"""Reasons why a run has no value of a measure.

In: the measures of a run, its window and its drive. Out: measures without a value by name, each with
the reason as a sentence.
"""

from dataclasses import replace

import numpy as np

from ..core import Measure, Outcome
from ..formatting import format_number
from ..structure import drive_sizes
from .measures import Measures
from .rows import STEADY_AMPLITUDE, TABLE

ACCELERATIONS = ("absolute_acceleration_fundamental", "acceleration_distortion")
# Largest contribution of other modes to the relative displacement, as a fraction, at which the
# damping ratio is attributed to mode 1.
MAX_OTHER_MODES_FRACTION = 0.05
CYCLE_MEASURES = ("equivalent_stiffness", "secant_stiffness", "equivalent_damping", *ACCELERATIONS)
ALWAYS_STICKS_REASON = "the whole interface sticks throughout the last cycles"
UNBOUNDED_REASON = "no bounded motion exists at this drive"
OUTPUT_AT_REST_REASON = (
    "the output does not move: "
    "the first harmonic of its acceleration is 0 within the accuracy of the computation"
)
APERIODIC_REASON = "the drive is not periodic at the end of the run, so no period is known over which to take the mean slide"
BEATS_REASON = (
    "under tones the mean slide over one cycle changes within their beat without any drift; this measure exists "
    "only for a drive that repeats in every cycle"
)
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
    values, window, drive, has_loaded_interface: bool, other_modes_fraction: float = 0.0
) -> Measures:
    """Return the measures for which a run has no value, each with the reason, by name.

    Parameters
    ----------
    values : dict
        Values or Measures of the run by name.
    window : Response
        Last cycles.
    drive
        Drive of the last cycles.
    has_loaded_interface : bool
        Whether an interface carries a load.
    other_modes_fraction : float
        Fraction of the relative displacement due to modes other than the first [1].
    """
    reasons = {}
    for name in CYCLE_MEASURES if has_loaded_interface else ACCELERATIONS:
        reasons[name] = _reason_for_missing_cycle_value(
            name, values, window, drive, other_modes_fraction
        )
    if hasattr(drive, "band"):
        reasons |= dict.fromkeys(
            ("response_frequency", "response_damping"),
            "the frequency response (H1) has no peak within the frequency band of the drive",
        )
    if has_loaded_interface:
        reasons["slip_start_phase"] = _reason_for_missing_phase(values, drive)
    return {
        name: _make_missing_measure(name, reason)
        for name, reason in reasons.items()
        if name not in values
    }


def find_missing_secant(values) -> Measures:
    """Return a secant stiffness without a value if the friction force is not unique.

    The force of rigid friction is undetermined if the interface sticks at the largest displacement.

    Parameters
    ----------
    values : dict
        Measure by name.

    Returns
    -------
    dict
        Measure by name; {} if the value remains valid.
    """
    secant = values.get("secant_stiffness")
    stick_fraction = values.get("stick_fraction")
    if secant is None or stick_fraction is None or stick_fraction.value is None:
        return {}
    if stick_fraction.value <= TABLE["stick_fraction"].floor + (stick_fraction.error or 0.0):
        return {}
    return {"secant_stiffness": _remove_value(secant, STICKS_AT_REVERSAL_REASON)}


def find_missing_steady(values, outcome: Outcome, drive) -> Measures:
    """Return a steady amplitude without a value if the transient cannot be extrapolated.

    Parameters
    ----------
    values : dict
        Measure by name.
    outcome : Outcome
        Outcome of the run.
    drive
        Drive of the last cycles.

    Returns
    -------
    dict
        Measure by name; {} if the value exists or the drive is not periodic.
    """
    is_transient = outcome is Outcome.TRANSIENT and drive_sizes.is_periodic(drive)
    if STEADY_AMPLITUDE in values or not is_transient:
        return {}
    return {STEADY_AMPLITUDE: _make_missing_measure(STEADY_AMPLITUDE, CHANGE_NOT_RESOLVED_REASON)}


def _make_missing_measure(name: str, reason: str) -> Measure:
    """Return a measure without a value, with the reason."""
    row = TABLE[name]
    return Measure(None, row.unit, None, row.floor, reason=reason)


def _remove_value(measure: Measure, reason: str) -> Measure:
    """Return a measure with a reason in place of its value."""
    return replace(measure, value=None, error=None, reason=reason)


def find_missing_drift(values, drive) -> Measures:
    """Return a drift without a value if the drive is not periodic.

    Without a period, mean values differ even if there is no drift.

    Parameters
    ----------
    values : dict
        Measure by name.
    drive
        Drive of the last cycles.

    Returns
    -------
    dict
        Measure by name; {} if the value remains valid.
    """
    drift = values.get("drift_per_cycle")
    if drift is None or drive_sizes.is_periodic(drive):
        return {}
    reason = BEATS_REASON if hasattr(drive, "beat") else APERIODIC_REASON
    return {"drift_per_cycle": _remove_value(drift, reason)}


def find_missing_unbounded(values) -> Measures:
    """Return all measures except the load without values, for an unbounded motion."""
    out = {name: _remove_value(measure, UNBOUNDED_REASON) for name, measure in values.items()}
    if "normal_load" in values:
        out["normal_load"] = replace(values["normal_load"], error=None)
    return out


def find_missing_loops(values, window, drive) -> Measures:
    """Return the areas of the friction loops without values if the loops are not closed.

    The area of a closed loop is the dissipated energy. In a motion that is not periodic, as after a
    release, the interface also stores or returns energy. If this exceeds the dissipation, the area has no
    meaning. For several interfaces, only the sum of the energies is known: a loop does not close if its
    interface returns more energy than it takes although no energy is created. If all loops close, the
    result is {}.

    Parameters
    ----------
    values : dict
        Measure by name.
    window : Response
        Last cycles.
    drive
        Drive of the last cycles.
    """
    ledger = window.extra.get("ledger")
    loop = values.get("loop_area")
    if ledger is None or loop is None or drive_sizes.is_periodic(drive):
        return {}
    _, stored, dissipated, created = np.abs(ledger[:, -1] - ledger[:, 0])
    names = [name for name in values if name.startswith("loop_area")]
    open_names = []
    if len(names) == 1:
        cycles = (window.time[-1] - window.time[0]) / drive.period
        if stored > max(dissipated, loop.floor * cycles):
            open_names = names
    elif created <= 1e-9 * (stored + dissipated):
        for name in names:
            area = values[name]
            if area.value < -max(area.error or 0.0, area.floor):
                open_names.append(name)
    return {name: _remove_value(values[name], OPEN_LOOP_REASON) for name in open_names}


def _reason_for_missing_phase(values, drive) -> str:
    """Return the reason why the phase of slip onset has no value."""
    if not drive_sizes.is_sinusoidal(drive):
        return "the drive is not a sine at the end of the run, so the start of slip has no phase"
    stick_fraction = getattr(values.get("stick_fraction"), "value", values.get("stick_fraction"))
    if stick_fraction == 1.0:
        return f"{ALWAYS_STICKS_REASON}, so no slip starts"
    if stick_fraction:
        return "slip does not start at one phase of the half cycles: it starts several times, or not in all of them"
    return "the interface never sticks in the last cycles, so slip never starts after stick"


def _reason_for_missing_cycle_value(
    name: str, values, window, drive, other_modes_fraction: float
) -> str:
    """Return the reason why a cycle measure has no value."""
    if not drive_sizes.is_sinusoidal(drive):
        return "this measure exists only for a drive that is a sine at the end of the run"
    if not drive_sizes.has_full_cycle(window.time[-1] - window.time[0], drive):
        return "the run contains no whole cycle of the drive"
    if name in ACCELERATIONS and ACCELERATIONS[0] in values:
        return OUTPUT_AT_REST_REASON
    if name in ACCELERATIONS:
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
