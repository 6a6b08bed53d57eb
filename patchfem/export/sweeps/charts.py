"""Charts of a sweep: panels of the styles `relative`, `menu`, `maps` and `shares`.

They take an answer of kind "sweep", from memory or from its folder. A page of more than
MAX_DRAWN_CASES cases draws evenly spaced cases, and those in which a measure is largest or smallest.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from ...campaigns.sweeps.changes import MAIN_MEASURES
from ...campaigns.sweeps.limits import NEGLIGIBLE_CHANGE
from ...campaigns.sweeps.sweep_table import FINAL_OUTCOMES
from ...core import compute_allowed_error
from ...formatting import format_number
from ..answer import Answer, Variable
from ..charts.panels import Axis, Curve, Panel
from ..charts.table import Chart
from ..quantities import choose_scale

MAX_DRAWN_CASES = 1000  # cases of a measure, so that a page stays below 1.5 MB
MAX_LINES = 8  # lines of a chart, one for each combination of the other keys
MAX_MAP_VALUES = 40  # values of each key in a map
MIN_LOG_RATIO = 10.0  # ratio of the ends of an axis at which it is logarithmic
SYMBOLS = np.array(["circle", "circle-open", "x"])  # settled, over the tolerance, not settled


@dataclass(frozen=True)
class SweepView:
    """Arrays of a sweep over (lines, values of the key on the axis).

    Attributes
    ----------
    answer : Answer
    keys : list of str
        Names of the variables of the swept keys.
    axis : str
        Name of the key on the axis.
    others : list of str
        Names of the other keys of a grid; [] for rows.
    """

    answer: Answer
    keys: list[str]
    axis: str
    others: list[str]

    @classmethod
    def make(cls, answer: Answer, axis: str = "") -> SweepView:
        """Return the view along a key; by default the numerical key with the most values."""
        keys = [re.sub(r"\W", "_", key) for key in answer.details["of"]["keys"]]
        data = answer.data
        by_count = sorted(
            keys,
            key=lambda key: (data[key].values.dtype.kind == "f", np.unique(data[key].values).size),
        )
        axis = axis or by_count[-1]
        is_grid = data[axis].dims == (axis,)
        return cls(answer, keys, axis, [key for key in keys if key != axis] if is_grid else [])

    @property
    def measures(self) -> list[str]:
        """Measures that have a value in at least one case, the main ones first."""
        data = self.answer.data
        names = [name for name in data if f"{name}_error" in data]
        names.sort(key=lambda name: name not in MAIN_MEASURES)
        return [name for name in names if np.isfinite(data[name].values).any()]

    def split(self, name: str) -> np.ndarray:
        """Return a variable of all cases as (lines, values of the key on the axis)."""
        variable = self.answer.data[name]
        place = variable.dims.index(self.axis) if self.others else 0
        moved = np.moveaxis(variable.values, place, -1)
        return moved.reshape(-1, moved.shape[-1])

    def get_column(self, name: str, default: float) -> np.ndarray:
        """Return a variable as `split`, or an array of a default value."""
        if name in self.answer.data:
            return self.split(name)
        return np.full(self.split("outcome").shape, default)

    def find_symbols(self, name: str) -> np.ndarray:
        """Return the places in SYMBOLS of each case: over the tolerance 1, not settled 2, else 0."""
        tolerance = self.answer.details.get("tolerance")
        tolerance = np.nan if tolerance is None else tolerance
        allowed = compute_allowed_error(
            tolerance, self.split(name), self.get_column(f"{name}_floor", 0.0)
        )
        with np.errstate(invalid="ignore"):
            is_over = self.get_column(f"{name}_error", np.nan) > allowed
        if "outcome" not in self.answer.data:
            return is_over.astype(int)
        has_settled = np.isin(self.split("outcome"), FINAL_OUTCOMES)
        return np.where(has_settled, is_over.astype(int), 2)

    def name_lines(self) -> list[str]:
        """Return the values of the other keys of each line as text; [""] for a single line."""
        if not self.others:
            return [""]
        coordinates = [self.answer.data[key].values for key in self.others]
        grids = np.meshgrid(*coordinates, indexing="ij")
        rows = zip(*(grid.ravel().tolist() for grid in grids), strict=True)
        return [
            ", ".join(
                f"{key.replace('_', ' ')} {format_value(self.answer.data[key], value)}"
                for key, value in zip(self.others, row)
            )
            for row in rows
        ]


def format_value(variable: Variable, value: float | str) -> str:
    """Return a value of a key with its unit."""
    if isinstance(value, str):
        return value
    unit, scale = choose_scale("", variable.unit or "1", abs(value))
    return f"{format_number(value * scale, 4)} {unit}".strip()


def make_axis(name: str, variable: Variable) -> tuple[Axis, np.ndarray]:
    """Return the axis of a variable, and its values in the unit of the axis; words stay words."""
    label = name.replace("_", " ")
    values = variable.values
    if values.dtype.kind != "f":
        return Axis(label), values.astype(str)
    finite = values[np.isfinite(values)]
    unit, scale = choose_scale(name, variable.unit or "1", np.abs(finite).max(initial=0.0))
    is_log = bool(finite.size and finite.min() > 0 and finite.max() >= MIN_LOG_RATIO * finite.min())
    return Axis(f"{label} [{unit}]" if unit else label, scale, is_log), values * scale


def select_cases(values: np.ndarray, count: int) -> np.ndarray:
    """Return the indices of at most `count` of the values (n,): evenly spaced ones and the extremes."""
    if values.size <= count:
        return np.arange(values.size)
    finite = np.flatnonzero(np.isfinite(values))
    extremes = [finite[pick(values[finite])] for pick in (np.argmin, np.argmax) if finite.size]
    spaced = np.linspace(0, values.size - 1, count - len(extremes)).astype(int)
    return np.unique([*spaced, *extremes]).astype(int)


def make_relative(answers: dict[str, Answer], chart: Chart) -> Panel | None:
    """Return the main measures relative to their first case along a key, with the band of 5 %."""
    curves = []
    x_axis = None
    for title, answer in answers.items():
        view = SweepView.make(answer)
        if answer.data[view.axis].dims != (view.axis,):
            continue  # rows in any order have no first case
        x_axis, x = make_axis(view.axis, answer.data[view.axis])
        order = np.argsort(x, kind="stable")
        for name in view.measures:
            values = view.split(name)[0][order]
            if name not in chart.y or not np.isfinite(values[0]) or values[0] == 0:
                continue
            keep = select_cases(values, MAX_DRAWN_CASES)
            label = ", ".join(part for part in (title, name.replace("_", " ")) if part)
            curves.append(Curve(label, x[order][keep], (values / values[0])[keep]))
    if not curves or curves[0].x.size < 2:
        return None

    ends = curves[0].x[[0, -1]]
    one = np.ones(2)
    low, high = one - NEGLIGIBLE_CHANGE, one + NEGLIGIBLE_CHANGE
    curves.insert(0, Curve("± 5 %", ends, one, low, high))
    ratios = np.concatenate([curve.y for curve in curves])
    ratios = ratios[np.isfinite(ratios)]
    is_log = bool(ratios.min() > 0 and ratios.max() >= MIN_LOG_RATIO * ratios.min())
    y_axis = Axis("value / value of the first case", is_log=is_log)
    return Panel(chart.title, chart.style, x_axis, y_axis, curves, caption=chart.caption)


def make_menu(answers: dict[str, Answer], chart: Chart) -> Panel | None:
    """Return a panel for each measure against a key, between which a menu chooses."""
    views = {title: SweepView.make(answer) for title, answer in answers.items()}
    names = dict.fromkeys(name for view in views.values() for name in view.measures)
    panels = [make_measure_panel(views, name) for name in names]
    return _make_choices(chart, panels)


def _make_choices(chart: Chart, panels: list[Panel]) -> Panel | None:
    """Return a panel with a menu of panels; None without panels."""
    if not panels:
        return None
    title, caption = chart.title, chart.caption
    return replace(panels[0], title=title, style=chart.style, caption=caption, choices=panels)


def make_measure_panel(views: dict[str, SweepView], name: str) -> Panel:
    """Return a measure against a swept key, a line for each combination of the other keys.

    Random cases are points against the key with the largest share of the variance of the measure.
    """
    curves = []
    x_axis = y_axis = None
    for title, view in views.items():
        answer = view.answer
        if name not in view.measures:
            continue
        shares = answer.details.get("ranking", {}).get(name)
        if shares and not view.others and len(view.keys) > 1:
            view = SweepView.make(answer, re.sub(r"\W", "_", shares[0]["key"]))
        x_axis, x = make_axis(view.axis, answer.data[view.axis])
        # all sweeps have the unit of the first one
        first_axis, _ = make_axis(name, answer.data[name])
        y_axis = y_axis or first_axis
        values = view.split(name) * y_axis.scale
        errors = view.get_column(f"{name}_error", np.nan) * y_axis.scale
        symbols = view.find_symbols(name)
        lines = np.unique(np.linspace(0, len(values) - 1, MAX_LINES).astype(int))
        texts = view.name_lines()
        for line in lines.tolist():
            keep = select_cases(values[line], MAX_DRAWN_CASES // len(lines))
            y, error, codes = (array[line][keep] for array in (values, errors, symbols))
            label = ", ".join(part for part in (title, texts[line]) if part)
            marks = SYMBOLS[codes] if codes.any() else None
            band = (None, None) if np.isnan(error).all() else (y - error, y + error)
            curves.append(Curve(label, x[keep], y, *band, symbols=marks))
    title = name.replace("_", " ")
    is_line = all(view.answer.data[view.axis].dims == (view.axis,) for view in views.values())
    return Panel(title, "dots" if is_line else "points", x_axis, y_axis, curves)


def make_map_menu(answers: dict[str, Answer], chart: Chart) -> Panel | None:
    """Return a map of each measure over two keys, between which a menu chooses."""
    view = SweepView.make(next(iter(answers.values())))
    if len(answers) > 1 or len(view.others) != 1:
        return None
    data = view.answer.data
    x_axis, x = make_axis(view.axis, data[view.axis])
    y_axis, y = make_axis(view.others[0], data[view.others[0]])
    columns = np.unique(np.linspace(0, x.size - 1, MAX_MAP_VALUES).astype(int))
    rows = np.unique(np.linspace(0, y.size - 1, MAX_MAP_VALUES).astype(int))
    panels = []
    for name in view.measures:
        axis, _ = make_axis(name, data[name])
        values = view.split(name)[np.ix_(rows, columns)] * axis.scale
        if not np.isfinite(values).any():
            continue
        curve = Curve("", x[columns], values, rows=y[rows])
        title = name.replace("_", " ")
        panels.append(Panel(title, "map", x_axis, y_axis, [curve], colour_label=axis.label))
    return _make_choices(chart, panels)


def make_shares(answers: dict[str, Answer], chart: Chart) -> Panel | None:
    """Return bars of the shares of the variance with their intervals, with a menu of the measures."""
    panels = []
    ranking = next(iter(answers.values())).details.get("ranking", {})
    for name, indices in ranking.items() if len(answers) == 1 else ():
        indices = indices[::-1]  # the first bar of plotly is at the bottom
        keys = np.array([index["key"] for index in indices])
        numbers = {
            part: np.array([100 * index[part] for index in indices])
            for part in ("first", "total", "low", "high")
        }
        has_interval = np.any(numbers["low"] != numbers["high"])
        ends = (numbers["low"], numbers["high"]) if has_interval else (None, None)
        curves = [
            Curve("with interactions", keys, numbers["total"], *ends),
            Curve("alone", keys, numbers["first"]),
        ]
        title = name.replace("_", " ")
        panels.append(Panel(title, "bars", Axis("share of the variance [%]"), Axis(""), curves))
    return _make_choices(chart, panels)


STYLES = {
    "relative": make_relative,
    "menu": make_menu,
    "maps": make_map_menu,
    "shares": make_shares,
}
