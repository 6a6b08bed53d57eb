"""Files of a fit to a friction loop."""

from pathlib import Path

import numpy as np

from ...campaigns.fits.loop import FittedLoop
from ...formatting import choose_axis_unit, format_number, format_quantity
from ..drawing import charts
from .files import (
    FITTED_SCENE,
    FitFiles,
    describe_correlation,
    describe_measurement,
    describe_unknown,
    describe_value,
    describe_values,
    fitted_scene_text,
)
from .text import format_values

LABELS = {"force": ("force", "N"), "friction_ratio": ("friction ratio", "1")}
DOT_SIZE = 3.5  # Diameter of a measured row in the picture [points].


def describe_loop_fit(fitted: FittedLoop, folder: Path) -> FitFiles:
    """Return the files of a fit to a loop.

    folder: the paths in the fitted scene are relative to it.
    """
    answer = _fit_json(fitted)
    share = answer["rms"] / answer["peak"]
    head = (
        f"{answer['outcome']}: {answer['rows']} rows of {answer['measured']}, "
        f"{answer['evaluations']} evaluations"
    )
    rms = format_quantity(answer["rms"], answer["unit"], 4)
    rest = [f"  rms of the residual   {rms}, {format_number(share, 2)} of the peak"]
    if answer["held"] is not None:
        held = answer["held"]
        rms = format_quantity(held["rms"], answer["unit"], 4)
        rest.append(f"  rms of held-out rows   {rms} ({held['rows']} rows)")
    scene = fitted_scene_text(fitted.keys, fitted.loop.path.name, folder)
    return FitFiles(
        answer=answer,
        lines=[head, *format_values(answer), *rest],
        summary=[head, *rest],
        scenes={FITTED_SCENE: scene},
        rows=_csv_rows(fitted),
        charts=_draw_charts(fitted),
        caption="Measured and fitted values; on the right the residual of each row",
    )


def _fit_json(fitted: FittedLoop) -> dict:
    """Return the object of fit.json."""
    keys = fitted.keys
    loop = fitted.loop
    found = keys.fit
    first = len(keys.ranges)
    offsets = {
        offset.name: describe_value(offset.range, found, first + k)
        for k, offset in enumerate(fitted.offsets)
    }
    bounds = [*keys.ranges, *(offset.range for offset in fitted.offsets)]
    held = None
    if fitted.held_rms is not None:
        held = {"rows": int(fitted.held_out.sum()), "rms": fitted.held_rms}
    measured = loop.path.name
    return describe_measurement(keys.scene.title, measured, loop.quantity, keys.outcome) | {
        "values": describe_values(keys),
        "offsets": offsets,
        "unknown": describe_unknown(bounds, found),
        "correlation": describe_correlation(found),
        "unit": LABELS[loop.quantity][1],
        "rows": int((~fitted.held_out).sum()),
        "effective_rows": None if np.isnan(found.intervals.rows) else found.intervals.rows,
        "rms": fitted.rms,
        "held": held,
        "peak": float(np.abs(loop.reading).max()),
        "step_error": fitted.step_error,
        "steps_between_rows": fitted.pieces,
        "evaluations": found.counts.evaluations,
        "failures": found.counts.failures,
        "descents_agreed": found.agreed,
        "warnings": keys.warnings,
        "seconds": round(keys.seconds, 6),
    }


def _csv_rows(fitted: FittedLoop) -> list:
    """Return the rows of fit.csv in SI units, which can be used as input of another fit."""
    loop = fitted.loop
    unit = LABELS[loop.quantity][1]
    head = ["displacement [m]", f"{loop.quantity} [{unit}]", "fitted", "held"]
    columns = [loop.displacement, loop.reading, fitted.model]
    if loop.time is not None:
        head.insert(0, "time [s]")
        columns.insert(0, loop.time)
    rows = zip(*(column.tolist() for column in columns))
    held = fitted.held_out.tolist()
    return [head, *([*map(repr, row), int(out)] for row, out in zip(rows, held))]


def _draw_charts(fitted: FittedLoop) -> list:
    """Return charts of the reading against displacement, and of the residual of each row."""
    loop = fitted.loop
    name, unit = LABELS[loop.quantity]
    along, size = choose_axis_unit(loop.displacement, "m")
    up, scale = choose_axis_unit(loop.reading, "N") if unit == "N" else ("1", 1.0)
    number = np.arange(loop.reading.size)
    slide = loop.displacement * size
    reading = loop.reading * scale
    residual = (fitted.model - loop.reading) * scale
    over_slide = []
    over_rows = [charts.make_line(number[[0, -1]], [0.0, 0.0], "soft", width=0.8)]
    groups = (
        (~fitted.held_out, "soft", "measured"),
        (fitted.held_out, "warm", "measured, held out"),
    )
    for rows, colour, text in groups:
        if rows.any():
            over_slide.append(
                charts.make_dots(slide[rows], reading[rows], colour, text, size=DOT_SIZE)
            )
            over_rows.append(charts.make_dots(number[rows], residual[rows], colour, size=DOT_SIZE))
    over_slide.append(charts.make_line(slide, fitted.model * scale, "accent", "fitted", width=1.0))
    return [
        charts.make_chart(
            "Measured and fitted",
            charts.make_axis("slide", along),
            charts.make_axis(name, up),
            over_slide,
        ),
        charts.make_chart(
            "Residual",
            charts.make_axis("row"),
            charts.make_axis("fitted - measured", up),
            over_rows,
        ),
    ]
