"""Results of a run as sentences, and its measures in groups, in the units that people use.

In: the summary of a run, as in summary.json. Out: strings, among them the verdict (`verdict_sentence`), the
headline (`headline_sentence`) and the table of measures (`format_measures`).
"""

import re
from collections.abc import Callable, Sequence
from html import escape
from math import ceil, floor, inf, isfinite, log10, pi
from types import MappingProxyType
from typing import NamedTuple

from ... import formatting
from ...core import Measure, Outcome, compute_allowed_error
from ...response.outcome import NOT_SETTLED_WARNING, OPEN_LOOP
from ...response.rows import TABLE as MOTION
from ...response.rows import add_interface_number, remove_interface_number
from ...runs.results.patch_rows import TABLE as STATIC
from ...runs.results.patch_rows import find_unknown_measures, minimum_value
from ...runs.results.result import Result
from ..summary import measure_object
from .document import sentence_html

G = 9.80665  # standard gravity [m/s^2]
LBF = 4.4482216152605  # pound-force [N]
INCH = 0.0254  # inch [m]
DEG = ("deg", 180 / pi)
IMPERIAL_UNITS = {  # imperial units in the form of formatting.UNIT_LADDERS
    "m": (("mil", 1e3 / INCH), ("in", 1 / INCH)),
    "m3": (("in^3", INCH**-3),),
    "rad": (DEG,),
    "N": (("lbf", 1 / LBF),),
    "N m": (("lbf in", 1 / LBF / INCH),),
    "J": (("in lbf", 1 / LBF / INCH),),
    "Pa": (("psi", INCH**2 / LBF), ("ksi", 1e-3 * INCH**2 / LBF)),
    "N m-1": (("lbf/in", INCH / LBF), ("klbf/in", 1e-3 * INCH / LBF)),
}
GROUPS = ("motion", "friction", "energy", "patch", "wear")
# Largest relative difference of two values of the contact fraction that are treated as equal.
EQUAL_FRACTION_TOL = 2e-3
MAX_LISTED = 3  # largest number of interfaces or contact regions that are listed one by one
SLIP_ROUND_OFF = 1e-15  # largest slide that is attributed to round-off [m]
WHOLE_RUN = "over the whole run"
LOOPS = "over the two stored cycles of the steady motion"
PERIOD_BY_ENGINE = {"harmonic": LOOPS}  # period to which energies refer, by method
OVER_MOTION_CYCLES = "over the cycles of the motion, not those of wear"
QUALIFIERS = {  # addition to a value that could be mistaken for another quantity
    "loop_area": "per cycle",
    "friction_work": WHOLE_RUN,
    "energy_dissipated": WHOLE_RUN,
    "energy_created": WHOLE_RUN,
    "stick_fraction": "of the interface as a whole",
    "equivalent_damping": "a damping ratio of mode 1",
}
# Suffix of the measure that states the scatter of a result between records of a random drive.
SCATTER = "_scatter"
RANDOM_MEASURES = {
    "relative_displacement_rms": "the displacement of the output is {} rms",
    "absolute_acceleration_rms": "the acceleration of the output is {} rms",
    "response_frequency": "the frequency response H1 peaks at {}",
    "response_damping": "the damping ratio of that peak is {}",
}
POWER = "friction_power"  # measure of a random drive, which has no cycle
UNFINISHED_DECAY = (
    "The run ended before the motion came to rest; raise drive.cycles to see more of the decay."
)
GROWING_MOTION = (
    "The motion still grows at the end of the run, after {}: the measures describe its last cycles and have no "
    "error estimate."
)
# Outcomes of a motion that still changes in its last cycles.
CHANGING_OUTCOMES = ("transient", "grows")
# Measures that are only known to lie between two drive levels of the scene, whatever the tolerance.
LEVEL_MEASURES = ("jump_level",)
RANGES = {"fraction": 1.0, "phase": pi}  # range of a measure [SI], by the last word of its name
# Largest work that is attributed to round-off, relative to the
# product of friction force and motion.
ROUND_OFF_FRACTION = 1e-12
NONE = MappingProxyType({})
UNKNOWN = " (error unknown)"
EXACT_NOTE = "values without ± are exact to the last digit shown"
SHARP_BUT_UNKNOWN = f"{EXACT_NOTE}, except where the error is unknown"


