"""Limits of a swept key: largest values at which measures of motion and patch stay nearly the same.

The first case is the reference. A measure reaches its limit if it differs from this case by 5 %;
the peak pressure, if it has doubled. The limit lies between the last case that is surely within it
and the first case that is surely beyond it, where the numerical errors of the measure are added to
its change. Between these two cases the limit is interpolated linearly, or over the logarithm of the
key if its values are spaced by factors. A case that did not settle, or whose measure misses its
tolerance, counts neither as within nor as beyond.
"""

from collections.abc import Sequence
from html import escape
from math import ceil, exp, floor, log, log10
from typing import NamedTuple

import numpy as np

from ...formatting import UNIT_LADDERS, choose_unit, format_number
from ..written import NUMBER_PATTERN, drop_repeated_unit, measure_label
from . import document
from .key_lines import group_cases_along_key, key_formatter
from .sentences import format_measure, format_zero, measure_link

# Relative change at which a measure reaches its limit; a change of 5 %
# is commonly called negligible.
LARGEST_CHANGE = 0.05
DOUBLING = 1.0  # relative change at which the peak pressure reaches its limit, a doubling
MOTION_MEASURES = (
    "relative_displacement_amplitude",
    "absolute_acceleration_peak",
    "slip_amplitude",
    "loop_area",
    "friction_force_peak",
    "friction_ratio_peak",
    "onset_level",
)
STIFFNESS_MEASURES = ("normal_stiffness", "tangential_stiffness")
CHANGE_AT_LIMIT = {
    **dict.fromkeys((*MOTION_MEASURES, *STIFFNESS_MEASURES, "contact_fraction"), LARGEST_CHANGE),
    "pressure_peak": DOUBLING,
}
# Beginnings of keys that drive the motion or change no result, so that they have no limit.
KEYS_WITHOUT_LIMIT = (
    "drive.",
    "slide.",
    "accuracy.",
    "wear.cycles",
)
GAP_OF_ANGLE = {"contact.tilt.angle": ("Tilt", "length"), "contact.strips.roll": ("Roll", "width")}
ANGLE_UNITS = [name for name, _ in UNIT_LADDERS["rad"]]
# Number above which a value needs no smaller unit: 0.011 mrad is kept, 0.01 mrad becomes 10 urad.
MIN_NUMBER = 0.0101
MAX_NUMBER = 1e4  # number below which a value needs no larger unit
# Relative change of a measure below which it is attributed to round-off.
ROUND_OFF_CHANGE = 1e-8


class KeyLimit(NamedTuple):
    """Largest value of a swept key up to which the change of a measure stays within its limit.

    Attributes
    ----------
    name : str
        The measure.
    change : float
        Relative change at the limit, negative if the measure decreases.
    reference : float
        Value of the measure in the first case [SI].
    last_change : float
        Relative change up to the last case that counts.
    inside : int
        The last case that is surely within the limit.
    beyond : int or None
        The first case that is surely beyond the limit; None if there is none.
    covers_line : bool
        Whether the last case of the line is surely within the limit.
    value : float
        Value of the key at the limit, or in the case `inside` if no case is beyond [SI].
    """

    name: str
    change: float
    reference: float
    last_change: float
    inside: int
    beyond: int | None
    covers_line: bool
    value: float


class Limits(NamedTuple):
    """Largest allowed values of a swept key for all measures.

    Attributes
    ----------
    key : dict or None
        The key, with the strings of its values in `unit`; None if no numerical key varies along lines
        of cases.
    entries : sequence of KeyLimit
        One for each measure of CHANGE_AT_LIMIT that the cases have.
    measures_without_limit : sequence of str
        Measures of the motion that have no limit, because their first case did not settle or misses
        its tolerance.
    unit : str
        Unit in which values of the key are shown.
    scale : float
        Value in `unit` per value in SI.
    patch : dict
        `length` and `width` of the patch [m], if they are known.
    """

    key: dict | None = None
    entries: Sequence = ()
    measures_without_limit: Sequence = ()
    unit: str = ""
    scale: float = 1.0
    patch: dict | None = None

    def sizes(self) -> np.ndarray:
        """Values of the key in all cases [SI]."""
        return np.asarray(self.key["values"], float)

    def is_resolved(self, limit: KeyLimit) -> bool:
        """Return whether any case besides the first lies within a limit."""
        sizes = self.sizes()
        return sizes[limit.inside] > sizes.min()


