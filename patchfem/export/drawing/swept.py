"""A measure of a sweep over its key as a figure: a line per combination of the other keys, with numerical errors."""

import numpy as np

from ...core import PatchfemError
from ...runs.results.patch_rows import minimum_of
from ...scales import LADDERS, axis_unit, plain, short
from ..missed import over
from ..written import label
from .pictures import drawing, styled

DECADES = 2  # of values, all above 0, from which their axis is logarithmic
TEN = 10  # times the smallest, the largest value of a key from which its axis is


@styled
def draw(dataset, measure: str, onto=None):
    """The measure over the key with most values; hollow points miss the tolerance.

    dataset: xarray Dataset of a sweep; onto: matplotlib Axes. PatchfemError for a measure that it has not.
    """
    known = sorted(name.removesuffix("_error") for name in dataset if name.endswith("_error"))
    if measure not in known:
        raise PatchfemError(f"plot.sweep: no measure {measure!r}; there are {', '.join(known)}", "")
    figure, (axis, *_) = drawing(1, 3.6, onto)
    key = max((name for name in dataset.coords if name != "case"), key=lambda name: np.unique(dataset[name]).size)
    along, (dim,) = dataset[key], dataset[key].dims
    others = [one for one in dataset[measure].dims if one != dim]
    table = {part: dataset.get(name, 0 * dataset[measure]).transpose(*others, dim).values.reshape(-1, along.size)
             for part, name in (("values", measure), ("errors", f"{measure}_error"), ("floors", f"{measure}_floor"))}
    hollow = over(table, dataset.attrs.get("tolerance", np.nan))
    unit, scale = _unit(table["values"], dataset[measure].attrs.get("units", "1"))
    along_unit, across = _unit(along.values, along.attrs.get("units", "1"))
    places = list(np.ndindex(*(dataset[one].size for one in others)))
    for k, place in enumerate(places):
        name = ", ".join(f"{label(one)} {_said(dataset[one], at)}" for one, at in zip(others, place))
        values, errors = table["values"][k], np.nan_to_num(table["errors"][k])
        bars = scale * np.stack([np.fmin(errors, np.fmax(values - minimum_of(measure), 0.0)), errors])
        _line(axis, along.values * across, (scale * values, bars), hollow[k],
              {"color": f"C{k % 10}", "label": name or None, "linestyle": "" if dim == "case" else "-"})
    shown = table["values"][np.isfinite(table["values"])]
    axis.set(xlabel=_named(key, along_unit), ylabel=_named(measure, unit))
    _scaled(axis, "x", along.values, TEN)
    _scaled(axis, "y", shown, 10**DECADES)
    if others:
        axis.legend(fontsize=9)
    return figure


def _line(axis, x, measured: tuple, hollow, style: dict) -> None:
    """Values (n,) with their errors (2, n), below and above, over x.

    The points for which `hollow` (n,) holds are not filled.
    """
    values, errors = measured
    axis.errorbar(x, values, errors, marker="o", markerfacecolor="white", capsize=2, **style)
    axis.plot(x[~hollow], values[~hollow], "o", color=style["color"], zorder=3)


def _scaled(axis, which: str, values, times: float) -> None:
    """A logarithmic axis where values, all above 0, span so large a factor; its labels are numbers, 1 2 5 where there
    is room."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    if values.dtype.kind != "f" or values.size < 2 or values.min() <= 0 or values.max() < times * values.min():
        return
    axis.set(**{f"{which}scale": "log"})
    mine = getattr(axis, f"{which}axis")
    mine.set_major_locator(LogLocator(subs=(1, 2, 5) if values.max() < 1e3 * values.min() else (1,)))
    mine.set_major_formatter(FuncFormatter(lambda value, _: plain(value, 3)))
    mine.set_minor_formatter(NullFormatter())


def _unit(values, unit: str) -> tuple:
    """(unit, scale) of an axis of these values [SI]; words have neither."""
    if values.dtype.kind != "f":
        return "1", 1
    return axis_unit(values, unit) if unit in LADDERS else (unit, 1.0)


def _said(key, place: int) -> str:
    """A value of a key as people read it."""
    value, unit = key.values[place], key.attrs.get("units", "1")
    if key.dtype.kind != "f":
        return str(value)
    return short(float(value), unit, 3) if unit in LADDERS else f"{plain(float(value), 3)} {unit}".removesuffix(" 1")


def _named(name: str, unit: str) -> str:
    return label(name) if unit == "1" else f"{label(name)} [{unit}]"