def display_units(name: str, value: float, unit: str, error: float | None = None) -> list:
    """Return the units and scales in which a measure is shown, metric first.

    The size of the value, or of its error, chooses them.

    Parameters
    ----------
    name : str
        The measure.
    value : float
        In SI; times scale it is in the unit.
    unit : str
        SI unit.
    error : float, optional
        In SI.

    Returns
    -------
    list
    """
    if is_share(name):
        return [("%", 100.0)]
    # The names of further interfaces end in a number.
    if re.sub(r"_\d+$", "", name).endswith("phase"):
        return [DEG]
    if unit == "m s-2":
        return [("g", 1 / G)]
    size = max(abs(value), error or 0.0) if isfinite(error or 0.0) else value
    return [
        formatting.choose_display_unit(value, unit, error),
        *([formatting.choose_unit(IMPERIAL_UNITS[unit], size)] if unit in IMPERIAL_UNITS else []),
    ]


def format_value_and_error(name: str, measure: dict, scale: float | None = None) -> tuple:
    """Format the value and the error of a measure as two strings.

    They are in the first unit of the measure, or in SI times `scale`.

    Parameters
    ----------
    name : str
    measure : dict
        As in summary.json.
    scale : float, optional

    Returns
    -------
    tuple of str
        The error is "" if it is unknown.
    """
    value = measure["value"]
    error = measure["error"]
    unit = measure["unit"]
    if value is None:
        return "-", ""
    scale = display_units(name, value, unit, error)[0][1] if scale is None else scale
    return formatting.round_to_error(
        value * scale,
        None if error is None else error * scale,
        format_zero(name, measure) * scale,
    )


def is_share(name: str) -> bool:
    """Return whether a measure is a fraction, which is shown in percent."""
    return re.sub(r"_\d+$", "", name).endswith("fraction")


def format_measure(name: str, value: float, unit: str, digits: int) -> str:
    """Format the value of a measure in a suitable unit, such as "46.68 mJ".

    Parameters
    ----------
    name : str
        The measure; a value below its floor is written as 0.
    value : float
        In SI.
    unit : str
        SI unit.
    digits : int

    Returns
    -------
    str
    """
    value, unit = (100 * value, "%") if is_share(name) else (value, unit)
    return formatting.format_quantity(value, unit, digits, format_zero(name))


def format_pair(name: str, low: float, high: float, unit: str, digits: int) -> tuple:
    """Format two values of a measure in one unit, or in two units if the values differ greatly.

    Parameters
    ----------
    name : str
        The measure.
    low, high : float
        In SI.
    unit : str
        SI unit.
    digits : int

    Returns
    -------
    tuple of str
    """
    texts = tuple(format_measure(name, value, unit, digits) for value in (low, high))
    if (
        is_share(name)
        or unit not in formatting.UNIT_LADDERS
        or texts[0].partition(" ")[2] == texts[1].partition(" ")[2]
        or "0" in texts
        or abs(high) > 1000 * abs(low)
    ):
        return texts
    common_unit, scale = formatting.choose_display_unit(max(abs(low), abs(high)), unit)
    return tuple(
        f"{formatting.format_number(value * scale, digits)} {common_unit}" for value in (low, high)
    )


def format_with_error(name: str, measure: dict) -> str:
    """Format a measure with its error, such as "14.808 ± 0.041 um"."""
    value, error = format_value_and_error(name, measure)
    if value == "-":
        return value
    unit, scale = display_units(name, measure["value"], measure["unit"], measure["error"])[0]
    if is_below_minimum(name, measure):
        return f"0 to {formatting.format_number((measure['value'] + measure['error']) * scale, 2)} {unit}".rstrip()
    return formatting.format_with_error(value, error, unit)


