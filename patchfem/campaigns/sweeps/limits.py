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
DOUBLING = 1.0  # relative change of a measure that doubles
MOTION_MEASURES = (
    "relative_displacement_amplitude",
    "absolute_acceleration_peak",
    "slip_amplitude",
    "loop_area",
    "friction_force_peak",
    "friction_ratio_peak",
    "onset_level",
)
CHANGE_AT_LIMIT = {
    **dict.fromkeys(MOTION_MEASURES, NEGLIGIBLE_CHANGE),
    "normal_stiffness": NEGLIGIBLE_CHANGE,
    "tangential_stiffness": NEGLIGIBLE_CHANGE,
    "contact_fraction": NEGLIGIBLE_CHANGE,
    "pressure_peak": DOUBLING,
}
# Beginnings of keys that drive the motion or change no result, so that they have no limit.
KEYS_WITHOUT_LIMIT = ("drive.", "slide.", "accuracy.", "wear.cycles")


class KeyLimit(NamedTuple):
    """Value of a key up to which the change of a measure stays within its limit, in SI.

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
    """Find the limits of the numerical key with the most values, as `_choose_axis` chooses it.

    If other keys are swept too, a limit is the smallest one over the values of these keys whose first case counts.
    """
    axis = _choose_axis(table)
    if axis is None:
        return []
    limits = []
    lines = table.split_lines(axis)
    key = table.keys[axis]
    along = key.values[lines[0]]
    order = np.argsort(along)
    for name, largest in CHANGE_AT_LIMIT.items():
        column = table.measures.get(name)
        if column is None or not np.any(np.abs(column.values) > column.floors):
            continue
        values = table.select_trusted(name)
        errors = np.nan_to_num(column.errors)
        on_lines = [
            _find_limit_on_line(name, key, along[order], values[line], errors[line], largest)
            for line in lines[:, order]
        ]
        limits += sorted(filter(None, on_lines), key=_rank_limit)[:1]
    return limits


def _choose_axis(table: SweepTable) -> int | None:
    """Return the index of the key with the most values among the numerical ones of a grid that can have a limit."""
    if not table.is_grid:
        return None
    axes = []
    for axis, key in enumerate(table.keys):
        if key.is_number and table.shape[axis] > 1 and not key.key.startswith(KEYS_WITHOUT_LIMIT):
            axes.append(axis)
    return max(axes, key=lambda axis: table.shape[axis], default=None)


def _find_limit_on_line(
    name: str,
    key: SweptKey,
    sizes: np.ndarray,
    values: np.ndarray,
    errors: np.ndarray,
    largest: float,
) -> KeyLimit | None:
    """Find the limit of a key along one line of cases, of which the first one is the reference.

    Returns None if the first case has no value that counts, or all others have none.

    Parameters
    ----------
    name : str
        Measure.
    key : SweptKey
        Key that changes along the line.
    sizes : (m,) array
        Increasing values of the key [SI].
    values, errors : (m,) array
        The measure and its errors [SI]; NaN for a value that does not count.
    largest : float
        Relative change at the limit.
    """
    valid = np.flatnonzero(np.isfinite(values))
    if valid.size < 2 or valid[0] != 0 or values[0] == 0:
        return None
    change = (values[valid] - values[0]) / abs(values[0])
    error = (errors[valid] + errors[0]) / abs(values[0])
    # Only a pressure that increases can double.
    size = np.abs(change) if largest < DOUBLING else change

    not_surely_within = np.flatnonzero(size[1:] + error[1:] > largest)
    inside = int(not_surely_within[0]) if not_surely_within.size else valid.size - 1
    covers_line = not not_surely_within.size and valid[-1] == values.size - 1
    low = float(sizes[valid[inside]])
    limit = KeyLimit(
        measure=name,
        key=key.key,
        unit=key.unit,
        change=largest,
        value=np.nan,
        low=low,
        high=np.nan,
        is_never_reached=bool(covers_line),
    )
    surely_beyond = np.flatnonzero(size - error > largest)
    if not surely_beyond.size:
        return limit

    beyond = int(surely_beyond[0])
    high = float(sizes[valid[beyond]])
    change_at_limit = float(np.copysign(largest, change[beyond]))
    ends = np.array([change[inside], change[beyond], change_at_limit])
    positions = np.array([low, high])
    if key.is_logarithmic:
        positions = np.log(positions)
        # A power law of the key is a straight line in logarithmic coordinates.
        ends = np.log1p(ends) if largest >= DOUBLING else ends
    fraction = (ends[2] - ends[0]) / (ends[1] - ends[0])
    value = positions[0] + fraction * (positions[1] - positions[0])
    value = float(np.exp(value) if key.is_logarithmic else value)
    return limit._replace(change=change_at_limit, value=value, high=high)


def _rank_limit(limit: KeyLimit) -> tuple[bool, float]:
    """Return a sort key that puts the smallest limit first and one that is never reached last."""
    return limit.is_never_reached, limit.low if np.isnan(limit.value) else limit.value