def find_limits(
    keys: list, measures: dict, trusted: dict, grid: bool = True, patch: dict | None = None
) -> Limits:
    """Find the largest allowed values of the swept key with the most values.

    Parameters
    ----------
    keys : list of dict
        `name`, `unit`, `values` (n,) [SI], `texts` (n,), `log` and `words` (whether its values are
        words) of each.
    measures : dict
        {name: (values (n,), errors (n,), ...)}, NaN if a case has no value.
    trusted : dict
        {name: (n,) whether a case settled and meets its tolerance}.
    grid : bool
        Whether the cases are all combinations of the values of the keys.
    patch : dict
        `length` and `width` of the patch [m], if they are known.

    Returns
    -------
    Limits
        Without a key if no numerical key varies along lines of cases.
    """
    numbers = [key for key in keys if not key["words"]]
    if not numbers or (len(keys) > 1 and not grid):
        return Limits()
    key = max(numbers, key=lambda key: np.unique(key["values"]).size)
    if key["name"].startswith(KEYS_WITHOUT_LIMIT):
        return Limits()
    lines = group_cases_along_key(key, [other for other in keys if other is not key])
    key_limits = []
    measures_without_limit = []
    for name in CHANGE_AT_LIMIT:
        values, errors = (
            np.asarray(column, float) for column in measures.get(name, ([np.nan], [np.nan]))[:2]
        )
        # The measure is zero within round-off in all cases.
        if not np.any(np.abs(values) > format_zero(name)):
            continue
        values = np.where(trusted[name], values, np.nan)
        limits_of_lines = [
            _limit_along_line(name, key, line, values[line], np.nan_to_num(errors[line]))
            for line in lines
        ]
        if None not in limits_of_lines:
            key_limits.append(min(limits_of_lines, key=_sort_key))
        elif name in MOTION_MEASURES:
            measures_without_limit.append(name)
    limits = Limits(key, key_limits, measures_without_limit, patch=patch)
    if not any(limits.is_resolved(limit) for limit in key_limits):
        return limits
    unit, scale = _choose_unit(limits)
    return limits._replace(key=_convert_to_unit(key, unit, scale), unit=unit, scale=scale)


def _limit_along_line(
    name: str, key: dict, line: np.ndarray, values: np.ndarray, errors: np.ndarray
) -> KeyLimit | None:
    """Find the largest allowed key value for a measure along one line of cases.

    None if the first case has no value, or all others have none.

    Parameters
    ----------
    name : str
        The measure.
    key : dict
    line : (m,) array
        Cases in the order of the key.
    values, errors : (m,) array
        The measure in these cases; NaN if a case does not count.
    """
    valid = np.flatnonzero(np.isfinite(values))
    if valid.size < 2 or valid[0] != 0 or values[0] == 0:
        return None
    largest = CHANGE_AT_LIMIT[name]
    change = (values[valid] - values[0]) / abs(values[0])
    error = (errors[valid] + errors[0]) / abs(values[0])
    # Only a pressure that increases along the key can double.
    size = np.abs(change) if largest < DOUBLING else change
    open_or_beyond = np.flatnonzero(size[1:] + error[1:] > largest)
    inside = int(open_or_beyond[0]) if open_or_beyond.size else valid.size - 1
    case = int(line[valid[inside]])
    sizes = np.asarray(key["values"], float)
    limit = KeyLimit(
        name=name,
        change=largest,
        reference=float(values[0]),
        last_change=float(change[-1]),
        inside=case,
        beyond=None,
        covers_line=bool(valid[inside] == line.size - 1),
        value=float(sizes[case]),
    )
    surely_beyond = np.flatnonzero(size - error > largest)
    if not surely_beyond.size:
        return limit
    beyond = int(surely_beyond[0])
    change_at_limit = float(np.copysign(largest, change[beyond]))
    case_beyond = int(line[valid[beyond]])
    grown_by_factors = bool(key["log"] and sizes[case] > 0)
    values_along = np.array([change[inside], change_at_limit, change[beyond]])
    if grown_by_factors and largest >= DOUBLING:
        # A power law of the key is a straight line in logarithmic coordinates.
        values_along = np.log1p(values_along)
    fraction = (values_along[1] - values_along[0]) / (values_along[2] - values_along[0])
    value = _interpolate(
        float(sizes[case]), float(sizes[case_beyond]), float(fraction), grown_by_factors
    )
    return limit._replace(change=change_at_limit, beyond=case_beyond, value=value)