def is_below_minimum(name: str, measure: dict) -> bool:
    """Return whether a value minus its error is below the smallest possible value."""
    value = measure["value"]
    error = measure["error"]
    return minimum_value(name) == 0 and value is not None and bool(error) and error >= value > 0


def format_zero(name: str, measure: dict = NONE) -> float:
    """Return the absolute value [SI] below which a measure is shown as 0.

    It is the floor of its definition, or the floor in the run if this is smaller: a floor that the
    run has raised to the tolerance times larger terms is what is required of it, not what is known.
    """
    row = find_definition(name)
    floor_of_run = measure.get("floor") or inf
    return 0.0 if row is None else min(row.floor, floor_of_run)


def format_imperial(name: str, measure: dict) -> str:
    """Format a measure in imperial units with as many digits as its error allows.

    A value within its error counts as 0.
    """
    value = measure["value"]
    error = measure["error"]
    if (
        value is None
        or not isfinite(value)
        or format_value_and_error(name, measure)[0] == "0"
        or abs(value) <= (error or 0.0)
    ):
        return ""
    imperial_units = display_units(name, value, measure["unit"], error)[1:]
    return " = ".join(
        f"{format_value_and_error(name, measure, scale)[0]} {unit}"
        for unit, scale in imperial_units
        if abs(value) * scale >= 1e-3
    )


def _unknown_measures(measures: dict) -> str:
    """Return the names of static measures whose error is as large as their value, or "" if there are none."""
    measure_records = {
        name: Measure(**{key: measure[key] for key in ("value", "unit", "error")})
        for name, measure in measures.items()
    }
    return " and of ".join(find_unknown_measures(measure_records))


def verdict_sentence(summary: dict) -> str:
    """Return the sentence about how a run ended, from its summary.

    `stuck` refers to the interface as a whole. If the last cycles dissipate or slip more than their
    error, part of it slips, and the sentence says how much. For a bench the sentence also says
    whether it slipped.
    """
    outcome = Outcome(summary["outcome"])
    measures = summary["measures"]
    if outcome is Outcome.NOT_CONVERGED and (unknown := _unknown_measures(measures)):
        advice = "use the other measures with their stated errors"
        return f"The numerical error of {unknown} is as large as the value, so it is not known; {advice}."
    if summary["kind"] == "bench" and outcome is Outcome.DONE:
        slip_sentence = (
            _bench_loop_sentence(summary["loop"], measures["equivalent_stiffness"])
            if "loop" in summary
            else outcome.sentence
        )
        return _bench_slip_sentence(
            measures.get("slip_amplitude"), slip_sentence, "contact_fraction" in measures
        )
    if run_away := summary.get("run_away"):
        drive, knee = (format_measure("", run_away[name], "m s-2", 4) for name in ("drive", "knee"))
        return (
            f"{outcome.sentence} The drive, {drive}, is larger than {knee}, above which friction alone does not "
            "limit the amplitude at resonance."
        )
    if outcome is Outcome.TRANSIENT and any(
        one["effect"] == "drive.kind=free" for one in summary["effects"]
    ):
        return UNFINISHED_DECAY
    if outcome is not Outcome.STUCK or not {"loop_area", "slip_amplitude"} & measures.keys():
        return outcome.sentence
    force, motion = (
        measures.get(name, {}).get("value") or 0.0
        for name in ("friction_force_peak", "relative_displacement_amplitude")
    )
    rings = " The amplitude has not settled: it is that of a transient." * any(
        one.startswith(NOT_SETTLED_WARNING) for one in summary.get("warnings", ())
    )
    part = "part of the patch slips" if "contact_fraction" in measures else "part of it slips"
    for kind, threshold, form in (
        ("loop_area", ROUND_OFF_FRACTION * abs(force * motion), "{} per cycle"),
        ("slip_amplitude", 0.0, "by {}"),
    ):
        slipping_measures = {
            name: one
            for name, one in measures.items()
            if re.sub(r"_\d+$", "", name) == kind and one["value"]
        }
        name = max(
            slipping_measures,
            key=lambda candidate: slipping_measures[candidate]["value"],
            default="",
        )
        if name and slipping_measures[name]["value"] > max(
            _error_or_floor(slipping_measures[name]), threshold
        ):
            size = form.format(format_with_error(name, slipping_measures[name]))
            return f"The interface as a whole sticks, but {part} ({size}).{rings}"
    return _no_slip_sentence("contact_fraction" in measures, "cycles") + rings


