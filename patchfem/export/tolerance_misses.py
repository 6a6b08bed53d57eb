"""Cases of a sweep that miss their tolerance: which measures, how many cases, and the worst by its relative error."""

import numpy as np

from ..core import allowed_error
from ..formatting import format_number, format_quantity
from .written import label

# what a case answers first, named before what misses its tolerance by more
FIRST = (
    "relative_displacement_amplitude",
    "absolute_acceleration_peak",
    "loop_area",
    "friction_ratio_peak",
    "pressure_peak",
    "contact_fraction",
)
# a measure in a sentence where its name alone says too little
LONGER = {
    "relative_displacement_amplitude_steady": "the displacement amplitude to which the motion would settle"
}
ZERO = 10.0  # times its value, an error beyond which a value is no more than 0


def over(one: dict, tolerance) -> np.ndarray:
    """(n,) whether the error of a measure is more than tolerance * |value| + floor, as a single run is warned of.

    one: `values`, `errors` and `floors` (n,) [SI], NaN where a case has none; tolerance: of all cases or (n,), NaN
    where it is not known.
    """
    values, errors = (np.asarray(one[name], float) for name in ("values", "errors"))
    floors = np.nan_to_num(np.asarray(one.get("floors", 0.0), float))
    with np.errstate(invalid="ignore"):
        return errors > allowed_error(tolerance, values, floors)  # no comparison with NaN holds


def by_floor(one: dict, tolerance) -> np.ndarray:
    """(n,) whether an error is more than tolerance * |value| and meets the tolerance by the floor of its measure alone,
    where the value is above this floor, so that a reader sees it with that error. Arguments as of `over`."""
    values, errors = (np.asarray(one[name], float) for name in ("values", "errors"))
    floors = np.nan_to_num(np.asarray(one.get("floors", 0.0), float))
    with np.errstate(invalid="ignore"):
        return (
            (errors > tolerance * np.abs(values))
            & (np.abs(values) > floors)
            & ~over(one, tolerance)
        )


def floor_of(one: dict, cases: np.ndarray) -> str:
    """The largest floor of a measure in some cases (n,) as people read it."""
    floors = np.broadcast_to(np.asarray(one.get("floors", 0.0), float), cases.shape)
    return format_quantity(float(floors[cases].max()), one.get("unit", "1"), 2)


def counted(measures: dict, tolerance) -> dict:
    """{measure: {`count` of cases over the tolerance, `worst`: their largest error/|value|, None where all are 0}} of
    the measures that miss it anywhere; measures: {name: as `over` takes it}."""
    out = {}
    for name, one in measures.items():
        if (missed := over(one, tolerance)).any():
            share = _share(one)[missed & (np.asarray(one["values"], float) != 0)]
            out[name] = {
                "count": int(missed.sum()),
                "worst": float(share.max()) if share.size else None,
            }
    return out


def sentence(measures: dict, tolerance, where, first: str = "") -> str:
    """How many cases miss the tolerance in the worst measure of those that answer first, where it is worst and how many
    other measures miss it; "" where no error is known.

    measures and tolerance: as `counted` takes them; where(case): the swept values of a case as people read them; first:
    the measure that is spoken of, "" for the worst.
    """
    known = {name: np.isfinite(np.asarray(one["errors"], float)) for name, one in measures.items()}
    number = max((found.size for found in known.values()), default=0)
    limits = np.broadcast_to(np.asarray(tolerance, float), number)
    if not any(found.any() for found in known.values()) or not np.isfinite(limits).any():
        return ""
    asked = f"the tolerance of {100 * limits[0]:g} %" if np.ptp(limits) == 0 else "their tolerance"
    lost = {name: over(one, tolerance) for name, one in measures.items()}
    lost = {name: missed for name, missed in lost.items() if missed.any()}
    if not lost:
        ran = int(
            np.any(
                [np.isfinite(np.asarray(one["values"], float)) for one in measures.values()], axis=0
            ).sum()
        )
        some = next(
            (
                (name, cases)
                for name in FIRST
                if name in measures and (cases := by_floor(measures[name], tolerance)).any()
            ),
            None,
        )
        floor = (
            ""
            if some is None
            else f" or the floor of their measure, such as {floor_of(measures[some[0]], some[1])} of {label(some[0])}"
        )
        return (
            f"All {number} cases meet {asked}{floor}."
            if ran == number
            else f"{ran} of {number} cases have an answer; {'it meets' if ran == 1 else 'all of these meet'} {asked}{floor}."
        )
    if first in measures and first not in lost:
        return f"In {label(first)} all {number} cases meet {asked}; {_others(len(lost))}."
    beyond = {
        name: float(np.max(_beyond(measures[name], tolerance), initial=0.0, where=missed))
        for name, missed in lost.items()
    }
    name = (
        first
        if first in lost
        else max([name for name in FIRST if name in lost] or lost, key=beyond.get)
    )
    share = np.where(lost[name], _share(measures[name]), 0.0)
    count, case, others = int(lost[name].sum()), int(np.argmax(share)), len(lost) - 1
    known = (
        f"{format_number(100 * share[case], 2)} % of its value"
        if share[case] <= ZERO
        else "larger than the value"
    )
    called = LONGER.get(name) or label(name)
    more = f"; {_others(others)}" if others else ""
    return (
        f"{count} of {number} cases miss{'es' * (count == 1)} {asked} in {called}; the largest error, at "
        f"{where(case)}, is {known}{more}."
    )


def _others(count: int) -> str:
    """How many measures beside that which is spoken of miss the tolerance."""
    return f"{count} other measure{'s' * (count > 1)} miss{'es' * (count == 1)} the tolerance in some cases"


def _beyond(one: dict, tolerance) -> np.ndarray:
    """Error over what is allowed, case by case."""
    floors = np.nan_to_num(np.asarray(one.get("floors", 0.0), float))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(one["errors"], float) / allowed_error(
            tolerance, np.asarray(one["values"], float), floors
        )


def _share(one: dict) -> np.ndarray:
    """Error over |value|, case by case; inf where the value is 0."""
    values, errors = (np.asarray(one[name], float) for name in ("values", "errors"))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(errors > 0, errors / np.abs(values), 0.0)
