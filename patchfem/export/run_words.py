"""The verdict of a run in at most four sentences: headline with the key numbers, outcome, place of contact, accuracy.

In: a `Result` and its quantities. Out: sentences. Every number in them is a quantity with its error.
"""

from collections.abc import Iterable
from itertools import product

import numpy as np

from .. import measures as run_measures
from .. import structure
from ..core import Outcome, remove_interface_number
from ..formatting import (
    UNIT_LADDERS,
    choose_unit,
    format_length,
    format_number,
    format_quantity,
    format_value,
)
from ..runs.results.patch_rows import find_unknown_measures
from ..runs.results.result import Result
from . import quantities
from .answer import JsonObject, Quantities, Quantity
from .rows import HEADLINES
from .run_data import SENSOR_UNITS, find_readings

RUN_CHECK_MEASURES = ("energy_balance", "work_check")  # measures that only check a run
# largest slip [m] and largest work relative to force times motion that are attributed to round-off
SLIP_ROUND_OFF = 1e-15
AREA_ROUND_OFF = 1e-12
ZERO_POSITION_FRACTION = 1e-9  # final position, relative to the largest motion, that counts as 0
# End of the name of a measure that states the scatter between random records
SCATTER_NAME_ENDING = "_scatter"


def make_verdict(result: Result, measures: Quantities, details: JsonObject) -> tuple[str, ...]:
    """Return the sentences about a run, the headline first.

    Parameters
    ----------
    result : Result
        Finished run.
    measures : dict of str to Quantity
        Its measures.
    details : dict
        Further keys of summary.json: `cycles`, `contact`, `loop`, `measured` and `run_away`, as far as they exist.
    """
    release, decay = describe_release(result)
    outcome = describe_outcome(result, measures, details)
    headline = release or _make_headline(result, measures, details)
    if result.outcome in (Outcome.NO_CONTACT, Outcome.NOT_CONVERGED) or not headline:
        return (outcome,)
    sentences = [headline, decay, outcome, _describe_readings(details.get("measured", ()))]
    if result.plan.kind != "patch":
        sentences.append(_describe_place(details.get("contact")))
    sentences.append(describe_accuracy(result, measures))
    return tuple([sentence for sentence in sentences if sentence][:4])


def _make_headline(result: Result, measures: Quantities, details: JsonObject) -> str:
    """Return the sentence with the key numbers of a run, or "" if it has none.

    `details` are further keys of summary.json, of which `contact` and `cycles` are used.
    """
    kind = _choose_headline(result, measures)
    parts = []
    for name, text in HEADLINES[kind].items():
        if name == "loop_area":
            parts += _describe_interfaces(result, measures, text)
        elif _is_nonzero(measures, name):
            part = text.format(_format_measure(name, measures))
            patch_model = result.plan.model.patch
            if name == "contact_fraction":
                if patch_model is not None and patch_model.area is not None:
                    part = part.replace("of the length", "of the face")
                if kind == "patch":
                    part += _describe_place(details.get("contact"), " ({})")
            if name == "worn_depth_max":
                is_mean = "worn_top_height" in measures or patch_model.gap.is_split
                part += " of the mean over the short waves" * is_mean
            parts.append(part)
    if not parts:
        return ""

    # The onset in a drive of levels takes the place of other parts, that of no level has a longer sentence.
    onset = _describe_onset(result, measures)
    # Largest number of measures in a headline
    n_parts = 3
    if onset:
        n_parts -= 1 + (measures["onset_level"].value is None)
    text = ", ".join(parts[:n_parts])
    cycles = details.get("cycles")
    # Largest part of a cycle that is missing through round-off
    if cycles is not None and cycles < 1 - 1e-6:
        text = f"in {cycles:.2g} of a cycle: {text}"
    if onset:
        text = f"{onset}; at the last level: {text}"
    peak = _describe_peak(result, measures)
    if peak:
        text = f"{peak}: {text}"
    return f"{text[0].upper()}{text[1:]}."