def _no_slip_sentence(patch: bool, cycles: str) -> str:
    """Return the sentence for an interface on which no slip is found.

    On a patch, an edge at which the pressure ends slips under any force; if a mesh does not show
    this, nothing is claimed about the interior of an element.
    """
    return f"The interface sticks: no slip in the last {cycles}" + (
        " beyond the error of this mesh; a slip zone smaller than an element cannot be detected."
        if patch
        else "."
    )


def _bench_slip_sentence(slip: dict | None, first_sentence: str, patch: bool) -> str:
    """Return a sentence on the slip of a bench, if the slip exceeds its error.

    Parameters
    ----------
    slip : dict or None
        Slip amplitude, the mean weighted by the pressure.
    first_sentence : str
        Sentence that comes first.
    patch : bool
        Whether the contact is a patch.
    """
    if slip is None or slip["value"] is None:
        return first_sentence
    if slip["value"] <= max(_error_or_floor(slip), SLIP_ROUND_OFF):
        return f"{first_sentence} {_no_slip_sentence(patch, 'cycle')}"
    return (
        f"{first_sentence} Slip amplitude (half the peak-to-peak slip, averaged over the interface): "
        f"{format_with_error('slip_amplitude', slip)}."
    )


def _bench_loop_sentence(loop: dict, stiffness: dict) -> str:
    """Return the sentence about stiffness and damping of a bench; loop: from `summary.loop_entry`."""
    factor = loop["loss_factor"]
    error = loop["error"]

    def number(scale: float) -> str:
        """Format the loss factor with its error."""
        if error is not None and factor <= error:
            return f"at most {formatting.format_number((factor + error) * scale, 2)}"
        value, rounded_error = formatting.round_to_error(
            factor * scale, None if error is None else error * scale, 1e-9
        )
        return formatting.format_with_error(value, rounded_error, "")

    return (
        f"At a slide amplitude of {formatting.format_quantity(loop['slide_amplitude'], 'm', 4)} the "
        "interface has an equivalent stiffness of "
        f"{format_with_error('equivalent_stiffness', stiffness)} and a loss factor of "
        f"{number(1.0)} (equivalent damping ratio {number(0.5)})."
    )


def _error_or_floor(measure: dict) -> float:
    """Return the error of a measure in its unit, or its absolute error floor if no error was estimated."""
    return measure["floor"] if measure["error"] is None else measure["error"]


class Statement(NamedTuple):
    """Part of a headline: a measure, and a text into which its value is inserted."""

    measure: str
    text: str


def headline_sentence(
    summary: dict,
    cycles: float | None,
    number: Callable[[str, str], str] | None = None,
    released: str = "",
) -> str:
    """State the most important measures in one sentence, or return "" if there are none.

    Parameters
    ----------
    summary : dict
        As in summary.json.
    cycles : float or None
        Cycles of the drive in the run; None for a run without cycles.
    number : callable, optional
        Takes the text of a value and the name of its measure, and returns the text in the sentence.
    released : str
        Motion of a released output; it replaces the measures of the last cycles.

    Returns
    -------
    str
    """
    measures = summary["measures"]
    covers_cycle = cycles is None or cycles >= 1 - 1e-6
    statements = []
    if summary["outcome"] != "no_contact":
        statements += [*_wear_statements(measures), *_motion_statements(measures, released)]
        if covers_cycle and not released:
            statements += _energy_statements(summary)
        statements += _patch_statements(summary)
    parts = [
        part
        for part in (_fill_statement(statement, measures, number) for statement in statements)
        if part
    ]
    text = "; ".join(parts)
    if text and not covers_cycle and not released:
        text = f"in {cycles:.2g} of a cycle {text}"
    return f"{text[0].upper() + text[1:]}." if text else ""