def _interpolate(low: float, high: float, part: float, by_factors: bool) -> float:
    """Interpolate the value of a key between two cases, linearly or logarithmically.

    part: fraction of the distance from `low` to `high`.
    """
    if by_factors:
        return exp(log(low) + part * log(high / low))
    return low + part * (high - low)


def _sort_key(limit: KeyLimit) -> tuple:
    """Return the value by which limits are sorted in ascending order.

    At equal values a limit between two cases comes before an open one.
    """
    return limit.beyond is None and limit.covers_line, limit.value, limit.beyond is None


def limits_json(limits: Limits) -> list:
    """Return the limits of a swept key as stored in sweep.json, in SI units.

    `value` of the key, interpolated between the cases `low` and `high`, is the one at which a
    measure differs by `change` from its value in the first case.
    """
    return [
        {
            "measure": limit.name,
            "key": limits.key["name"],
            "value": limit.value,
            "unit": limits.key["unit"],
            "change": limit.change,
            "low": float(limits.sizes()[limit.inside]),
            "high": float(limits.sizes()[limit.beyond]),
        }
        for limit in limits.entries
        if limit.beyond is not None
    ]


def limits_sentence(limits: Limits) -> str:
    """State in one sentence up to which key value measures stay within limits, or return "" if unknown."""
    if limits.key is None:
        return ""
    motion = _motion_sentence(limits)
    reached = [
        limit for limit in limits.entries if limit.beyond is not None and limits.is_resolved(limit)
    ]
    parts = [motion] if motion else []
    parts += [
        f"the {measure_label(limit.name)} doubles {_format_position(limits, limit)}"
        for limit in reached
        if limit.change >= DOUBLING
    ]
    stiffness = [
        _format_position(limits, limit, limit.name.partition("_")[0])
        for limit in reached
        if limit.name in STIFFNESS_MEASURES
    ]
    if stiffness:
        percent = f"{100 * LARGEST_CHANGE:g} %"
        parts.append(f"the stiffness of the patch changes by {percent} {' and '.join(stiffness)}")
    if not parts:
        return ""
    start = "" if motion else f"As {limits.key['name']} grows, "
    return f"{start}{'; '.join(parts)}."


def _motion_sentence(limits: Limits) -> str:
    """State how far the key may go before a measure of the motion changes.

    It is "" if the cases do not show it.
    """
    moving = [limit for limit in limits.entries if limit.name in MOTION_MEASURES]
    if not moving or not all(limits.is_resolved(limit) for limit in moving):
        return ""
    key_name = GAP_OF_ANGLE.get(limits.key["name"], (limits.key["name"],))[0]
    percent = f"{100 * LARGEST_CHANGE:g} %"
    *first_names, last_name = (measure_label(limit.name) for limit in moving)
    ends = sorted(
        (limit for limit in moving if limit.beyond is not None or not limit.covers_line),
        key=_sort_key,
    )
    if not ends:
        if limits.measures_without_limit:
            return ""
        largest_value = moving[0]._replace(value=float(limits.sizes().max()))
        names = (
            f"{', '.join(first_names)} and {last_name} change"
            if first_names
            else f"{last_name} changes"
        )
        return f"{key_name} may reach {_format_limit_and_gap(limits, largest_value)}: {names} by less than {percent}"
    names = f"{', '.join(first_names)} or {last_name}" if first_names else last_name
    before = f"before {names} changes by {percent}"
    smallest = ends[0]
    if smallest.beyond is None:
        return (
            f"{key_name} may reach at least {_format_limit_and_gap(limits, smallest)} {before}; "
            f"{_exceeded_sentence(limits, ends)}"
        )
    between = f"interpolated between the cases at {_format_cases(limits, smallest)}"
    return (
        f"{key_name} may reach {_format_limit_and_gap(limits, smallest, between)} {before} "
        f"({_first_to_change(limits, ends)})"
    )