def _describe_onset(result: Result, measures: Quantities) -> str:
    """Return the clause on the onset in a run with drive levels, or "" for other runs."""
    onset = measures.get("onset_level")
    if onset is None:
        return ""
    if onset.value is None:
        return onset.reason
    event_by_kind = {
        "slip": "slip begins",
        "distortion": "the acceleration's distortion exceeds 3 %",
        "gauge": "the output exceeds drive.onset_length",
    }
    kind, _ = result.plan.model.rig.drive.levels.onset
    return f"{event_by_kind[kind]} at {_format_measure('onset_level', measures)}"


def _describe_peak(result: Result, measures: Quantities) -> str:
    """Return the clause on frequency and width of the peak of a response curve and on its folds, or "" without a peak."""
    peak = measures.get("peak_frequency")
    if peak is None or peak.value is None:
        return ""
    curve = result.motion.steady.curve
    folds = [
        format_value(fold, error, unit="Hz")
        for fold, error in zip(curve["folds"], curve["fold_errors"])
    ]
    place = _format_measure("peak_frequency", measures)
    width = measures.get("peak_width")
    if width is not None and width.value is not None:
        place += f", width {_format_measure('peak_width', measures)}"
    if folds:
        return f"at the peak, {place}, of a curve with folds at {' and '.join(folds)}"
    return f"at the peak, {place}"


def _choose_headline(result: Result, measures: Quantities) -> str:
    """Return which table of HEADLINES lists the measures of the headline of a run, such as "rig" or "wear"."""
    if "worn_volume" in measures or "worn_depth_max" in measures:
        return "wear"
    if "relative_displacement_rms" in measures:
        return "random"
    return result.plan.kind if result.plan.kind in ("patch", "bench") else "rig"


def _is_nonzero(measures: Quantities, name: str) -> bool:
    """Return whether a measure has a value that is not displayed as 0."""
    measure = measures.get(name)
    return (
        measure is not None and measure.value is not None and not quantities.is_zero(name, measure)
    )


def _describe_interfaces(result: Result, measures: Quantities, text: str) -> list[str]:
    """Return the dissipated energy of the first interface as a clause, or [] without it.

    `text` has a place for the energy. The clause says which of several interfaces is meant.
    """
    names = [
        name
        for name in measures
        if remove_interface_number(name) == "loop_area" and _is_nonzero(measures, name)
    ]
    if not names:
        return []
    if result.outcome in (Outcome.TRANSIENT, Outcome.GROWS):
        text += " (mean of the last cycles)"
    message = run_measures.outcome.OPEN_LOOP_MESSAGE
    if any(warning.startswith(message) for warning in result.warnings):
        text = "friction work of the last cycle {}"
    is_one = result.plan.model.patch is not None
    where = "" if len(names) == 1 or is_one else f" at interface 1 of {len(names)}"
    return [text.format(_format_measure(names[0], measures)) + where]


def describe_outcome(result: Result, measures: Quantities, details: JsonObject) -> str:
    """Return the sentence on how a run ended.

    `stuck` refers to the interface as a whole: if its last cycles dissipate or slip more than their error, a part slips.

    Parameters
    ----------
    result : Result
        Finished run.
    measures : dict of str to Quantity
        Its measures.
    details : dict
        Further keys of summary.json, such as `run_away`, as far as they exist.
    """
    outcome = result.outcome
    if outcome is Outcome.NOT_CONVERGED and (unknown := find_unknown_measures(result.measures)):
        return _describe_unknown(unknown)
    if result.plan.kind == "bench" and outcome is Outcome.DONE:
        return _describe_bench_outcome(measures, details)
    if run_away := details.get("run_away"):
        drive, knee = (format_quantity(run_away[name], "m s-2", 4) for name in ("drive", "knee"))
        return f"{outcome.sentence} Above {knee} friction alone does not limit it; the drive is {drive}."
    if outcome is Outcome.TRANSIENT and _is_release(result):
        return "The run ended before the motion came to rest; raise drive.cycles to see more of it."
    if outcome is Outcome.TRANSIENT:
        steady = result.measures.get(run_measures.rows.STEADY_AMPLITUDE)
        message = run_measures.reasons.COMMON_PERIOD_MESSAGE
        if steady is not None and steady.reason.startswith(message):
            return f"Whether the motion is steady is unknown: {steady.reason}."
    if outcome is Outcome.STUCK and {"loop_area", "slip_amplitude"} & measures.keys():
        return _describe_stuck_outcome(measures)
    return _describe_stability(result)