def _fill_statement(
    statement: Statement, measures: dict, number: Callable[[str, str], str] | None
) -> str:
    """Insert the value of a measure into a statement, or return "" if the measure has no value."""
    name, text = statement
    if not name:
        return text
    measure = measures.get(name)
    if not measure or measure["value"] is None:
        return ""
    value, interval = record_interval(name, measures)
    value = value or format_with_error(name, measure)
    text = text.format(value if number is None else number(value, name))
    return f"{text} ({interval})" if interval else text


def _wear_statements(measures: dict) -> list:
    """Return the statement on the worn depth, or on the worn volume if the depth has no value."""
    texts_by_measure = {
        "worn_depth_max": "{} worn off at the deepest place",
        "worn_volume": "{} worn off",
    }
    return [Statement(*item) for item in texts_by_measure.items() if item[0] in measures][:1]


def _motion_statements(measures: dict, released: str) -> list:
    """Return the statements of a headline on the motion."""
    if released:
        rows = [("", released), ("friction_work", "friction dissipates {} during the whole run")]
    else:
        is_random = "relative_displacement_rms" in measures
        amplitude = (
            "half the peak-to-peak displacement of the output is {}"
            if is_random
            else "displacement amplitude at the output {} (half peak-to-peak)"
        )
        rows = [
            *RANDOM_MEASURES.items(),
            ("relative_displacement_amplitude", amplitude),
            ("relative_displacement_amplitude_steady", "this amplitude would settle at {}"),
            ("absolute_acceleration_peak", "peak acceleration {}"),
        ]
    if "relative_displacement_amplitude" not in measures:
        rows.append(("friction_ratio_peak", "friction ratio peaks at {}"))
    return [Statement(*row) for row in rows]


def _energy_statements(summary: dict) -> list:
    """Return the statements on the energy that friction dissipates.

    It is a power under a random drive, else an energy per cycle at each interface.
    """
    if POWER in summary["measures"]:
        return [Statement(POWER, "friction dissipates {}")]
    text = "{} dissipated per cycle"
    if any(warning.startswith(OPEN_LOOP) for warning in summary.get("warnings", ())):
        text = "friction work of the last cycle {}"
    elif summary["outcome"] in CHANGING_OUTCOMES and summary["kind"] in ("rig", "linear"):
        text += " (mean of the last cycles)"
    return _interface_statements(summary, "loop_area", text)


def _patch_statements(summary: dict) -> list:
    """Return the statements of a headline on the solved patch."""
    fraction = summary["measures"].get("contact_fraction", {}).get("value")
    where = describe_contact(summary.get("contact"), fraction)
    statements = _interface_statements(
        summary, "contact_fraction", "{} of the length in contact" + where
    )
    if summary["kind"] == "patch":
        statements.append(Statement("pressure_peak", "peak pressure {}"))
    return statements


def _interface_statements(summary: dict, name: str, text: str) -> list:
    """Return a statement for each interface, or only for the first if there are more than MAX_LISTED.

    Strips do not count as interfaces.
    """
    count = sum(remove_interface_number(measure) == name for measure in summary["measures"])
    if count < 2 or any(effect["effect"] == "contact.strips" for effect in summary["effects"]):
        return [Statement(name, text)]
    if count > MAX_LISTED:
        return [Statement(name, f"{text} at interface 1 of {count}")]
    return [
        Statement(add_interface_number(name, k), f"{text} at interface {k + 1}")
        for k in range(count)
    ]