def _exceeded_sentence(limits: Limits, ends: list) -> str:
    """State which measure exceeds its limit by more than its error, and in which case."""
    beyond = [limit for limit in ends if limit.beyond is not None]
    if not beyond:
        return "the cases with larger values do not show where this limit lies"
    soonest = min(beyond, key=lambda limit: limits.sizes()[limit.beyond])
    return (
        f"{measure_label(soonest.name)} has changed by more than {100 * LARGEST_CHANGE:g} % at "
        f"{key_formatter(limits.key)(soonest.beyond)}"
    )


def _first_to_change(limits: Limits, ends: list) -> str:
    """Name the measures that reach their limits first, and the measure that reaches its limit last.

    The last one is left out if it is among the first.
    """
    sizes = limits.sizes()
    reached = [limit for limit in ends if limit.beyond is not None]
    soonest = min(sizes[limit.beyond] for limit in reached)
    first_measures = [
        measure_label(limit.name) for limit in reached if sizes[limit.inside] < soonest
    ]
    last = ends[-1]
    later = ""
    if last.beyond is not None and measure_label(last.name) not in first_measures:
        later = f"; {measure_label(last.name)} {_format_position(limits, last)}"
    return f"first to change: {' or '.join(first_measures)}{later}"


def _format_limit_and_gap(limits: Limits, limit: KeyLimit, *notes: str) -> str:
    """Format the limit of a scene key, followed in brackets by the gap of a tilt angle and by notes."""
    notes = [note for note in (_format_gap(limits, limit), *notes) if note]
    return (
        f"{_format_limit(limits, limit)} ({'; '.join(notes)})"
        if notes
        else _format_limit(limits, limit)
    )


def _format_limit(limits: Limits, limit: KeyLimit) -> str:
    """Format the limit of a key after rounding it down."""
    return f"{format_number(_round_down(limits, limit), _count_digits(limits, limit))} {limits.unit}".strip()


def _round_down(limits: Limits, limit: KeyLimit) -> float:
    """Round a limit down to the digits that are shown."""
    value = limit.value * limits.scale
    if not value:
        return value
    step = 10.0 ** (floor(log10(abs(value)) + 1e-9) - _count_digits(limits, limit) + 1)
    return floor(value / step + 1e-6) * step


def _count_digits(limits: Limits, limit: KeyLimit) -> int:
    """Count the digits of a limit: two, or as many as distinguish the cases around it."""
    if limit.beyond is None or not limit.value:
        return 2
    spacing = limits.sizes()[limit.beyond] - limits.sizes()[limit.inside]
    if not spacing:  # neighbouring cases differ in a second key only
        return 2
    return max(2, 1 + ceil(log10(abs(limit.value) / spacing)))


def _format_gap(limits: Limits, limit: KeyLimit) -> str:
    """Format the gap that a tilt angle opens over the patch, or return "" if the key is not an angle."""
    side = (limits.patch or {}).get(GAP_OF_ANGLE.get(limits.key["name"], ("", ""))[1])
    if not side or not limit.value:
        return ""
    gap = _round_down(limits, limit) / limits.scale * side
    unit, scale = choose_unit(UNIT_LADDERS["m"], gap)
    return f"{format_number(gap * scale, 2)} {unit} over the patch"


def _format_position(limits: Limits, limit: KeyLimit, *notes: str) -> str:
    """Format a limit and the cases between which it lies."""
    return f"at about {_format_limit(limits, limit)} ({'; '.join([*notes, f'between {_format_cases(limits, limit)}'])})"


def _format_cases(limits: Limits, limit: KeyLimit) -> str:
    """Format the key values of the two cases around a limit, such as "0.1 and 0.32 mrad"."""
    format_case = key_formatter(limits.key)
    inside = format_case(limit.inside)
    beyond = format_case(limit.beyond)
    return f"{drop_repeated_unit(inside, beyond)} and {beyond}"


