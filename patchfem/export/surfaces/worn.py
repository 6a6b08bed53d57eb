"""Wear between two runs as lines of text, as a dict and as a page."""

from html import escape
from pathlib import Path

import numpy as np

from ... import __version__
from ...disk.atomic_write import write_text
from ...formatting import choose_axis_unit, format_length
from ...surface.quantity import LEVEL, Quantity
from ..drawing.charts import loop_chart, make_axis, make_chart, make_line, make_mark
from ..drawing.pictures import draw_charts
from ..pages.document import Section, figure_html, table_html
from ..pages.sentences import format_with_error
from ..written import measure_label
from .compare import QUANTITY_LABELS, SIDES, TABLE_HEADS, SurfacePage, sides_lines
from .pictures import GREY, Picture, PressedSide, depth_axis, draw_maps, draw_pressures
from .pictures import SIDES as SIDE_COLOURS
from .quantities import MISSING, QuantityTable, Row, format_quantity, quantity_data
from .worn_runs import Wear, hidden_depths, hidden_line

MEASURES = (
    "pressure_peak",
    "contact_fraction",
    "normal_stiffness",
    "tangential_stiffness",
    "approach",
    "rotation",
    "groove_amplitude",
    "slip_amplitude",
    "relative_displacement_amplitude",
    "loop_area",
    "friction_force_peak",
)
HEADLINE_MEASURES = ("contact_fraction", "pressure_peak", "loop_area")
# Worn fraction of the area above which the headline does not name a worn part.
MAX_PARTIAL_WEAR = 0.999
# Ratio of hidden wear to mean depth above which the headline states the hidden wear.
MIN_HIDDEN_RATIO = 0.01
# Ratio of the smallest to the largest hidden depth above which the wear is called uniform.
EVEN_RATIO = 0.8
# Ratio of the smallest to the largest hidden depth below which the wear is called a wedge.
WEDGE_RATIO = 0.2
RUN_LABELS = QUANTITY_LABELS | {
    "from": "worn part from",
    "to": "worn part to",
    "depth_mean": "worn part, mean",
    "depth_floor": "worn part, floor",
    "worn_share": "fraction of the patch area that is worn",
    "hidden_wear": "uniform wear and wedge, mean",
}


def wear_verdict(wear: Wear) -> tuple:
    """Return the headline and the sentences of a comparison of two runs."""
    mean = wear.values["worn_depth_mean"]
    if not mean.value > 0:
        return "nothing wore off between the two runs", []
    after = wear.after
    headline = f"worn by {format_length(mean.value, 3)} on average over the patch"
    hidden = wear.values["hidden_wear"]
    ends = hidden_depths(after.surface, wear.depth)
    measurement = "trace" if after.surface.y is None else "scan"
    if wear.track and wear.values["worn_share"].value < MAX_PARTIAL_WEAR:
        start, end, hidden, mean = (
            wear.track[name] for name in ("from", "to", "hidden_wear", "depth_mean")
        )
        x = after.surface.x
        inside = (x >= start.value) & (x <= end.value)
        ends = hidden_line(x[inside], wear.depth[inside])
        measurement = "trace within this part"
        extent = f"from x = {format_length(start.value, 3)} to {format_length(end.value, 3)}"
        headline += f", and by {format_length(mean.value, 3)} on average {extent}"
    if hidden.value > MIN_HIDDEN_RATIO * mean.value:
        headline += (
            f"; of the {format_length(mean.value, 3)}, {format_length(hidden.value, 3)} is "
            f"{describe_hidden_wear(ends)} that a {measurement} alone could not show"
        )
    volume = format_quantity(wear.values["worn_volume"]).short
    place = after.describe_position(np.argmax(wear.depth))
    cycles = f"after {after.cycles:.6g} cycles of wear"
    start = after.run.resolved["wear"].get("start")
    if start:
        cycles += f" after those of {start}"
    if wear.before.cycles:
        cycles += f" (the surface before: {wear.before.cycles:.6g} cycles)"
    sentences = [
        f"Worn volume of both pieces together: {volume}; largest worn depth: "
        f"{format_length(float(wear.depth.max()), 3)}, {place}; {cycles}."
    ]
    for name in HEADLINE_MEASURES:
        measures = [run.measure(name) for run in (wear.before, after)]
        if None not in measures:
            first, second = (format_with_error(name, measure) for measure in measures)
            sentences.append(f"{measure_label(name)}: {first} before, {second} after.")
    return headline, sentences