def describe_contact(contact: dict | None, fraction: float | None = None) -> str:
    """Describe where the contact is along x, such as `, from x = -6.35 to -3.56 mm (left end)`.

    Parameters
    ----------
    contact : dict or None
        From `summary.contact_entry`.
    fraction : float, optional
        Fraction in contact, which may be extrapolated to finer meshes, whereas the positions are
        those of the finest mesh.

    Returns
    -------
    str
        "" if all of the length is in contact, or if this is not known.
    """
    if not contact or not contact["stretches"]:
        return ""
    first = contact["from"]
    last = contact["to"]
    stretches = contact["stretches"]
    touches_left_end = stretches[0][0] <= first
    touches_right_end = stretches[-1][1] >= last
    if touches_left_end and touches_right_end and len(stretches) == 1:
        return ""
    unit, scale = formatting.choose_unit(formatting.UNIT_LADDERS["m"], max(abs(first), abs(last)))
    shortest_length = min(
        [1e-3 * (last - first), *(1e-2 * (end - start) for start, end in stretches if end > start)]
    )
    # With these digits, the two ends of the shortest region differ.
    digits = max(0, -floor(log10(shortest_length * scale)))

    def number(position: float) -> str:
        """Format a position [m] in the unit of the sentence."""
        return (
            f"{round(position * scale, digits) + 0.0:.{digits}f}".rstrip("0").rstrip(".")
            if digits
            else f"{position * scale:.0f}"
        )

    count = len(stretches)
    parts = stretches if count <= MAX_LISTED else [[stretches[0][0], stretches[-1][1]]]
    if count == 1 and parts[0][0] == parts[0][1]:
        return f", at x = {number(parts[0][0])} {unit}"
    fraction_on_mesh = sum(end - start for start, end in stretches) / (last - first)
    agrees = (
        fraction is None
        or abs(fraction_on_mesh - fraction) <= EQUAL_FRACTION_TOL * fraction
        or f"{fraction_on_mesh:.3g}" == f"{fraction:.3g}"
    )
    mesh_note = (
        ""
        if agrees
        else f" on the finest mesh ({100 * fraction_on_mesh:.3g} %; the fraction before is extrapolated from all meshes)"
    )
    ranges = " and from ".join(
        f"{number(start)} to {number(end)} {unit}{' (left end)' * (start <= first)}{' (right end)' * (end >= last)}"
        for start, end in parts
    )
    return (
        f", from x = {ranges}{mesh_note}"
        if count <= MAX_LISTED
        else f", in {count} stretches from x = {ranges}{mesh_note}"
    )


def tolerance_sentence(result: Result) -> str:
    """State that all measures meet the tolerance, which limits apply, and how large the largest error is.

    Parameters
    ----------
    result : Result

    Returns
    -------
    str
        "" if a measure misses the tolerance (a warning says so) or no error is known.
    """
    tolerance = result.plan.model.accuracy.tolerance
    with_error = {
        name: one
        for name, one in result.measures.items()
        if one.value is not None and one.error is not None and not name.endswith(SCATTER)
    }
    if result.outcome is Outcome.GROWS and result.response is not None:
        return GROWING_MOTION.format(
            formatting.format_quantity(float(result.response.time[-1]), "s", 3)
        )
    if not with_error or max(one.error_ratio(tolerance) for one in with_error.values()) > 1:
        return ""
    texts_of = {
        name: format_with_error(name, measure_object(one)) for name, one in with_error.items()
    }
    visible = {
        name: with_error[name]
        for name, text in texts_of.items()
        if "±" in text and not text.startswith("0 ")
    }
    absolute = [name for name, one in visible.items() if one.error > tolerance * abs(one.value)]
    relative = {
        name: one.error / abs(one.value) for name, one in visible.items() if name not in absolute
    }
    sentence = f"Every measure with an error estimate meets the tolerance {tolerance:g}"
    if absolute:
        sentence += f" ({_absolute_limits(absolute, with_error, tolerance)})"
    if relative:
        name = max(relative, key=lambda one: (relative[one], one))
        which = "of the other errors" if absolute else "error"
        largest_ratio = formatting.format_number(relative[name], 2)
        sentence += (
            f"; the largest {which} is {largest_ratio} of the value ({name}, {texts_of[name]})"
        )
    if len(visible) < len(with_error):
        unknown = any(
            measure.value is not None and measure.error is None
            for measure in result.measures.values()
        )
        sentence += f"; {SHARP_BUT_UNKNOWN if unknown else EXACT_NOTE}"
    return f"{sentence}."


