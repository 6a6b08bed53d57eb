"""Charts of a sweep: panels of the styles `relative`, `menu` and `maps`.

They take answers of kind "sweep", from memory or from their folders.
"""

import re
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...campaigns.sweeps.changes import MAIN_MEASURES
from ...campaigns.sweeps.limits import NEGLIGIBLE_CHANGE
from ...campaigns.sweeps.sweep_table import FINAL_OUTCOMES, MAX_TRUSTED_RELATIVE_ERROR
from ..answer import Answer, Answers, Variables
from ..quantities import VALUE_ROUND_OFF, format_value
from ..rows import Chart
from .panel import Axis, Curve, Panel, add_choices, join_names, make_axis, select_curve_points

MAX_DRAWN_CASES = 1000  # cases of a measure, so that a page stays below 1.5 MB
MAX_MAP_VALUES_PER_KEY = 40  # values of each key in a map
# Ratio of the largest to the smallest value of a key and of a measure at which an axis is logarithmic.
MIN_LOG_AXIS_KEY_RATIO = 10.0
MIN_LOG_AXIS_MEASURE_RATIO = 100.0


class SweepView(NamedTuple):
    """Sweep along one of its keys.

    Attributes
    ----------
    data : dict of str to Variable
        Variables of sweep.nc.
    axis : str
        Variable of the key on the axis.
    others : list of str
        Variables of the other keys of a grid; [] if the cases are rows.
    """

    data: Variables
    axis: str
    others: list[str]

    @property
    def is_grid(self) -> bool:
        """Whether the cases are all combinations of the values of the keys."""
        return self.data[self.axis].dims == (self.axis,)

    def read_values(self, name: str) -> np.ndarray:
        """Return the values of a variable, of which those of the size of round-off are 0."""
        values = self.data[name].values
        if values.dtype.kind != "f":
            return values
        sizes = np.abs(values)
        largest = sizes[np.isfinite(sizes)].max(initial=0.0)
        return np.where(sizes <= VALUE_ROUND_OFF * largest, 0.0, values)

    def split_lines(self, name: str) -> np.ndarray:
        """Return a variable as (lines, values of the key on the axis)."""
        place = self.data[name].dims.index(self.axis) if self.others else 0
        moved = np.moveaxis(self.read_values(name), place, -1)
        return moved.reshape(-1, moved.shape[-1])

    def split_measure(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return a measure and its error as (lines, values).

        Steady estimates stand in place of the values of cases that did not settle, where statements on the sweep use them.
        """
        values = self.split_lines(name)
        errors = self.split_lines(f"{name}_error")
        if f"{name}_steady" not in self.data:
            return values, errors
        steady = self.split_lines(f"{name}_steady")
        steady_errors = self.split_lines(f"{name}_steady_error")
        is_used = self.find_symbols() == "x"
        is_used = is_used & (steady_errors <= MAX_TRUSTED_RELATIVE_ERROR * np.abs(steady))
        return np.where(is_used, steady, values), np.where(is_used, steady_errors, errors)

    def find_symbols(self) -> np.ndarray:
        """Return the symbol of each case (lines, values): "circle", or "x" if the case did not settle.

        Arrays that a user has selected may have no outcome; then one "circle" stands for all cases.
        """
        if "outcome" not in self.data:
            return np.array("circle")
        return np.where(np.isin(self.split_lines("outcome"), FINAL_OUTCOMES), "circle", "x")

    def name_lines(self) -> list[str]:
        """Return the values of the other keys of each line as text; [""] for a single line."""
        lines = [""]
        for name in self.others:
            variable = self.data[name]
            label = name.replace("_", " ")
            values = [format_value(value, variable.unit) for value in variable.values.tolist()]
            lines = [join_names(line, f"{label} {value}") for line in lines for value in values]
        return lines

    def scale(
        self, name: str, min_ratio: float = MIN_LOG_AXIS_KEY_RATIO
    ) -> tuple[Axis, np.ndarray]:
        """Return the axis of a variable and its values in the unit of the axis; words stay words.

        `min_ratio` is the ratio of its values at which the axis is logarithmic.
        """
        values = self.read_values(name)
        if values.dtype.kind != "f":
            return Axis(name.replace("_", " ")), values.astype(str)
        finite = values[np.isfinite(values)]
        is_log = finite.min(initial=np.inf) > 0 and finite.max() >= min_ratio * finite.min()
        axis = make_axis(name, self.data[name].unit, values, bool(is_log))
        return axis, values * axis.scale


def view_sweep(answer: Answer, axis: str = "") -> SweepView:
    """Return the view of a sweep along a key; by default the numerical key with the most values."""
    keys = list_keys(answer)
    columns = {key: answer.data[key].values for key in keys}
    counts = {key: (one.dtype.kind == "f", np.unique(one).size) for key, one in columns.items()}
    view = SweepView(answer.data, axis or max(keys, key=counts.__getitem__), [])
    return view._replace(others=[key for key in keys if view.is_grid and key != view.axis])


def list_keys(answer: Answer) -> list[str]:
    """Return the names of the variables of the swept keys."""
    return [re.sub(r"\W", "_", key) for key in answer.details["of"]["keys"]]


def list_measures(answers: Answers) -> list[str]:
    """Return the measures that have a value in at least one case.

    The main ones that change come first, in the order of the verdict, then the other main ones, then all others.
    """
    known = [
        name for answer in answers.values() for name in answer.data if _has_values(answer, name)
    ]
    ranges = [name for answer in answers.values() for name in answer.quantities]
    changing = [name.removeprefix("smallest_") for name in ranges if name.startswith("smallest_")]
    return [name for name in dict.fromkeys((*changing, *MAIN_MEASURES, *known)) if name in known]


def _has_values(answer: Answer, name: str) -> bool:
    """Return whether a variable of a sweep is a measure with a value in at least one case; a measure has an error."""
    return f"{name}_error" in answer.data and bool(np.isfinite(answer.data[name].values).any())


def spread_indices(size: int, count: int) -> np.ndarray:
    """Return at most `count` evenly spaced indices of `size` elements, both ends included."""
    return np.unique(np.linspace(0, size - 1, min(size, count)).astype(int))


def make_relative(answers: Answers, chart: Chart) -> Panel | None:
    """Return the main measures and those of the chart, divided by their values in the first case, against the only key.

    A band shows changes of up to 5 %.
    """
    curves = []
    for title, answer in answers.items():
        view = view_sweep(answer)
        if view.others or not view.is_grid:
            continue
        x_axis, x = view.scale(view.axis)
        for name in (*MAIN_MEASURES, *chart.y.split()):
            if name not in answer.data:
                continue
            values = view.split_measure(name)[0].ravel()
            if values.size > 1 and abs(values[0]) > 0:  # False for NaN
                keep = select_curve_points(values, MAX_DRAWN_CASES // 2)
                label = join_names(title, name.replace("_", " "))
                curves.append(Curve(label, x[keep], values[keep] / values[0]))
    if not curves:
        return None

    ratios = np.concatenate([curve.y[np.isfinite(curve.y)] for curve in curves])
    # A logarithmic axis leaves out 0.
    is_log = bool(
        ratios.min() >= 0 and ratios.max() >= MIN_LOG_AXIS_KEY_RATIO * ratios[ratios > 0].min()
    )
    band = [np.full(2, 1 + change) for change in (0, -NEGLIGIBLE_CHANGE, NEGLIGIBLE_CHANGE)]
    curves.insert(0, Curve("± 5 %", curves[0].x[[0, -1]], *band))
    axis = Axis("value / value of the first case", is_log=is_log)
    return Panel(chart.title, chart.style, x_axis, axis, curves, chart.caption)


def make_menu(answers: Answers, chart: Chart) -> Panel | None:
    """Return the measures against a swept key, one panel each, with a menu that selects the panel to show."""
    names = list_measures(answers)
    return add_choices(chart, [make_measure_panel(answers, name) for name in names])


def make_measure_panel(answers: Answers, name: str) -> Panel:
    """Return a measure against a swept key, a line for each combination of the other keys.

    Random cases are points against the key with the largest share of the variance of the measure.
    All sweeps have the units of the first one.
    """
    curves = []
    axes = ()
    for title, answer in answers.items():
        # the name may be that of a swept key of another sweep
        if not _has_values(answer, name):
            continue
        view = view_sweep(answer)
        shares = answer.details.get("ranking", {}).get(name)
        if shares and not view.others:
            view = view_sweep(answer, re.sub(r"\W", "_", shares[0]["key"]))
        x_axis, x = view.scale(view.axis)
        axes = axes or (x_axis, view.scale(name, MIN_LOG_AXIS_MEASURE_RATIO)[0])

        # the interval of a quantity without negative values does not reach below zero
        values, errors = (part * axes[1].scale for part in view.split_measure(name))
        least = 0.0 if np.nanmin(values, initial=0.0) >= 0 else -np.inf
        symbols = np.broadcast_to(view.find_symbols(), values.shape)
        arrays = (values, np.maximum(values - errors, least), values + errors, symbols)

        labels = view.name_lines()
        # Lines of a chart, one for each combination of the other keys
        lines = spread_indices(len(values), 8)
        for line in lines:
            keep = select_curve_points(values[line], MAX_DRAWN_CASES // (2 * len(lines)))
            y, low, high, marks = (array[line][keep] for array in arrays)
            curve = Curve(join_names(title, labels[line]), x[keep], y)
            if not np.isnan(high).all():
                curve = replace(curve, low=low, high=high)
            if (marks == "x").any():
                curve = replace(curve, symbols=marks)
            curves.append(curve)
    return Panel(name.replace("_", " "), "dots" if view.is_grid else "points", *axes, curves)


def make_map_menu(answers: Answers, chart: Chart) -> Panel | None:
    """Return the measures as maps over two swept keys, one panel each, with a menu that selects the panel to show."""
    view = view_sweep(next(iter(answers.values())))
    if len(answers) > 1 or len(view.others) != 1:
        return None
    x_axis, x = view.scale(view.axis)
    y_axis, y = view.scale(view.others[0])
    columns = spread_indices(x.size, MAX_MAP_VALUES_PER_KEY)
    rows = spread_indices(y.size, MAX_MAP_VALUES_PER_KEY)
    panels = []
    for name in list_measures(answers):
        axis, _ = view.scale(name)
        values = view.split_lines(name)[np.ix_(rows, columns)] * axis.scale
        if np.isfinite(values).any():
            curve = Curve("", x[columns], values, rows=y[rows])
            title = name.replace("_", " ")
            panels.append(Panel(title, "map", x_axis, y_axis, [curve], colour_label=axis.label))
    return add_choices(chart, panels)


STYLE_FUNCTIONS = {
    "relative": make_relative,
    "menu": make_menu,
    "maps": make_map_menu,
}