def describe_hidden_wear(ends: tuple) -> str:
    """Return the name of a shape of wear, given the depths [m] at the ends or corners of a patch."""
    low = min(ends)
    high = max(ends)
    if low < WEDGE_RATIO * high:
        return "a wedge"
    return "uniform wear" if low > EVEN_RATIO * high else "uniform wear with a wedge"


def wear_data(wear: Wear, verdict: tuple) -> dict:
    """Return the comparison of two runs as a dict, in SI units.

    The names are those of a comparison of traces. verdict: result of `wear_verdict`.
    """
    zero = Quantity(
        0.0, 0.0, 0.0, "m", "positions are known, because both runs are of the same patch"
    )
    runs = {}
    for when, run in zip(SIDES, (wear.before, wear.after)):
        measures = {}
        for name in MEASURES:
            measure = run.measure(name)
            if measure is not None:
                measures[name] = {key: measure[key] for key in ("value", "error", "unit")}
        runs[when] = {
            "outcome": run.run.summary["outcome"],
            "cycles": run.cycles,
            "measures": measures,
        }
    return {
        "patchfem": __version__,
        "verdict": verdict[0],
        "sentences": verdict[1],
        "confidence": LEVEL,
        "before": wear.before.path,
        "after": wear.after.path,
        "direction": "x",
        "reference": "run",
        "shift": quantity_data(zero),
        **{name: quantity_data(quantity) for name, quantity in wear.values.items()},
        "registration": {"shift": quantity_data(zero), "mirrored": False},
        "track": {name: quantity_data(quantity) for name, quantity in wear.track.items()} or None,
        "removed": {"before": 0, "after": 0},
        "runs": runs,
        "notes": wear.notes,
    }


def _wear_table(wear: Wear) -> QuantityTable:
    """Return the table of quantities of a comparison of two runs."""
    quantities = [(RUN_LABELS[name], quantity) for name, quantity in wear.values.items()]
    for name in ("from", "to", "depth_mean", "depth_floor", "hidden_wear"):
        if name in wear.track:
            words = (
                "uniform and wedge-shaped wear, in the worn part"
                if name == "hidden_wear"
                else RUN_LABELS[name]
            )
            quantities.append((words, wear.track[name]))
    rows = []
    for words, quantity in quantities:
        meaning = f"{quantity.text}: {quantity.reason}" if quantity.reason else quantity.text
        rows.append(Row(words, quantity, meaning=meaning))
    return QuantityTable(TABLE_HEADS, rows)


def _measure_rows(wear: Wear) -> list:
    """Return the measures of two runs as rows: name, text before and text after."""
    rows = []
    for name in MEASURES:
        measures = [run.measure(name) for run in (wear.before, wear.after)]
        if any(measures):
            rows.append(
                (
                    measure_label(name),
                    *(
                        MISSING if measure is None else format_with_error(name, measure)
                        for measure in measures
                    ),
                )
            )
    return rows


def format_wear(wear: Wear, verdict: tuple) -> list:
    """Return the comparison of two runs as lines of text.

    verdict: result of `wear_verdict`.
    """
    out = [
        verdict[0],
        *(f"  {text}" for text in verdict[1]),
        "",
        f"{wear.before.path} -> {wear.after.path}",
    ]
    return [*out, *_wear_table(wear).lines(), "", *sides_lines(_measure_rows(wear))]