def _absolute_limits(names: list, measures: dict, tolerance: float) -> str:
    """State the absolute error limits of measures whose error exceeds the tolerance times their value."""
    parts = []
    for name in names:
        measure = measures[name]
        full_range = next(
            (size for kind, size in RANGES.items() if remove_interface_number(name).endswith(kind)),
            0.0,
        )
        limit = compute_allowed_error(tolerance, measure.value, measure.floor)
        if name in LEVEL_MEASURES:
            parts.append(f"{name}: one step between the drive levels of the scene")
        elif measure.error <= tolerance * full_range:
            parts.append(
                f"{name}: {tolerance:g} of its range of {_plain_value(name, full_range, measure.unit)}"
            )
        else:
            parts.append(f"{name}: {_plain_value(name, limit, measure.unit)}")
    return "; ".join(parts)


def _plain_value(name: str, value: float, unit: str) -> str:
    """Format a value [SI] of a measure to three digits."""
    display_unit, scale = display_units(name, value, unit)[0]
    return f"{formatting.format_number(value * scale, 3)} {display_unit}".rstrip()


def measure_link(text: str, name: str, attributes: str = "") -> str:
    """Return a text as a link to the definition of a measure on the same page.

    Parameters
    ----------
    text : str
    name : str
        The measure.
    attributes : str
        Further attributes of the link, with a leading space.
    """
    return f"<a{attributes} href='#measure-{escape(name)}'>{escape(text)}</a>"


def find_definition(name: str, has_patch: bool = False):
    """Return the definition of a measure, whose name may end in an interface number.

    None if there is none. has_patch: whether a patch was pressed, which has a load of its own.
    """
    for table in (STATIC, MOTION) if has_patch else (MOTION, STATIC):
        for candidate in (name, re.sub(r"_\d+$", "", name)):
            if candidate in table:
                return table[candidate]
    return None


def measure_meaning(name: str) -> str:
    """Return the definition of a measure as a sentence, or "" if no table contains it."""
    row = find_definition(name)
    return "" if row is None else row.text


def measure_group(name: str, has_patch: bool = True) -> str:
    """Return the group of measures under which a measure is shown."""
    row = find_definition(name, has_patch)
    return GROUPS[0] if row is None else row.group


def order_measures(measures: dict) -> dict:
    """Sort measures in the order in which they are shown.

    Under a random drive those that a record determines come first; their scatter is shown with them
    and is left out.
    """
    random_measures = [name for name in measures if f"{name}{SCATTER}" in measures]
    return {
        name: measures[name]
        for name in dict.fromkeys((*random_measures, *measures))
        if name.removesuffix(SCATTER) not in random_measures or name in random_measures
    }


def record_interval(name: str, measures: dict) -> tuple:
    """Format a measure under random excitation with its 95 % interval over records.

    They have the digits that the scatter of records allows; ("", "") for any other measure.
    """
    measure = measures.get(name, NONE)
    scatter = measures.get(f"{name}{SCATTER}", NONE)
    if measure.get("value") is None or scatter.get("value") is None:
        return "", ""
    value = measure["value"]
    half_width = scatter["value"]
    unit, scale = display_units(name, value, measure["unit"])[0]
    digits = max(2, 2 + ceil(log10(abs(value) / half_width))) if half_width > 0 and value else 6
    value_text, low, high = (
        formatting.format_number(at * scale, digits + extra)
        for at, extra in ((value, 1), (max(value - half_width, 0.0), 0), (value + half_width, 0))
    )
    return f"{value_text} {unit}".strip(), f"95 % interval {low} to {high} {unit}".strip()