def _choose_unit(limits: Limits) -> tuple:
    """Choose the unit and scale in which all values of a key are shown.

    It is the unit in which the cases are written, unless the smallest limit would be a number below
    MIN_NUMBER or above MAX_NUMBER; for an angle it is the largest unit in which the smallest limit
    is above MIN_NUMBER.
    """
    key = limits.key
    resolved = [limit for limit in limits.entries if limits.is_resolved(limit)]
    first = min(
        [limit for limit in resolved if limit.name in MOTION_MEASURES] or resolved,
        key=_sort_key,
        default=None,
    )
    value, case = (float(limits.sizes().max()), 0) if first is None else (first.value, first.inside)
    number_with_unit = NUMBER_PATTERN.match(str(key["texts"][case]))
    size = float(limits.sizes()[case])
    unit, scale = (
        (number_with_unit[2] or "", float(number_with_unit[1]) / size)
        if number_with_unit and size
        else (key["unit"], 1.0)
    )
    as_written = unit.removesuffix("1"), scale
    fits = MIN_NUMBER < abs(value * scale) < MAX_NUMBER
    if key["unit"] == "rad" and (unit in ANGLE_UNITS or not fits):
        larger_units = reversed(UNIT_LADDERS["rad"])
        return next(
            (step for step in larger_units if MIN_NUMBER < abs(value * step[1])), as_written
        )
    if fits or key["unit"] not in UNIT_LADDERS:
        return as_written
    return choose_unit(UNIT_LADDERS[key["unit"]], abs(value))


def _convert_to_unit(key: dict, unit: str, scale: float) -> dict:
    """Return a swept key whose values are formatted in a given unit."""
    if all(str(text).partition(" ")[2] in ("", unit) for text in key["texts"]):
        return key
    return key | {
        "texts": [
            f"{value * scale:.12g} {unit}" for value in np.asarray(key["values"], float).tolist()
        ]
    }


def limits_table(limits: Limits, measures: dict) -> str:
    """Return the limits of a swept key for all measures as an HTML table, or "" if there are none.

    Parameters
    ----------
    limits : Limits
    measures : dict
        {name: (values, errors, SI unit)}.
    """
    if not limits.entries:
        return ""
    format_case = key_formatter(limits.key)
    sizes = limits.sizes()
    rows = []
    for limit in limits.entries:
        if limit.beyond is not None:
            where = f"about {_format_limit(limits, limit)} (between the cases at {_format_cases(limits, limit)})"
        elif limit.covers_line:
            where = "in no case"
        else:
            where = (
                f"not up to {format_case(limit.inside)}; the cases with larger values do not show where this change is "
                "reached"
            )
        reference = format_measure(limit.name, limit.reference, measures[limit.name][2], 4)
        rows.append(
            [
                measure_link(measure_label(limit.name), limit.name),
                escape(reference),
                _format_change(limit.last_change),
                "double" if abs(limit.change) >= DOUBLING else f"{100 * LARGEST_CHANGE:g} %",
                f"<td class=soft>{escape(where)}</td>",
            ]
        )
    several_lines = np.sum(sizes == sizes.min()) > 1
    smallest = (
        " Other keys are swept, too; each limit is the smallest limit that is found for any values of these "
        "other keys."
        if several_lines
        else ""
    )
    heads = (
        "measure",
        ">first case",
        ">change between the first and the last case",
        "changed by",
        "where",
    )
    start = format_case(int(np.argmin(sizes)))
    return (
        f"<p class=soft>{escape(limits.key['name'])} grows from {escape(start)}. A measure counts as "
        "changed if the difference from its value in the first case exceeds the amount under &ldquo;changed "
        "by&rdquo; by more than the sum of both numerical errors. Limits are interpolated between two cases; for "
        "more accurate limits, add cases between them. Cases that miss their tolerance do not count, "
        f"nor do unsettled cases if settled cases have the measure.{smallest}</p>"
        + document.table_html(heads, rows, "wide")
    )


def _format_change(change: float) -> str:
    """Format a relative change in percent, or as a factor if it is large."""
    if abs(change) < ROUND_OFF_CHANGE:
        return "0 %"
    return f"{100 * change:+.3g} %" if change < 9 else f"&times; {format_number(1 + change, 3)}"
