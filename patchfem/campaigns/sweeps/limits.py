"""Limits of a swept key: how far it may go before a measure differs from that of the first case.

A measure reaches its limit where it has changed by 5 %; the peak pressure, where it has doubled. The
limit lies between the last case that is surely within it and the first case that is surely beyond
it, where the numerical errors of both cases are added to the change. It is interpolated linearly,
or over the logarithm of a key whose values are spaced by factors.
"""

from typing import NamedTuple

import numpy as np

from .sweep_table import SweepTable, SweptKey

NEGLIGIBLE_CHANGE = 0.05  # relative change that is commonly called negligible
# Relative change of a measure at twice its value
DOUBLED_VALUE_CHANGE = 1.0
# Measures of a motion whose change has a limit
MOTION_MEASURES = (
    "relative_displacement_amplitude",
    "absolute_acceleration_peak",
    "slip_amplitude",
    "loop_area",
    "friction_force_peak",
    "friction_ratio_peak",
    "onset_level",
)
# Relative change of each measure up to which a swept key counts as harmless
CHANGE_AT_LIMIT = {
    **dict.fromkeys(MOTION_MEASURES, NEGLIGIBLE_CHANGE),
    "normal_stiffness": NEGLIGIBLE_CHANGE,
    "tangential_stiffness": NEGLIGIBLE_CHANGE,
    "contact_fraction": NEGLIGIBLE_CHANGE,
    "pressure_peak": DOUBLED_VALUE_CHANGE,
}
# Beginnings of keys that drive the motion or change no result, so that they have no limit.
KEYS_WITHOUT_LIMIT = ("drive.", "slide.", "accuracy.", "wear.cycles")


class KeyLimit(NamedTuple):
    """Value of a swept key up to which a measure changes by no more than a given amount, in SI.

    Attributes
    ----------
    measure, key, unit : str
        Names of measure and key, and unit of the key.
    change : float
        Relative change at the limit; negative if the measure decreases.
    value : float
        The limit; NaN if no case is surely beyond it.
    low : float
        Last value of the key that is surely within the limit.
    high : float
        First value that is surely beyond it; NaN if there is none.
    is_never_reached : bool
        Whether all cases are surely within the limit.
    """

    measure: str
    key: str
    unit: str
    change: float
    value: float
    low: float
    high: float
    is_never_reached: bool


def find_limits(table: SweepTable) -> list[KeyLimit]:
    """Find up to which value of a swept key each measure stays within an allowed change from the first case.

    The key is the numerical one with the most values. If other keys are swept too, a limit is the smallest one over
    their values. A line of cases whose first value does not count is left out. `table` has the results of the sweep.
    """
    axis = _choose_axis(table)
    if axis is None:
        return []
    # lines of cases along the key, in rising order of its values
    limits = []
    lines = table.split_lines(axis)
    key = table.keys[axis]
    along = key.values[lines[0]]
    order = np.argsort(along)
    for name, largest in CHANGE_AT_LIMIT.items():
        column = table.measures.get(name)
        if column is None or not np.any(np.abs(column.values) > column.floors):
            continue
        column = table.select_trusted(name)
        errors = np.nan_to_num(column.errors)
        blank = KeyLimit(name, key.key, key.unit, largest, np.nan, np.nan, np.nan, False)
        on_lines = []
        for line in lines[:, order]:
            on_lines.append(
                _find_limit_on_line(blank, key, along[order], column.values[line], errors[line])
            )

        # the smallest limit of all lines counts, and a limit that is never reached only if all of them are like that
        known = filter(None, on_lines)
        limits += sorted(
            known, key=lambda limit: (limit.is_never_reached, np.fmax(limit.low, limit.value))
        )[:1]
    return limits


def _choose_axis(table: SweepTable) -> int | None:
    """Return the index of the numerical key with the most values in a table, or None if there is none.

    The cases must be a grid, and the key must be one that can have a limit.
    """
    if not table.is_grid:
        return None
    axes = []
    for axis, key in enumerate(table.keys):
        if key.is_number and table.shape[axis] > 1 and not key.key.startswith(KEYS_WITHOUT_LIMIT):
            axes.append(axis)
    return max(axes, key=lambda axis: table.shape[axis], default=None)


def _find_limit_on_line(
    blank: KeyLimit, key: SweptKey, key_values: np.ndarray, values: np.ndarray, errors: np.ndarray
) -> KeyLimit | None:
    """Find the limit of a key along one line of cases, of which the first one is the reference.

    Returns None if the first case has no value that counts, or all others have none.

    Parameters
    ----------
    blank : KeyLimit
        Limit without values: names of measure and key, and the relative change at the limit.
    key : SweptKey
        Key that changes along the line.
    key_values : (m,) array
        Increasing values of the key [SI].
    values, errors : (m,) array
        The measure and its errors [SI]; NaN for a value that does not count.
    """
    largest = blank.change
    counts = np.isfinite(values)
    if np.count_nonzero(counts) < 2 or not counts[0] or values[0] == 0:
        return None
    change = (values[counts] - values[0]) / abs(values[0])
    error = (errors[counts] + errors[0]) / abs(values[0])
    error[0] = 0.0  # the first case does not differ from itself
    # Only a pressure that increases can double.
    change_size = np.abs(change) if largest < DOUBLED_VALUE_CHANGE else change

    is_doubtful = change_size + error > largest
    inside = int(np.argmax(is_doubtful)) - 1 if is_doubtful.any() else change_size.size - 1
    limit = blank._replace(
        low=key_values[counts][inside],
        is_never_reached=bool(counts[-1] and not is_doubtful.any()),
    )
    is_beyond = change_size - error > largest
    if not is_beyond.any():
        return limit

    # Interpolation of the change in the direction of the case beyond, whose sign the limit has.
    beyond = int(np.argmax(is_beyond))
    sign = np.sign(change[beyond])
    ends = [inside, beyond]
    places = key_values[counts][ends]
    changes = sign * change[ends]
    target = largest
    if key.is_logarithmic:
        places = np.log(places)
        if largest >= DOUBLED_VALUE_CHANGE:
            # A power law of the key is a straight line in logarithmic coordinates.
            changes = np.log1p(changes)
            target = np.log1p(target)
    value = np.interp(target, changes, places)
    return limit._replace(
        change=sign * largest,
        value=np.exp(value) if key.is_logarithmic else value,
        high=key_values[counts][beyond],
    )