def format_measures(measures: dict, engine: str = "") -> list[str]:
    """Return a line for each measure, by groups, with its error or the reason why it has no value.

    Under a random drive a line also has the interval over other records.

    Parameters
    ----------
    measures : dict
        As in summary.json.
    engine : str
        Name of the engine, as in the summary.

    Returns
    -------
    list of str
    """
    all_measures = measures
    measures = order_measures(measures)
    width = max(map(len, measures), default=0)
    all_lines = []
    has_patch = "contact_fraction" in measures
    range_text = (
        OVER_MOTION_CYCLES if "worn_volume" in measures else PERIOD_BY_ENGINE.get(engine, WHOLE_RUN)
    )
    for group in GROUPS:
        lines = [
            f"  {name:<{width}}  {_format_measure_line(name, measure, range_text, POWER in all_measures)}"
            f"{_format_record_interval(name, all_measures)}"
            for name, measure in measures.items()
            if measure_group(name, has_patch) == group
        ]
        all_lines += [group, *lines] if lines else []
    return all_lines


def notebook_html(summary: dict, sentence: str, cycles: float | None, released: str = "") -> str:
    """Return the results as unstyled HTML, for a notebook.

    Parameters
    ----------
    summary : dict
        As in summary.json.
    sentence : str
        How the run ended.
    cycles, released
        As for `headline_sentence`.

    Returns
    -------
    str
    """
    rows = []
    measures = summary["measures"]
    for line in format_measures(measures, summary.get("numerics", {}).get("engine", "")):
        name, _, value = line.strip().partition(" ")
        cells = f"<td>{escape(name)}</td><td style='text-align:right'>{escape(value.strip())}</td>"
        rows.append(f"<tr>{cells if value else f'<th colspan=2>{escape(name)}</th>'}</tr>")
    title = f"<b>{escape(summary['title'])}</b><br>" if summary["title"] else ""
    warnings = "".join(f"<p>&#9888; {sentence_html(text)}</p>" for text in summary["warnings"])
    headline = escape(
        f"{summary['outcome']}: {sentence} {headline_sentence(summary, cycles, released=released)}"
    )
    return f"<div>{title}{headline}{warnings}<table>{''.join(rows)}</table></div>"


def _format_record_interval(name: str, measures: dict) -> str:
    """Format the interval over other random records, and explain the error."""
    text = record_interval(name, measures)[1]
    numerics = (
        "± is the numerical error; " if "±" in format_with_error(name, measures[name]) else ""
    )
    return f" ({numerics}{text} for other records)" if text else ""


def _format_measure_line(name: str, measure: dict, range_text: str, is_random: bool) -> str:
    """Format a measure with its error, or the reason why it has no value."""
    if measure.get("reason"):
        return f"- ({measure['reason']})"
    qualifier = QUALIFIERS.get(re.sub(r"_\d+$", "", name))
    qualifier = range_text if qualifier == WHOLE_RUN else qualifier
    qualifier = (
        f"{qualifier} of the first mode" if is_random and qualifier == "per cycle" else qualifier
    )
    unknown = UNKNOWN if measure["error"] is None and measure["value"] is not None else ""
    return f"{format_with_error(name, measure)}{unknown}{f', {qualifier}' if qualifier else ''}"


def join_sentences(sentences: Sequence) -> str:
    """Join sentences with semicolons, or return "" if there are none."""
    first, *others = sentences or [""]
    clauses = [
        first,
        *(f"{one[0].lower() if one[1:2].islower() else one[0]}{one[1:]}" for one in others),
    ]
    return "; ".join(one.rstrip(".") for one in clauses) + "." * bool(first)