def _describe_unknown(names: list[str]) -> str:
    """Return the sentence that names the measures whose errors are as large as their values."""
    *first, last = names
    if not first:
        error = f"error of {last} is as large as the value"
    else:
        error = f"errors of {', '.join(first)} and {last} are as large as the values"
    return f"The {error}; use the other measures with their errors."


def _describe_stability(result: Result) -> str:
    """Return the sentence on the outcome of a run; for a steady motion with its regime and whether a disturbance decays."""
    sentence = result.outcome.sentence
    steady = result.motion.steady
    if steady is None:
        return sentence
    regime = steady.regime
    multiplier = float(np.abs(steady.multipliers).max(initial=0.0))
    if regime in ("stuck", "unbounded") or multiplier == 0:
        return f"{sentence[:-1]} (regime: {regime})."
    stability = "decays" if multiplier < 1 else "grows or persists"
    return (
        f"{sentence[:-1]} (regime: {regime}); a disturbance {stability} "
        f"(largest Floquet multiplier {multiplier:.4g})."
    )


def _describe_bench_outcome(measures: Quantities, details: JsonObject) -> str:
    """Return the sentence on slip and loss factor of a bench."""
    slip = measures.get("slip_amplitude")
    if (
        slip is not None
        and slip.value is not None
        and slip.value <= max(_find_error(slip), SLIP_ROUND_OFF)
    ):
        return _describe_no_slip("contact_fraction" in measures, "cycle")
    loop = details.get("loop")
    if loop is None:
        return Outcome.DONE.sentence
    amplitude = format_quantity(loop["slide_amplitude"], "m", 4)
    factor = format_value(loop["loss_factor"], loop["error"], 1e-9)
    return f"At a slide amplitude of {amplitude} the loss factor is {factor}."


def _find_error(quantity: Quantity) -> float:
    """Return the error of a quantity, or its floor (the smallest value that is not 0) if the error is unknown."""
    return quantity.floor if quantity.error is None else quantity.error


def _describe_no_slip(has_patch: bool, cycles: str) -> str:
    """Return the sentence that an interface does not slip.

    `cycles` says when, such as "cycle" or "10 cycles". At an edge where the pressure of a patch ends (`has_patch`), any
    force causes slip, which the mesh may not show.
    """
    limit = " beyond the error of this mesh; a slip zone smaller than an element cannot be detected"
    return f"The interface sticks: no slip in the last {cycles}{limit * has_patch}."


def _describe_stuck_outcome(measures: Quantities) -> str:
    """Return the sentence for an interface that sticks as a whole, with the largest slip or loss if a part of it slips."""
    has_patch = "contact_fraction" in measures
    part = "part of the patch slips" if has_patch else "part of it slips"
    force, motion = (
        measures[name].value or 0.0 if name in measures else 0.0
        for name in ("friction_force_peak", "relative_displacement_amplitude")
    )

    # the largest of several interfaces is named, unless all of them are round-off
    max_round_off = AREA_ROUND_OFF * abs(force * motion)
    limits = {"loop_area": max_round_off, "slip_amplitude": SLIP_ROUND_OFF}
    texts = {"loop_area": "{} per cycle", "slip_amplitude": "by {}"}
    for kind, limit in limits.items():
        slipping = {
            name: quantity
            for name, quantity in measures.items()
            if remove_interface_number(name) == kind and quantity.value
        }
        name = max(slipping, key=lambda one: slipping[one].value, default="")
        if name and slipping[name].value > max(_find_error(slipping[name]), limit):
            size = texts[kind].format(quantities.format_quantity(name, slipping[name]))
            return f"The interface as a whole sticks, but {part} ({size})."
    return _describe_no_slip(has_patch, "cycles")


