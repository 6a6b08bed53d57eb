"""The figures of a run as data.

`pictures` draws them on matplotlib Axes, `curves.js` on a page. A chart is a dict. `title`; `x`,
`y`: {label, unit, log}, and `range` [low, high] if not all is shown; `marks`: what is drawn, from
back to front; `labels`: strings at points, only in `pictures`; `frame`: its size [px] if both axes
have the same scale. A mark has a `kind` (line, dots, band, span, rule, arrow, cells), a `name` for
the legend ("" for none), a `colour` (accent, warm, soft, or #rrggbb) and its numbers, in the units
of the axes.
"""

from itertools import pairwise

import numpy as np

from ...core import G_N
from ...formatting import choose_axis_unit, format_number, needs_log_scale

MAX_LINE_POINTS = 6000  # largest number of points of a drawn line; longer lines are thinned to it
MIN_LINE_POINTS = 200  # smallest number of points that thinning leaves of a line
MAX_FRAMES = 24  # largest number of frames whose shear stress is drawn in the background
FAINT_FRAME_POINTS = 400  # largest number of points of such a background line
MAX_PICTURE_CELLS = 6000  # approximate number of cells per piece in a picture
CHARACTERS_PER_NUMBER = 13  # estimated number of characters per number in a page
REGIMES = {"stable": "solid", "stuck": "solid", "unstable": "dashed", "unbounded": "dotted"}
COLOURS = ("accent", "warm", "#2f9e63", "#8e5fc2", "#b08a12", "#c14a86")
MIL = 25.4e-6
MIN_SAMPLES_PER_CYCLE = 20  # smallest number of samples per cycle whose line shows the motion
MAX_ENVELOPE_CYCLES = 1500  # largest number of bins of an envelope; more cycles share bins
# Labels of the measures that are charted over the wear cycles.
WEAR_LABELS = {
    "pressure_peak": "peak pressure",
    "contact_fraction": "contact fraction",
    "normal_stiffness": "normal stiffness",
    "loop_area": "loop area",
    "relative_displacement_amplitude": "amplitude",
}
MAX_WEAR_PROFILES = 6  # largest number of wear cycles whose pressure and depth profiles are drawn
MIN_COHERENCE = 0.5  # smallest coherence at which H1 is drawn as reliable
# Height and largest width [px] of a frame with equal scales on both axes.
FRAME_HEIGHT = 270
MAX_FRAME_WIDTH = 300


def make_axis(label: str, unit: str = "", log: bool = False) -> dict:
    """Return an axis of a chart as a dict with label, unit and scale.

    Parameters
    ----------
    label : str
    unit : str
        Unit of the values; "" if they have none.
    log : bool
        Whether the axis is logarithmic.
    """
    return {"label": label, "unit": unit, "log": log}


def make_chart(title: str, x: dict, y: dict, marks: list) -> dict:
    """Return a chart as a dict with its axes and marks.

    Parameters
    ----------
    title : str
    x, y : dict
        Axes of `make_axis`.
    marks : list
        Marks of `make_mark`; None is left out.
    """
    return {"title": title, "x": x, "y": y, "marks": [mark for mark in marks if mark]}


def make_mark(kind: str, colour: str, name: str = "", **numbers) -> dict:
    """Return a chart mark (line, points, band, ...) as a dict.

    Parameters
    ----------
    kind : str
        Such as line, band, dots, cells, rule, span, arrow.
    colour : str
        Name of a colour of the page, or a hexadecimal colour.
    name : str
        Entry of the legend; "" for none.
    **numbers
        Arrays and style of the mark.
    """
    return {"kind": kind, "colour": colour, "name": name, **numbers}


def make_dots(x, y, colour: str, name: str = "", **style) -> dict:
    """Return a chart mark of points with optional error bars.

    Parameters
    ----------
    x, y : (n,) array
    colour : str
    name : str
        Entry of the legend; "" for none.
    **style
        errors (n,), shape, size [points].
    """
    return make_mark("dots", colour, name, x=x, y=y, **style)


def make_line(
    x, y, colour: str, name: str = "", max_points: int = MAX_LINE_POINTS, **style
) -> dict:
    """Return a chart mark of a line, with fewer points if there are many.

    Parameters
    ----------
    x, y : (n,) array
    colour : str
    name : str
        Entry of the legend; "" for none.
    max_points : int
        Largest number of points.
    **style
        width, dash, alpha.
    """
    x = np.asarray(x, float)
    y = np.asarray(y, float)
    keep = sample_indices(x, y, max_points)
    return make_mark("line", colour, name, x=x[keep], y=y[keep], **style)


