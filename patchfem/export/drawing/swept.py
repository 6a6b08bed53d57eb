"""Chart of a measure of a sweep against a key, one line for each combination of other keys."""

import numpy as np

from ...core import PatchfemError
from ...formatting import UNIT_LADDERS, choose_axis_unit, format_number, format_quantity
from ...runs.results.patch_rows import minimum_value
from ..tolerance_misses import is_over_tolerance
from ..written import measure_label
from . import charts

# Smallest ratio of the largest to the smallest value of a key that selects a logarithmic axis.
MIN_KEY_RATIO = 10.0
MIN_MEASURE_RATIO = 100.0  # the same ratio for the values of the measure


def sweep_chart(dataset, measure: str) -> dict:
    """Return the chart of a measure of a sweep against the key with the most values.

    Hollow points miss the tolerance.

    Parameters
    ----------
    dataset : xarray.Dataset
        Content of sweep.nc.
    measure : str

    Raises
    ------
    PatchfemError
        If the sweep does not have this measure.
    """
    measures = sorted(name.removesuffix("_error") for name in dataset if name.endswith("_error"))
    if measure not in measures:
        names = ", ".join(measures)
        raise PatchfemError(f"plot.sweep: no measure {measure!r}; there are {names}", "")
    keys = [name for name in dataset.coords if name != "case"]
    key = max(keys, key=lambda name: np.unique(dataset[name]).size)
    axis_key = dataset[key]
    (dim,) = axis_key.dims
    other_keys = [name for name in dataset[measure].dims if name != dim]
    names = {"values": measure, "errors": f"{measure}_error", "floors": f"{measure}_floor"}
    table = {
        part: dataset.get(name, 0 * dataset[measure])
        .transpose(*other_keys, dim)
        .values.reshape(-1, axis_key.size)
        for part, name in names.items()
    }
    hollow = is_over_tolerance(table, dataset.attrs.get("tolerance", np.nan))
    values = table["values"]
    errors = np.nan_to_num(table["errors"])
    unit, scale = _choose_axis_unit(values, dataset[measure].attrs.get("units", "1"))
    below = np.fmin(errors, np.fmax(values - minimum_value(measure), 0.0))
    x, x_axis = _make_key_axis(key, axis_key)
    lines = []
    rings = []
    filled = []
    for k, place in enumerate(np.ndindex(*(dataset[name].size for name in other_keys))):
        text = ", ".join(
            f"{measure_label(name)} {_format_key(dataset[name], at)}"
            for name, at in zip(other_keys, place)
        )
        y = scale * values[k]
        bars = scale * np.stack([below[k], errors[k]])
        colour = charts.COLOURS[k % len(charts.COLOURS)]
        if dim != "case":
            lines.append(charts.make_line(x, y, colour))
        rings.append(charts.make_dots(x, y, colour, text, errors=bars, hollow=True))
        filled.append(charts.make_dots(x[~hollow[k]], y[~hollow[k]], colour))
    finite_values = values[np.isfinite(values)]
    is_log = _spans_ratio(finite_values, MIN_MEASURE_RATIO)
    y_axis = charts.make_axis(measure_label(measure), "" if unit == "1" else unit, is_log)
    return charts.make_chart("", x_axis, y_axis, [*lines, *rings, *filled])


def _make_key_axis(key: str, axis_key) -> tuple:
    """Return the chart axis of a swept key, and the positions (n,) of its values."""
    if axis_key.dtype.kind != "f":
        places = np.arange(float(axis_key.size))
        ticks = [(place, str(word)) for place, word in zip(places, axis_key.values)]
        return places, charts.make_axis(measure_label(key)) | {"ticks": ticks}
    unit, scale = _choose_axis_unit(axis_key.values, axis_key.attrs.get("units", "1"))
    is_log = _spans_ratio(axis_key.values, MIN_KEY_RATIO)
    return axis_key.values * scale, charts.make_axis(
        measure_label(key), "" if unit == "1" else unit, is_log
    )


def _spans_ratio(values, ratio: float) -> bool:
    """Return whether all values are positive and the largest is at least `ratio` times the smallest."""
    if values.dtype.kind != "f" or values.size < 2 or values.min() <= 0:
        return False
    return values.max() >= ratio * values.min()


def _choose_axis_unit(values, unit: str) -> tuple:
    """Choose unit and scale of a chart axis for given values [SI]."""
    return choose_axis_unit(values, unit) if unit in UNIT_LADDERS else (unit, 1.0)


def _format_key(key, place: int) -> str:
    """Format a value of a swept key with its unit."""
    value = key.values[place]
    unit = key.attrs.get("units", "1")
    if key.dtype.kind != "f":
        return str(value)
    if unit in UNIT_LADDERS:
        return format_quantity(float(value), unit, 3)
    return f"{format_number(float(value), 3)} {unit}".removesuffix(" 1")