def _describe_place(contact: JsonObject | None, sentence_form: str = "In contact: {}.") -> str:
    """Return where the contact is along x, such as "x = -6.35 to -3.56 mm"; "" if all of the length is in contact."""
    if not contact or not contact["stretches"]:
        return ""
    first, last, stretches = contact["from"], contact["to"], contact["stretches"]
    if len(stretches) == 1 and stretches[0][0] <= first and stretches[0][1] >= last:
        return ""
    unit, scale = choose_unit(UNIT_LADDERS["m"], max(abs(first), abs(last)))
    count = ""
    # Largest number of interfaces or contact regions whose values a sentence lists
    if len(stretches) > 3:
        count = f"{len(stretches)} regions from "
        stretches = [(stretches[0][0], stretches[-1][1])]
    texts = [
        f"{format_number(start * scale, 4)} to {format_number(end * scale, 4)}"
        for start, end in stretches
    ]
    return sentence_form.format(f"{count}x = {' and '.join(texts)} {unit}")


def _describe_readings(readings: Iterable[JsonObject]) -> str:
    """Return a sentence on the computed readings over the measured ones, or "" without a measurement.

    `readings` are as `list_readings` returns them, and those of repeat runs are left out.
    """
    text = " and ".join(
        f"the {row['reading']} is {format_number(row['ratio'], 3)} times the measured one"
        for row in readings
        if "repeat" not in row["reading"]
    )
    return f"{text[0].upper()}{text[1:]}." if text else ""


def list_readings(result: Result) -> list[JsonObject]:
    """Return the measured readings at the drive of the run beside the computed ones.

    Returns
    -------
    list of dict
        Keys `reading` (what, with "repeat run" where it is one), `measured` and `computed` (quantities) and `ratio`.
    """
    readings = find_readings(result)
    if readings is None:
        return []
    rows, computed = readings
    level = structure.drive_sizes.find_max_acceleration(result.plan.model.rig.drive.signal)

    # a row of another input belongs to another run
    # Largest relative difference of the measured input from the drive of the run.
    rows = [row for row in rows if abs(row.input - level) <= 0.01 * row.input]
    listed = []
    for row, (name, unit) in product(rows, SENSOR_UNITS.items()):
        value = getattr(row, name)
        if not value or name not in computed:
            continue
        listed.append(
            {
                "reading": f"{name} (repeat run)" if "R" in row.flag else name,
                "measured": Quantity(value, unit),
                "computed": computed[name],
                "ratio": computed[name].value / value,
            }
        )
    return listed


def describe_accuracy(result: Result, measures: Quantities) -> str:
    """Return the sentence that all errors are within the tolerance, with the largest; "" if a warning says more."""
    tolerance = result.plan.model.accuracy.tolerance
    if result.outcome is Outcome.GROWS and result.response is not None:
        end = format_quantity(result.response.time[-1], "s", 3)
        return f"The motion still grows after {end}: the measures are those of the last cycles, without errors."

    ratios = {
        name: measure.error_ratio(tolerance)
        for name, measure in result.measures.items()
        if measure.value is not None
        and measure.error is not None
        and not name.endswith(SCATTER_NAME_ENDING)
    }
    if not ratios or max(ratios.values()) > 1:
        return ""

    # errors that are too small to be displayed say nothing, and those of checks of a run concern no answer
    visible = {
        name: ratio
        for name, ratio in ratios.items()
        if name not in RUN_CHECK_MEASURES and "±" in _format_measure(name, measures)
    }
    # Some measures have a value without an error.
    errors = [one.error for one in result.measures.values() if one.value is not None]
    within = f"All{' stated' * (None in errors)} errors are within the tolerance {tolerance:g}"
    if not visible:
        return f"{within}."
    name = max(visible, key=lambda one: (visible[one], one))
    largest = format_number(100 * visible[name], 2)
    return (
        f"{within}; the largest is {largest} % of what it allows "
        f"({name}: {_format_measure(name, measures)})."
    )


