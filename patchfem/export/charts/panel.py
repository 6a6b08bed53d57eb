"""A chart with its data in display units, which plotly.js or matplotlib draws."""

from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from ..quantities import DISPLAY_UNIT_LADDERS, choose_scale
from ..rows import Chart

MAX_CURVE_INTERVALS = 3000  # largest number of intervals of which a curve keeps the extremes


@dataclass(frozen=True, slots=True)
class Axis:
    """Axis of a chart.

    Attributes
    ----------
    label : str
        Name with the unit in brackets.
    scale : float
        Number of units of the label in one SI unit.
    is_log : bool
        Whether the axis is logarithmic.
    """

    label: str
    scale: float = 1.0
    is_log: bool = False

    @property
    def unit(self) -> str:
        """Unit of the label, in which the values are displayed."""
        return self.label.partition("[")[2].rstrip("]")


@dataclass(frozen=True, eq=False, slots=True)
class Curve:
    """Curve of a chart, in display units.

    Attributes
    ----------
    name : str
        Entry of the legend; "" for none.
    x, y : (k,) ndarray
        For a map, `y` (j, k) contains the colours and `rows` (j,) the vertical positions.
    low, high : (k,) ndarray or None
        Ends of the error band.
    rows : (j,) ndarray or None
        Vertical positions of a map.
    meanings : tuple of str
        Names of the codes of a map.
    is_line : bool
        Whether the curve is a line in a chart of points.
    symbols : (k,) ndarray of str or None
        Symbols of the points: "circle" or "x".
    weight : float
        Width of a line over the usual one; a bolder line lies above the others.
    """

    name: str
    x: np.ndarray
    y: np.ndarray
    low: np.ndarray | None = None
    high: np.ndarray | None = None
    rows: np.ndarray | None = None
    meanings: tuple[str, ...] = ()
    is_line: bool = False
    symbols: np.ndarray | None = None
    weight: float = 1.0


@dataclass(frozen=True, eq=False, slots=True)
class Panel:
    """Chart with its data.

    Attributes
    ----------
    title : str
        Heading of the chart.
    style : str
        "line", "points", "dots", "area", "overlay", "map" or "film": how curves are drawn.
    x, y : Axis
        Horizontal and vertical axis.
    curves : list of Curve
        Data in the units of the axes.
    caption : str
        Sentence below the chart.
    marks : list of float
        Positions of vertical lines.
    choices : list of Panel
        Panels between which a menu chooses; empty without a menu.
    colour_label : str
        Title of the colours of a map.
    """

    title: str
    style: str
    x: Axis
    y: Axis
    curves: list[Curve]
    caption: str = ""
    marks: list[float] = field(default_factory=list)
    choices: list["Panel"] = field(default_factory=list)
    colour_label: str = ""

    @property
    def description(self) -> str:
        """Text alternative of the chart: its axes and its curves."""
        names = ", ".join(curve.name for curve in self.curves if curve.name)
        return f"{self.title}: {self.y.label} against {self.x.label}. {names}".strip()


def make_axis(name: str, unit: str, values: np.ndarray, is_log: bool = False) -> Axis:
    """Return the axis for values.

    Parameters
    ----------
    name : str
        Name of the quantity; one such as `contact_fraction` is displayed in percent.
    unit : str
        SI unit; "" for a number.
    values : array
        [SI]
    is_log : bool, optional
        Whether the axis is logarithmic.
    """
    label = " ".join(name.replace("_", " ").split())
    size = np.abs(values[np.isfinite(values)]).max(initial=0.0)
    unit, scale = choose_scale(name, unit or "1", size)
    return Axis(f"{label} [{unit}]" if unit else label, scale, is_log)


def use_units(panel: Panel, x_label: str, y_label: str) -> Panel:
    """Return a panel of curves in the units of the labels of axes on which something is drawn already.

    A unit of another quantity is left as it is, and so is a map.
    """
    if panel.style in ("map", "film"):
        return panel
    x_factor = find_unit_factor(panel.x.unit, Axis(x_label).unit)
    y_factor = find_unit_factor(panel.y.unit, Axis(y_label).unit)
    curves = []
    for curve in panel.curves:
        ends = {name: getattr(curve, name) for name in ("y", "low", "high")}
        ends = {name: values * y_factor for name, values in ends.items() if values is not None}
        curves.append(replace(curve, x=curve.x * x_factor, **ends))
    return replace(
        panel,
        x=panel.x if x_factor == 1 else replace(panel.x, label=_replace_unit(panel.x, x_label)),
        y=panel.y if y_factor == 1 else replace(panel.y, label=_replace_unit(panel.y, y_label)),
        curves=curves,
        marks=[mark * x_factor for mark in panel.marks],
    )


def find_unit_factor(unit: str, other: str) -> float:
    """Return the number of another display unit in a unit of the same quantity; 1 for another quantity."""
    for ladder in DISPLAY_UNIT_LADDERS.values():
        scales = dict(ladder)
        if {unit, other} <= scales.keys():
            return scales[other] / scales[unit]
    return 1.0


def _replace_unit(axis: Axis, label: str) -> str:
    """Return the label of an axis with the unit of another label."""
    return f"{axis.label.partition(' [')[0]} [{Axis(label).unit}]"


def select_curve_points(values: np.ndarray, count: int = MAX_CURVE_INTERVALS) -> np.ndarray:
    """Return the indices of the points that suffice to draw a long curve.

    They are those of the smallest and the largest value in each of `count` intervals.
    """
    if values.size <= 2 * count:
        return np.arange(values.size)
    # An unknown value is no extreme.
    low = np.where(np.isnan(values), np.inf, values)
    high = np.where(np.isnan(values), -np.inf, values)
    edges = np.linspace(0, values.size, count + 1).astype(int)
    extremes = [0, values.size - 1]
    for begin, end in pairwise(edges):
        extremes.append(begin + low[begin:end].argmin())
        extremes.append(begin + high[begin:end].argmax())
    return np.unique(extremes)


def join_names(*names: str) -> str:
    """Return the parts of an entry of the legend that are not empty."""
    return ", ".join(name for name in names if name)


def add_choices(chart: Chart, panels: list[Panel]) -> Panel | None:
    """Return the first of the panels with a menu of all of them, and with title, caption and style of the chart.

    A single panel has no menu, and its own style. Without panels the panel is None.
    """
    if not panels:
        return None
    panel = replace(panels[0], title=chart.title, caption=chart.caption)
    return replace(panel, style=chart.style, choices=panels) if len(panels) > 1 else panel