def sample_indices(x, y, max_points: int) -> np.ndarray:
    """Select the indices of points that represent a line with many points.

    From every stretch of the line these are the lowest and the highest x and y.

    Parameters
    ----------
    x, y : (n,) array
    max_points : int

    Returns
    -------
    (k,) array of int
    """
    if x.size <= max_points:
        return np.arange(x.size)
    size = -(-x.size // ((max_points - 2) // 4))
    first = np.arange(0, x.size, size)
    padded = np.full((2, first.size * size), np.nan)
    padded[:, : x.size] = x, y
    stretches = np.where(np.isnan(padded), 0.0, padded).reshape(2, -1, size)
    # The last stretch may be shorter and is padded with its first point.
    stretches[:, -1, x.size - first[-1] :] = stretches[:, -1, :1]
    ends = np.concatenate(
        [stretches.argmin(axis=2).ravel(), stretches.argmax(axis=2).ravel()]
    ) + np.tile(first, 4)
    return np.unique(np.concatenate([[0], ends, [x.size - 1]]))


def limit_characters(all_charts: list, max_characters: int) -> list:
    """Remove points from lines and bands until the charts take at most a given number of characters.

    A number takes CHARACTERS_PER_NUMBER characters.
    """
    sizes = [
        sum(np.size(value) for value in mark.values() if not isinstance(value, str | dict))
        for chart in all_charts
        for mark in chart["marks"]
    ]
    if (total := CHARACTERS_PER_NUMBER * sum(sizes)) <= max_characters:
        return all_charts
    return [
        chart | {"marks": [_reduce_mark(mark, max_characters / total) for mark in chart["marks"]]}
        for chart in all_charts
    ]


def _reduce_mark(mark: dict, fraction: float) -> dict:
    """Reduce a chart line or band to a fraction of its points."""
    rows = {"line": ("x", "y"), "band": ("x", "low", "high")}.get(mark["kind"])
    if rows is None or np.size(mark["x"]) <= MIN_LINE_POINTS:
        return mark
    x, *_, y = (np.asarray(mark[name], float) for name in rows)
    keep = sample_indices(x, y, max(int(fraction * x.size), MIN_LINE_POINTS))
    return mark | {name: np.asarray(mark[name], float)[keep] for name in rows}


def contact_range(x, sigma) -> tuple | None:
    """Return the ends [m] of the loaded part of a patch, or None if the full patch is shown.

    Only this part is shown if less than half of the length is pressed.
    """
    used = np.flatnonzero(sigma > 0)
    if not used.size or used.size >= 0.5 * x.size:
        return None
    pad = 0.15 * (x[used[-1]] - x[used[0]]) + (x[1] - x[0])
    return max(x[0], x[used[0]] - pad), min(x[-1], x[used[-1]] + pad)


def interface_charts(x, fields: dict, name: str = "") -> list:
    """Return charts of the pressure, and of the shear stress in several frames.

    The frame with the largest resultant force is in colour.

    Parameters
    ----------
    x : (m,) array
        [m]
    fields : dict
        `normal_stress` (f, m) [Pa], and `shear_stress` if there is any.
    name : str
        Name of the interface, if there are several.
    """
    sigma = fields["normal_stress"][0]
    tau = fields.get("shear_stress")
    drawn_range = contact_range(x, sigma) or (x[0], x[-1])
    length_unit, length_scale = choose_axis_unit(drawn_range, "m")
    x_axis = make_axis("x", length_unit) | {
        "range": [drawn_range[0] * length_scale, drawn_range[1] * length_scale]
    }
    unit, scale = choose_axis_unit(sigma, "Pa")
    drawn_charts = [
        make_chart(
            f"Pressure on {name or 'the interface'}",
            x_axis,
            make_axis("normal stress", unit),
            [
                make_mark("band", "accent", x=x * length_scale, low=0 * x, high=sigma * scale),
                make_line(x * length_scale, sigma * scale, "accent"),
            ],
        )
    ]
    if tau is not None and np.any(tau):
        unit, scale = choose_axis_unit(tau, "Pa")
        frame = int(np.argmax(np.abs(tau @ np.gradient(x))))
        frame_numbers = np.unique(
            np.linspace(1, len(tau) - 1, min(MAX_FRAMES, len(tau) - 1)).round().astype(int)
        )
        frames = [
            make_line(
                x * length_scale,
                tau[k] * scale,
                "soft",
                max_points=FAINT_FRAME_POINTS,
                width=0.6,
                alpha=0.6,
            )
            for k in frame_numbers
        ]
        title = f"Shear stress{f' on {name}' * bool(name)} at {len(frame_numbers)} instants"
        drawn_charts.append(
            make_chart(
                title,
                x_axis,
                make_axis("shear stress", unit),
                [*frames, make_line(x * length_scale, tau[frame] * scale, "warm")],
            )
        )
    return drawn_charts


def faces_charts(faces: list) -> list:
    """Return the charts of all interfaces that have a patch.

    Each entry of `faces` contains the arguments of `interface_charts`.
    """
    return [interface_chart for face in faces for interface_chart in interface_charts(*face)]


def contact_window(x, depth, sigma, ratio: float) -> tuple:
    """Return the section (left, right, height) [m] of both pieces around the contact.

    Its proportions are right - left = 2 height ratio.

    Parameters
    ----------
    x, depth : (m,), (ny,) array
        Mesh lines [m].
    sigma : (m,) array
        Normal stress [Pa], positive somewhere.
    ratio : float
        Width / height of the picture.
    """
    pressed_nodes = np.flatnonzero(sigma > 0)
    first = x[pressed_nodes[0]]
    last = x[pressed_nodes[-1]]
    length = x[-1] - x[0]
    width = min(1.6 * (last - first) + 2 * (x[1] - x[0]), 0.4 * length)
    middle = (first + last) / 2
    if last - first > width:
        middle = x[np.flatnonzero(sigma >= (1 - 1e-6) * sigma.max())[0]]
    height = min(width / ratio / 2, depth[-1])
    left = min(max(middle - width / 2, x[0]), x[-1] - width)
    return left, left + width, height


def stress_charts(x, depths, mises, sigma) -> list:
    """Return charts of the von Mises stress in both pieces, full and around the contact.

    Parameters
    ----------
    x : (nx,) array
        Mesh lines [m].
    depths : tuple of (ny,) arrays
        Mesh lines of the lower and of the upper piece [m].
    mises : tuple of (nx - 1, ny - 1) arrays
        Stress in their cells [Pa]. The colours end below the few most stressed cells.
    sigma : (nx,) array
        Normal stress [Pa].
    """
    depth = max(depths, key=lambda rows: rows[-1])
    contact_box = contact_window(x, depth, sigma, 1.3)
    (unit, scale), colour_limit, drawn_charts = (
        choose_axis_unit(np.concatenate([np.ravel(part) for part in mises]), "Pa"),
        0.0,
        [],
    )
    for left, right, height in (contact_box, (x[0], x[-1], depth[-1])):
        name, size = choose_axis_unit((left, right, height), "m")
        i = slice(max(np.searchsorted(x, left, "right") - 1, 0), np.searchsorted(x, right) + 1)
        rows = [part[: np.searchsorted(part, height) + 1] for part in depths]
        cells = [
            part[i.start : i.stop - 1, : row.size - 1] * scale for part, row in zip(mises, rows)
        ]
        # The contact region comes first, so that it sets the colour scale of both charts.
        colour_limit = colour_limit or float(
            np.quantile(np.concatenate([part.ravel() for part in cells]), 0.998)
        )
        marks = []
        for side, row, part in zip((-1, 1), rows, cells):
            x_lines, depth_lines, means = reduce_grid(x[i], row, part, MAX_PICTURE_CELLS)
            # Four digits suffice for values that are shown as colours.
            values = np.array([float(f"{v:.4g}") for v in means.ravel().tolist()]).reshape(
                means.shape
            )
            marks.append(
                make_mark(
                    "cells",
                    "",
                    x=x_lines * size,
                    y=side * depth_lines * size,
                    value=values,
                    top=colour_limit,
                    unit=unit,
                )
            )
        x_range, y_range = (
            {"range": [low * size, high * size]} for low, high in ((left, right), (-height, height))
        )
        title = "Von Mises stress" if drawn_charts else "Von Mises stress at the contact"
        drawn_charts.append(
            make_chart(title, make_axis("x", name) | x_range, make_axis("y", name) | y_range, marks)
            | {"frame": _frame_size((right - left) / (2 * height))}
        )
    return drawn_charts[::-1]


def worn_map_chart(x, width: float, depth) -> list:
    """Return a map of the worn depth of the strips over length and width of a patch.

    Parameters
    ----------
    x : (m,) array [m]
    width : float [m]
    depth : (s, m) array [m]
        Worn depth of each strip.
    """
    edges = np.linspace(-width / 2, width / 2, len(depth) + 1)
    (unit, scale), (name, size) = (
        choose_axis_unit(depth, "m"),
        choose_axis_unit(np.concatenate([x, edges]), "m"),
    )
    x_lines, across_lines, means = reduce_grid(
        x, edges, (depth[:, 1:] + depth[:, :-1]).T / 2 * scale, MAX_PICTURE_CELLS
    )
    values = np.array([float(f"{v:.4g}") for v in means.ravel().tolist()]).reshape(means.shape)
    marks = [
        make_mark(
            "cells",
            "",
            "worn depth",
            x=x_lines * size,
            y=across_lines * size,
            value=values,
            top=float(values.max()),
            unit=unit,
        )
    ]
    across, up = (
        {"range": [low * size, high * size]} for low, high in ((x[0], x[-1]), (edges[0], edges[-1]))
    )
    return [
        make_chart("Worn depth", make_axis("x", name) | across, make_axis("y", name) | up, marks)
        | {"frame": _frame_size(float(np.ptp(x)) / width)}
    ]


def reduce_grid(x, depth, cells, max_cells: int) -> tuple:
    """Average a grid of values over blocks of cells until the grid has about a given number of cells.

    Parameters
    ----------
    x, depth : (nx,), (ny,) array
        Lines.
    cells : (nx - 1, ny - 1) array
    max_cells : int

    Returns
    -------
    tuple
        Lines (n,), (m,) and cells (n - 1, m - 1).
    """
    if cells.size <= max_cells:
        return x, depth, cells
    rows = min(depth.size - 1, max(int((max_cells / 2) ** 0.5), max_cells // (x.size - 1)))
    kept_lines = [
        np.linspace(0, line.size - 1, count + 1).round().astype(int)
        for line, count in ((x, min(x.size - 1, max_cells // rows)), (depth, rows))
    ]
    for axis, (line, keep) in enumerate(zip((x, depth), kept_lines)):
        size = np.diff(line)
        parts = np.add.reduceat(np.moveaxis(cells, axis, -1) * size, keep[:-1], axis=-1)
        cells = np.moveaxis(parts / np.add.reduceat(size, keep[:-1]), -1, axis)
    return x[kept_lines[0]], depth[kept_lines[1]], cells


def _frame_size(ratio: float) -> list:
    """Return width and height [px] of a picture with a given aspect ratio."""
    if FRAME_HEIGHT * ratio <= MAX_FRAME_WIDTH:
        return [round(FRAME_HEIGHT * ratio), FRAME_HEIGHT]
    return [MAX_FRAME_WIDTH, round(MAX_FRAME_WIDTH / ratio)]


def loop_chart(slide, force, title: str, measured: tuple | None = None) -> list:
    """Return the chart of friction force against slip displacement, with the measured loop if there is one.

    Parameters
    ----------
    slide, force : (k,) array
        [m], [N]
    title : str
    measured : tuple, optional
        Measured slide and force.
    """
    (slide_unit, size), (force_unit, scale) = (
        choose_axis_unit(slide, "m"),
        choose_axis_unit(force, "N"),
    )
    read = (
        None
        if measured is None
        else make_line(
            measured[0] * size, measured[1] * scale, "soft", "measured", width=3, alpha=0.55
        )
    )
    return [
        make_chart(
            title,
            make_axis("slide", slide_unit),
            make_axis("friction force", force_unit),
            [read, make_line(slide * size, force * scale, "accent", "computed" if read else "")],
        )
    ]


def loop_charts(loops: list) -> list:
    """Return the charts of the friction loops of all interfaces."""
    return [
        chart
        for name, slide, force in loops
        for chart in loop_chart(slide, force, f"Friction loop of interface {name}")
    ]


def cycle_envelope(time, value, period: float) -> tuple:
    """Return the middle time, minimum and maximum of each cycle; NaN for a cycle without samples.

    Cycles are merged if there are more than a picture can show.

    Parameters
    ----------
    time, value : (k,) array
        Times in ascending order [s], and values.
    period : float
        [s]
    """
    cycles_per_bin = int(np.ceil(max(1.0, (time[-1] - time[0]) / period / MAX_ENVELOPE_CYCLES)))
    number = np.floor(time / (cycles_per_bin * period) + 1e-9).astype(int)
    count = number[-1] + 1
    low = np.full(count, np.inf)
    high = np.full(count, -np.inf)
    np.minimum.at(low, number, value)
    np.maximum.at(high, number, value)
    empty = low > high
    low[empty] = high[empty] = np.nan
    return (np.arange(count) + 0.5) * cycles_per_bin * period, low, high


def first_complete_time(time, period: float, window_start: float) -> float:
    """Return the time [s] from which the stored samples represent the motion itself.

    Every later cycle has at least MIN_SAMPLES_PER_CYCLE samples. The last window is always stored completely, so
    the time is never after its start.

    Parameters
    ----------
    time : (k,) array
        Times of the samples [s].
    period : float
        [s]
    window_start : float
        Start of the last window [s].
    """
    counts = np.bincount(np.floor(time / period + 1e-9).astype(int))[:-1]
    thin = np.flatnonzero(counts < MIN_SAMPLES_PER_CYCLE)
    return min((thin[-1] + 1) * period, window_start) if thin.size else float(time[0])


def history_charts(
    history: dict,
    window: dict | None,
    period: float | None,
    title: str = "Last cycles",
    draw_lines: bool = False,
) -> list:
    """Return charts of the motion over all cycles, and of the last cycles or the friction force.

    Parameters
    ----------
    history : dict
        time, displacement, force, (k,) each; `measured`: measured times [s] and forces [N].
    window : dict or None
        The last cycles alone, with the accelerations of base and block.
    period : float or None
        Period of the drive [s]; None if every sample is stored.
    title : str
        Title of the last cycles.
    draw_lines : bool
        Whether earlier reversals are drawn as a line through them instead of a band per cycle.
    """
    time = history["time"]
    value = history["displacement"]
    name, per = choose_axis_unit(time, "s")
    unit, scale = choose_axis_unit(value, "m")
    first_complete = time[0]
    if period:
        first_complete = first_complete_time(time, period, window["time"][0] if window else 0.0)
    is_late = time >= first_complete
    marks = []
    if draw_lines and not is_late.all():
        early = slice(0, int(np.argmax(is_late)) + 1)
        marks.append(make_line(time[early] * per, value[early] * scale, "accent", width=1.0))
    elif not is_late.all():
        middle, low, high = cycle_envelope(time[~is_late], value[~is_late], period)
        marks.append(
            make_mark("band", "accent", x=middle * per, low=low * scale, high=high * scale)
        )
    marks.append(make_line(time[is_late] * per, value[is_late] * scale, "accent", width=1.0))
    drawn_charts = [
        make_chart("Whole run", make_axis("time", name), make_axis("displacement", unit), marks)
    ]
    if window is None:
        if np.any(history["force"]):
            force_unit, size = choose_axis_unit(history["force"], "N")
            measured = history.get("measured")
            measured = measured and make_line(
                measured[0] * per, measured[1] * size, "soft", "measured", width=3, alpha=0.55
            )
            drawn_charts.append(
                make_chart(
                    "Friction force",
                    make_axis("time", name),
                    make_axis("friction force", force_unit),
                    [
                        measured,
                        make_line(
                            time * per,
                            history["force"] * size,
                            "warm",
                            "computed" if measured else "",
                        ),
                    ],
                )
            )
        return drawn_charts
    since = window["time"] - window["time"][0]
    (name, per), (unit, scale) = (
        choose_axis_unit(since, "s"),
        choose_axis_unit(window["displacement"], "m"),
    )
    drawn_charts.append(
        make_chart(
            title,
            make_axis("time", name),
            make_axis("displacement", unit),
            [make_line(since * per, window["displacement"] * scale, "accent")],
        )
    )
    base_moves = np.any(window["base"])
    drawn_charts.append(
        make_chart(
            title,
            make_axis("time", name),
            make_axis("acceleration", "g"),
            [
                make_line(
                    since * per,
                    window["acceleration"] / G_N,
                    "warm",
                    "output" if base_moves else "",
                ),
                make_line(since * per, window["base"] / G_N, "soft", "base", dash="dashed")
                if base_moves
                else None,
            ],
        )
    )
    return drawn_charts


def measured_charts(rows: list, frequency: float, level: float, acceleration, displacement) -> list:
    """Return charts of the measured responses against the input, and of the computed response.

    Parameters
    ----------
    rows : list
        Rows of the measured table.
    frequency : float
        [Hz]
    level : float
        Input [m s-2].
    acceleration, displacement : tuple or None
        Computed value and error in SI.
    """
    rows_at_frequency = [r for r in rows if abs(r.frequency - frequency) < 0.5]
    drawn_charts = []
    for name, unit, scale, computed in (
        ("acceleration", "g", G_N, acceleration),
        ("displacement", "mil", MIL, displacement),
    ):
        rows_with_value = [r for r in rows_at_frequency if getattr(r, name) is not None]
        marks = []
        marks += [
            make_mark("rule", "warm", "unstable in the test", x=place)
            for place in sorted({r.input / G_N for r in rows_at_frequency if "U" in r.flag})
        ]
        for repeat, text in ((False, "measured"), (True, "measured, repeat run")):
            drawn_rows = [r for r in rows_with_value if ("R" in r.flag) == repeat]
            if drawn_rows:
                marks.append(
                    make_mark(
                        "dots",
                        "soft",
                        text,
                        x=[r.input / G_N for r in drawn_rows],
                        y=[getattr(r, name) / scale for r in drawn_rows],
                        shape="square" if repeat else "circle",
                    )
                )
        if computed is not None:
            marks.append(
                make_mark(
                    "dots",
                    "accent",
                    "computed",
                    x=[level / G_N],
                    y=[computed[0] / scale],
                    shape="diamond",
                    errors=[(computed[1] or 0.0) / scale],
                )
            )
        title = f"{name.capitalize()} at {frequency:g} Hz" + (
            "" if rows_with_value else ", not measured"
        )
        drawn_charts.append(
            make_chart(title, make_axis("input", "g"), make_axis(name, unit), marks)
        )
    return drawn_charts


def regime_stretches(curve: dict) -> list:
    """Split a curve into ranges of neighbouring points that have the same regime.

    curve: a curve of steady motions.
    """
    regime = np.asarray(curve["regime"], str)
    edges = [0, *(np.flatnonzero(regime[1:] != regime[:-1]) + 1), regime.size]
    return [(str(regime[a]), int(a), int(b)) for a, b in pairwise(edges)]


def curve_axis(curve: dict) -> tuple:
    """Return name, values and unit of the horizontal axis of a curve."""
    if np.ptp(curve["frequency"]) > 0:
        return np.asarray(curve["frequency"]), "drive frequency", "Hz"
    return np.asarray(curve["level"]) / G_N, "drive level", "g"


def regime_sentence(steady: dict | None) -> str:
    """Return a sentence on the regime and stability of a steady motion, or "" if there is no steady motion."""
    if steady is None:
        return ""
    size = steady["multiplier"]
    text = f" Regime: {steady['regime']}; largest Floquet multiplier {size:.4g}"
    if steady["regime"] in ("stuck", "unbounded") or size == 0:
        return text + "."
    return text + (
        ", so a disturbance decays." if size < 1 else ", so a disturbance grows or persists."
    )


def curve_caption(curve: dict) -> str:
    """Return the caption of a curve of steady motions: content, regimes, folds and gaps."""
    abscissa_name = curve_axis(curve)[1]
    parts = [regime for regime, _, _ in regime_stretches(curve)]
    count = np.asarray(curve["amplitude"]).size
    folds = len(curve.get("folds", ()))
    text = f"Half the peak-to-peak steady motion at the output against the {abscissa_name}, {count} points; "
    text += "colour and line style show the regime: " + ", ".join(dict.fromkeys(parts)) + "."
    if folds:
        text += f" The curve turns back at {folds} fold{'s' if folds > 1 else ''}."
    return text + (
        " Shaded: no bounded motion." if not np.all(np.isfinite(curve["amplitude"])) else ""
    )


def curve_charts(curve: dict) -> list:
    """Return charts of a curve of steady motions over frequency or level.

    They show the amplitude, with the regime as colour and line style and with the folds, and the
    largest acceleration with its first harmonic.
    """
    x_axis, abscissa_name, unit = curve_axis(curve)
    name, scale = choose_axis_unit(curve["amplitude"], "m")
    value = np.asarray(curve["amplitude"]) * scale
    parts = regime_stretches(curve)
    colours = dict(zip(dict.fromkeys(part[0] for part in parts), COLOURS * 9))
    is_unbounded = np.concatenate([[False], ~np.isfinite(value), [False]]).astype(int)
    marks = [
        make_mark(
            "span", "soft", left=x_axis[max(first - 1, 0)], right=x_axis[min(last, x_axis.size - 1)]
        )
        for first, last in np.flatnonzero(np.diff(is_unbounded)).reshape(-1, 2)
    ]
    for regime, first, last in parts:
        end = min(last + 1, x_axis.size)  # the stretches share a point, so that the line has no gap
        marks.append(
            make_line(
                x_axis[first:end],
                value[first:end],
                colours[regime],
                regime,
                dash="dashed" if "unstable" in regime else REGIMES.get(regime, "solid"),
            )
        )
    marks += [
        make_mark("rule", "soft", "fold", x=at if unit == "Hz" else at / G_N)
        for at in curve.get("folds", ())
    ]
    drawn_charts = [
        make_chart(
            "Steady motion at the output",
            make_axis(abscissa_name, unit),
            make_axis("half the peak-to-peak motion", name),
            marks,
        )
    ]
    if "acceleration_peak" in curve:
        lines = [
            make_line(
                x_axis, np.asarray(curve[f"acceleration_{key}"]) / G_N, colour, text, dash=dash
            )
            for key, colour, text, dash in (
                ("peak", "accent", "largest", "solid"),
                ("fundamental", "warm", "first harmonic", "dashed"),
            )
        ]
        drawn_charts.append(
            make_chart(
                "Absolute acceleration at the output",
                make_axis(abscissa_name, unit),
                make_axis("acceleration", "g"),
                lines,
            )
        )
    return drawn_charts


def spectra_charts(spectra, frequency: float | None) -> list:
    """Return charts of the spectral densities of output and drive signal, and of the magnitude of H1.

    Parameters
    ----------
    spectra : response.stationary.Spectra
    frequency : float or None
        Frequency [Hz] of the mode that was fitted to the peak of H1.
    """
    # Outside the frequency band of the drive, the spectrum contains only leakage.
    has_drive = np.isfinite(spectra.coherence)
    drawn_charts = []
    spectra = type(spectra)(*(column[has_drive] for column in spectra))
    hertz = spectra.frequency
    unit, scale = choose_axis_unit([float(np.sqrt(spectra.displacement.max(initial=0.0)))], "m")
    x_axis = make_axis("frequency", "Hz", True)
    drawn_charts.append(
        make_chart(
            "Displacement of the output",
            x_axis,
            make_axis("spectral density", f"{unit}^2/Hz", True),
            [_positive_line(hertz, spectra.displacement * scale**2, "accent")],
        )
    )
    drawn_charts.append(
        make_chart(
            "Acceleration of output and base",
            x_axis,
            make_axis("spectral density", "g^2/Hz", True),
            [
                _positive_line(hertz, spectra.acceleration / G_N**2, "accent", "output"),
                _positive_line(hertz, spectra.drive / G_N**2, "soft", "base"),
            ],
        )
    )
    gain = np.abs(spectra.gain) * G_N
    is_coherent = spectra.coherence >= MIN_COHERENCE
    unit, scale = choose_axis_unit([gain.max(initial=0.0)], "m")
    marks = [
        _positive_line(hertz, gain * scale, "soft"),
        _positive_line(hertz, np.where(is_coherent, gain * scale, np.nan), "accent", "H1"),
    ]
    if frequency is not None:
        peak_gain = float(np.interp(frequency, hertz, gain)) * scale
        marks.append(
            make_mark(
                "dots", "warm", "peak", x=[frequency], y=[peak_gain], errors=[0.0], shape="circle"
            )
        )
    drawn_charts.append(
        make_chart(
            "H1: displacement of the output divided by base acceleration",
            x_axis,
            make_axis("size", f"{unit}/g", True),
            marks,
        )
    )
    return drawn_charts


def _positive_line(x, y, colour: str, name: str = "") -> dict | None:
    """Return a chart line through the positive values, or None if there are none."""
    is_positive = np.isfinite(y) & (y > 0)
    return make_line(x[is_positive], y[is_positive], colour, name) if is_positive.any() else None


def decay_charts(decay) -> list:
    """Return charts of frequency and damping ratio of a release against its amplitude.

    decay: a `response.decay_curve.DecayCurve`, whose errors become bars.
    """
    unit, scale = choose_axis_unit(decay.amplitude, "m")
    drawn_charts = []
    for name, label, unit_of_value in (
        ("frequency", "frequency", "Hz"),
        ("damping", "damping ratio", ""),
    ):
        error = getattr(decay, f"{name}_error")
        y = getattr(decay, name)
        has_error = np.isfinite(error)
        x = decay.amplitude[has_error] * scale
        drawn_charts.append(
            make_chart(
                f"{label.capitalize()} of the decay",
                make_axis("half the peak-to-peak motion", unit, True),
                make_axis(label, unit_of_value),
                [
                    make_line(x, y[has_error], "accent"),
                    make_mark(
                        "dots",
                        "accent",
                        "",
                        x=x,
                        y=y[has_error],
                        errors=error[has_error],
                        shape="circle",
                    ),
                ]
                * bool(has_error.any()),
            )
        )
    return drawn_charts


def levels_chart(rows: list) -> list:
    """Return the chart of the amplitude after each drive level, with arrows in test order.

    The axis is logarithmic for more than three decades; a level without motion is then left out.

    Parameters
    ----------
    rows : list of dict
        drive [m s-2], or [N] if `unit` says so; stuck; values and errors by name, as in result.nc.
    """
    forced = rows[0].get("unit") == "N"
    drive = np.array([row["drive"] for row in rows]) / (1.0 if forced else G_N)
    amplitude = np.array([row["values"]["relative_displacement_amplitude"] for row in rows])
    name, scale = choose_axis_unit(amplitude, "m")
    error = (
        np.array([row["errors"].get("relative_displacement_amplitude") or 0.0 for row in rows])
        * scale
    )
    is_stuck = np.array([row["stuck"] for row in rows])
    y = amplitude * scale
    log = needs_log_scale(amplitude)
    is_drawn = y > 0 if log else np.isfinite(y)
    marks = []
    # On a logarithmic axis, error bars that would extend below 0 end at this value.
    style = {"floor": 0.1 * float(y[is_drawn].min())} if log else {}
    for k, (a, b) in enumerate(pairwise(drive)):
        is_raised = b >= a
        if is_drawn[k] and is_drawn[k + 1]:
            marks.append(
                make_mark(
                    "arrow",
                    "accent" if is_raised else "warm",
                    "raised" if is_raised else "lowered",
                    x=[a, b],
                    y=[y[k], y[k + 1]],
                    dash="solid" if is_raised else "dashed",
                    **style,
                )
            )
    for which, text, shape in (
        (is_drawn & ~is_stuck, "slips", "circle"),
        (is_drawn & is_stuck, "stuck", "square"),
    ):
        if which.any():
            marks.append(
                make_mark(
                    "dots",
                    "soft",
                    text,
                    x=drive[which],
                    y=y[which],
                    errors=error[which],
                    shape=shape,
                    **style,
                )
            )
    drive_axis = make_axis("force", "N") if forced else make_axis("base acceleration", "g")
    return [
        make_chart(
            "Level by level",
            drive_axis,
            make_axis("half the peak-to-peak motion", name, log),
            marks,
        )
    ]


def wear_charts(x, cycles, pressure, depth, history: dict) -> list:
    """Return charts of pressure and worn depth over x, and of measures over the cycles of wear.

    Parameters
    ----------
    x : (m,) array
        [m]
    cycles : (k,) array
        Cycles of the profiles.
    pressure, depth : (k, m) array
        [Pa], [m]
    history : dict
        Name -> (j,), with `cycle`; measures are divided by their first value.
    """
    (length_unit, size), drawn_charts = choose_axis_unit(x, "m"), []
    indices = np.unique(np.linspace(0, len(cycles) - 1, MAX_WEAR_PROFILES).round().astype(int))
    for values, unit, title in ((pressure, "Pa", "Pressure"), (depth, "m", "Worn depth")):
        name, scale = choose_axis_unit(values, unit)
        lines = [
            make_line(
                x * size,
                values[k] * scale,
                colour,
                "new" if cycles[k] == 0 else f"{format_number(cycles[k], 4)} cycles",
            )
            for k, colour in zip(indices, ("soft", *COLOURS))
        ]
        drawn_charts.append(
            make_chart(title, make_axis("x", length_unit), make_axis(title.lower(), name), lines)
        )
    drawn_charts[0]["y"]["range"] = [
        0.0,
        1.05 * float(np.max(pressure)) * choose_axis_unit(pressure, "Pa")[1],
    ]
    change_lines = [
        make_line(history["cycle"], history[name] / history[name][0], colour, text)
        for colour, (name, text) in zip(COLOURS, WEAR_LABELS.items())
        if history.get(name) is not None and history[name][0]
    ]
    return [
        *drawn_charts,
        make_chart(
            "Change with wear",
            make_axis("cycles"),
            make_axis("value divided by first value"),
            change_lines,
        ),
    ]