def _format_measure(name: str, measures: Quantities) -> str:
    """Return a measure as text with its error, such as "14.808 ± 0.041 um"."""
    return quantities.format_quantity(name, measures[name])


def _is_release(result: Result) -> bool:
    """Return whether a run is a free motion after a release."""
    rig = result.plan.model.rig
    return rig is not None and rig.drive.is_release


def describe_release(result: Result) -> tuple[str, str]:
    """Return two sentences on a released output: where it comes to rest, and its decay; "" for what does not exist."""
    response = result.response
    if not _is_release(result) or response is None or response.time.size < 2:
        return "", ""
    amplitude = result.measures.get("relative_displacement_amplitude")
    error = getattr(amplitude, "error", None) or 0.0
    last = getattr(amplitude, "value", None)
    motion = describe_rest(response.time, response.output, error, last)
    start = format_length(response.output[0], 3)
    sentence = f"Released at {start}, the output {motion}."
    return sentence, _describe_decay(result.motion.decay)


def _describe_decay(decay) -> str:
    """Return a sentence on frequency and damping ratio at the start and at the end of a decay; "" without them."""
    if decay is None:
        return ""
    known = np.flatnonzero(np.isfinite(decay.damping_error + decay.frequency_error))
    # Smallest number of amplitudes of a decay for which its damping is printed.
    if known.size < 5:
        return ""
    parts = [
        f"{format_value(decay.frequency[k], decay.frequency_error[k], unit='Hz')} and damping ratio "
        f"{format_value(decay.damping[k], decay.damping_error[k])} at {format_quantity(decay.amplitude[k], 'm', 3)}"
        for k in (known[1], known[-1])
    ]
    return f"It decays with {', with '.join(parts)}."


def describe_rest(time, output, error: float = 0.0, last_amplitude: float | None = None) -> str:
    """Describe where and when a released motion comes to rest, or how it moves at the end.

    Parameters
    ----------
    time, output : (k,) ndarray
        Stored samples with all reversals [s], [m].
    error : float
        Error of the amplitude [m]; an output that moves by no more is at rest.
    last_amplitude : float, optional
        Measured amplitude of the last whole cycle [m], which the sentence states; by default that of the last tenth of the
        samples, in which the output may come to rest.
    """
    largest = np.abs(output).max()
    end = 0.0 if abs(output[-1]) < ZERO_POSITION_FRACTION * largest else output[-1]
    # Deviation from the final position, relative to this position, at which a released output is at
    # rest
    rest_limit = max(error, 5e-3 * abs(end), ZERO_POSITION_FRACTION * largest)
    last_tenth = time >= time[-1] - 0.1 * (time[-1] - time[0])
    end_amplitude = np.ptp(output[last_tenth]) / 2
    amplitude = end_amplitude if last_amplitude is None else last_amplitude
    if min(amplitude, end_amplitude) > rest_limit:
        end_time = format_quantity(time[-1], "s", 3)
        return f"still moves with an amplitude of {format_length(amplitude, 3)} after {end_time}"

    # it rests from the sample after the last one that is far from the end
    far = np.flatnonzero(np.abs(output - end) > rest_limit)
    if not far.size:
        return "does not move"
    rest = format_quantity(time[min(far[-1] + 1, time.size - 1)], "s", 3)
    return f"rests at {format_length(end, 3)} after {rest}"
