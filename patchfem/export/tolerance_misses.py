"""Cases of a sweep that miss their tolerance: measures, number of cases and the worst case."""

import numpy as np

from ..core import compute_allowed_error
from ..formatting import format_number, format_quantity
from .written import measure_label

# Main measures, which are named before others with larger errors.
FIRST_MEASURES = (
    "relative_displacement_amplitude",
    "absolute_acceleration_peak",
    "loop_area",
    "friction_ratio_peak",
    "pressure_peak",
    "contact_fraction",
)
# Text for a measure whose label is unclear in a sentence.
LONG_NAMES = {
    "relative_displacement_amplitude_steady": "the displacement amplitude to which the motion would settle"
}
ZERO_ERROR_RATIO = 10.0  # ratio of error to value above which the value counts as 0


def is_over_tolerance(measure: dict, tolerance) -> np.ndarray:
    """Return whether the error in each case (n,) exceeds tolerance * |value| + floor.

    This is the limit of the warning of a single run.

    Parameters
    ----------
    measure : dict
        `values`, `errors` and `floors` (n,) [SI], NaN if a case has none.
    tolerance : float or (n,) array
        NaN if it is not known.
    """
    values, errors = (np.asarray(measure[name], float) for name in ("values", "errors"))
    floors = np.nan_to_num(np.asarray(measure.get("floors", 0.0), float))
    with np.errstate(invalid="ignore"):
        # Comparisons with NaN are false.
        return errors > compute_allowed_error(tolerance, values, floors)


def is_within_by_floor(measure: dict, tolerance) -> np.ndarray:
    """Return whether each error (n,) meets the tolerance only because of the floor of its measure.

    The value must exceed this floor, so that a reader sees it with its error. The arguments are
    those of `is_over_tolerance`.
    """
    values, errors = (np.asarray(measure[name], float) for name in ("values", "errors"))
    floors = np.nan_to_num(np.asarray(measure.get("floors", 0.0), float))
    with np.errstate(invalid="ignore"):
        return (
            (errors > tolerance * np.abs(values))
            & (np.abs(values) > floors)
            & ~is_over_tolerance(measure, tolerance)
        )


def format_floor(measure: dict, cases: np.ndarray) -> str:
    """Return the largest absolute error floor of a measure in some cases (n,) as text."""
    floors = np.broadcast_to(np.asarray(measure.get("floors", 0.0), float), cases.shape)
    return format_quantity(float(floors[cases].max()), measure.get("unit", "1"), 2)


def count_over_tolerance(measures: dict, tolerance) -> dict:
    """Count the cases that exceed the tolerance, for each measure with at least one such case.

    measures: {name: as for `is_over_tolerance`}.

    Returns
    -------
    dict
        By measure `count` of cases, and `worst`: their largest error/|value|, None if all values
        are 0.
    """
    counts = {}
    for name, measure in measures.items():
        if (missed := is_over_tolerance(measure, tolerance)).any():
            relative_errors = _relative_error(measure)[
                missed & (np.asarray(measure["values"], float) != 0)
            ]
            counts[name] = {
                "count": int(missed.sum()),
                "worst": float(relative_errors.max()) if relative_errors.size else None,
            }
    return counts


def tolerance_sentence(measures: dict, tolerance, format_case, first: str = "") -> str:
    """State in how many cases the main measure with the most misses exceeds the tolerance.

    It also states the worst case, and how many other measures miss the tolerance.

    Parameters
    ----------
    measures : dict
        {name: as for `is_over_tolerance`}.
    tolerance : float or (n,) array
    format_case : callable
        Number of a case -> its swept values as text.
    first : str
        Measure that the sentence is on; "" for the worst.

    Returns
    -------
    str
        "" if no error is known.
    """
    is_known_by_name = {
        name: np.isfinite(np.asarray(one["errors"], float)) for name, one in measures.items()
    }
    number = max((is_known.size for is_known in is_known_by_name.values()), default=0)
    limits = np.broadcast_to(np.asarray(tolerance, float), number)
    if (
        not any(is_known.any() for is_known in is_known_by_name.values())
        or not np.isfinite(limits).any()
    ):
        return ""
    tolerance_text = (
        f"the tolerance of {100 * limits[0]:g} %" if np.ptp(limits) == 0 else "their tolerance"
    )
    misses = {name: is_over_tolerance(one, tolerance) for name, one in measures.items()}
    misses = {name: missed for name, missed in misses.items() if missed.any()}
    if not misses:
        n_with_value = int(
            np.any(
                [
                    np.isfinite(np.asarray(measure["values"], float))
                    for measure in measures.values()
                ],
                axis=0,
            ).sum()
        )
        floor_example = next(
            (
                (name, cases)
                for name in FIRST_MEASURES
                if name in measures
                and (cases := is_within_by_floor(measures[name], tolerance)).any()
            ),
            None,
        )
        floor = (
            ""
            if floor_example is None
            else f" or the floor of their measure, such as {format_floor(measures[floor_example[0]], floor_example[1])} "
            f"of {measure_label(floor_example[0])}"
        )
        if n_with_value == number:
            return f"All {number} cases meet {tolerance_text}{floor}."
        subject_and_verb = "it meets" if n_with_value == 1 else "all of these meet"
        return f"{n_with_value} of {number} cases have an answer; {subject_and_verb} {tolerance_text}{floor}."
    if first in measures and first not in misses:
        return f"In {measure_label(first)} all {number} cases meet {tolerance_text}; {_others_sentence(len(misses))}."
    error_ratios = {
        name: float(np.max(_error_ratio(measures[name], tolerance), initial=0.0, where=missed))
        for name, missed in misses.items()
    }
    name = (
        first
        if first in misses
        else max(
            [name for name in FIRST_MEASURES if name in misses] or misses, key=error_ratios.get
        )
    )
    relative_errors = np.where(misses[name], _relative_error(measures[name]), 0.0)
    count = int(misses[name].sum())
    case = int(np.argmax(relative_errors))
    others = len(misses) - 1
    error_text = (
        f"{format_number(100 * relative_errors[case], 2)} % of its value"
        if relative_errors[case] <= ZERO_ERROR_RATIO
        else "larger than the value"
    )
    measure_text = LONG_NAMES.get(name) or measure_label(name)
    others_text = f"; {_others_sentence(others)}" if others else ""
    return (
        f"{count} of {number} cases miss{'es' * (count == 1)} {tolerance_text} in {measure_text}; the largest error, at "
        f"{format_case(case)}, is {error_text}{others_text}."
    )


def _others_sentence(count: int) -> str:
    """State how many other measures miss the tolerance."""
    return f"{count} other measure{'s' * (count > 1)} miss{'es' * (count == 1)} the tolerance in some cases"


def _error_ratio(measure: dict, tolerance) -> np.ndarray:
    """Return the ratio (n,) of the error to the allowed error."""
    floors = np.nan_to_num(np.asarray(measure.get("floors", 0.0), float))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(measure["errors"], float) / compute_allowed_error(
            tolerance, np.asarray(measure["values"], float), floors
        )


def _relative_error(measure: dict) -> np.ndarray:
    """Return the ratio (n,) of the error to |value|, which is inf if the value is 0."""
    values, errors = (np.asarray(measure[name], float) for name in ("values", "errors"))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(errors > 0, errors / np.abs(values), 0.0)