def write_page(path: Path, wear: Wear, verdict: tuple) -> None:
    """Write the HTML page of a comparison of two runs.

    Parameters
    ----------
    path : Path
    wear : Wear
    verdict : tuple
        Result of `wear_verdict`.
    """
    both_runs = (wear.before, wear.after)
    body = [figure_html(number, *picture) for number, picture in enumerate(_draw_pictures(wear))]
    body.append(_wear_table(wear).html())
    body.append(
        "<p class=soft>The intervals follow from the numerical errors that the runs state. In 19 "
        "of 20 scenes the stated error is at least as large as the true error.</p>"
    )
    caption = "Normal stress of the pressed patch"
    if wear.after.surface.y is not None:
        caption += ", mean over the width"
    drawn = draw_pressures(
        [PressedSide(run.surface.x, run.pressure, name) for run, name in zip(both_runs, SIDES)]
    )
    runs = [figure_html("p", drawn, f"{caption}.", "Pressure along the patch before and after")]
    if all(run.loop is not None for run in both_runs):
        loops = []
        for run, name in zip(both_runs, SIDES):
            loops += loop_chart(*run.loop, f"Friction loop {name}")
        caption = "Friction force over the slide in the last cycle."
        runs.append(
            figure_html(
                "l", draw_charts(loops, height=2.9), caption, "Friction loops before and after"
            )
        )
    rows = [[escape(text) for text in row] for row in _measure_rows(wear)]
    runs.append(table_html(("measure", ">before", ">after"), rows))
    sections = [
        Section("changes", "What wore off", "\n".join(body)),
        Section("runs", "Pressure, contact and loop", "\n".join(runs)),
    ]
    names = [Path(run.path).resolve().name for run in both_runs]
    write_text(path, SurfacePage(f"{names[0]} and {names[1]}", verdict, wear.notes).html(sections))


def _draw_pictures(wear: Wear) -> list:
    """Draw the gaps before and after wear, and the worn depth."""
    surface = wear.after.surface
    mean = f"mean {format_length(wear.values['worn_depth_mean'].value, 3)}"
    if surface.y is not None:
        return [
            Picture(
                draw_maps(surface.x, surface.y, (*wear.gaps, wear.depth)),
                "Left and middle: gap between the unloaded surfaces before and after, wear "
                "included. Right: depth lost by both pieces together between the two runs. The "
                "values of a strip stand at the middle of its width.",
                f"Maps of the gaps and of the worn depth: {mean}",
            )
        ]
    gaps = Picture(
        _draw_gaps(surface.x, wear.gaps),
        "The gap between the unloaded surfaces includes the wear.",
        "Gap of the surfaces before and after",
    )
    depth = Picture(
        _draw_worn_depth(surface.x, wear.depth),
        "The curve is the depth lost by both pieces together between the two runs. The dashed line "
        "is the part of this depth that a trace alone could not show.",
        f"Worn depth: {mean}",
    )
    return [gaps, depth]


def _position_axis(x) -> tuple[dict, float]:
    """Return the axis of positions along the patch, and the scale of its unit."""
    unit, scale = choose_axis_unit(x, "m")
    return make_axis("x", unit) | {"range": [x[0] * scale, x[-1] * scale]}, scale


def _draw_gaps(x, gaps: tuple) -> str:
    """Draw the gaps of the unloaded surfaces before and after."""
    place, mm = _position_axis(x)
    up, um = choose_axis_unit(np.concatenate(gaps), "m")
    marks = [
        make_line(x * mm, gap * um, colour, name) for gap, (colour, name) in zip(gaps, SIDE_COLOURS)
    ]
    marks.append(
        make_mark("band", "warm", "worn off", x=x * mm, low=gaps[0] * um, high=gaps[1] * um)
    )
    return draw_charts(
        [make_chart("", place, make_axis("gap of the unloaded surfaces", up), marks)], height=2.9
    )


def _draw_worn_depth(x, depth) -> str:
    """Draw the worn depth, with the wear that a single trace could not show."""
    place, mm = _position_axis(x)
    hidden = np.array(hidden_line(x, depth))
    unit, scale = choose_axis_unit(depth, "m")
    marks = [
        make_line(x * mm, depth * scale, "warm", "worn depth"),
        make_line(
            x[[0, -1]] * mm,
            hidden * scale,
            GREY,
            "uniform wear and wedge",
            width=0.9,
            dash="dashed",
        ),
    ]
    down = depth_axis(unit, [*hidden, 0.0, float(depth.max()), float(depth.min())], scale)
    return draw_charts([make_chart("", place, down, marks)], height=2.5)
