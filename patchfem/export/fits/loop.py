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
DOT_SIZE = 3.5  # diameter of the dots of measured rows in fit.svg [points]


def describe_loop_fit(fitted: FittedLoop, folder: Path) -> FitFiles:
    """Collect the files of a fit to a measured friction loop.

    The paths in the fitted scene are relative to `folder`.
    """
    fit_data = _collect_fit_data(fitted)
    rms_fraction = fit_data["rms"] / fit_data["peak"]
    head = (
        f"{fit_data['outcome']}: {fit_data['rows']} rows of {fit_data['measured']}, "
        f"{fit_data['evaluations']} evaluations"
    )
    rms = format_quantity(fit_data["rms"], fit_data["unit"], 4)
    details = [f"  rms of the residual   {rms}, {format_number(rms_fraction, 2)} of the peak"]
    if fit_data["held"] is not None:
        held_out_score = fit_data["held"]
        rms = format_quantity(held_out_score["rms"], fit_data["unit"], 4)
        details.append(f"  rms of held-out rows   {rms} ({held_out_score['rows']} rows)")
    scene = fitted_scene_text(fitted.keys, fitted.loop.path.name, folder)
    return FitFiles(
        answer=fit_data,
        lines=[head, *format_values(fit_data), *details],
        summary=[head, *details],
        scenes={FITTED_SCENE: scene},
        rows=_csv_rows(fitted),
        charts=_draw_charts(fitted),
        caption="Measured and fitted values; on the right the residual of each row",
    )


def _collect_fit_data(fitted: FittedLoop) -> dict:
    """Return the contents of fit.json of a fit to a friction loop."""
    keys = fitted.keys
    loop = fitted.loop
    fit = keys.fit
    first = len(keys.ranges)
    offsets = {
        offset.name: describe_value(offset.range, fit, first + k)
        for k, offset in enumerate(fitted.offsets)
    }
    bounds = [*keys.ranges, *(offset.range for offset in fitted.offsets)]
    held_out_score = None
    if fitted.held_rms is not None:
        held_out_score = {"rows": int(fitted.held_out.sum()), "rms": fitted.held_rms}
    measured = loop.path.name
    return describe_measurement(keys.scene.title, measured, loop.quantity, keys.outcome) | {
        "values": describe_values(keys),
        "offsets": offsets,
        "unknown": describe_unknown(bounds, fit),
        "correlation": describe_correlation(fit),
        "unit": LABELS[loop.quantity][1],
        "rows": int((~fitted.held_out).sum()),
        "effective_rows": None if np.isnan(fit.intervals.rows) else fit.intervals.rows,
        "rms": fitted.rms,
        "held": held_out_score,
        "peak": float(np.abs(loop.reading).max()),
        "step_error": fitted.step_error,
        "steps_between_rows": fitted.pieces,
        "evaluations": fit.counts.evaluations,
        "failures": fit.counts.failures,
        "descents_agreed": fit.agreed,
        "warnings": keys.warnings,
        "seconds": round(keys.seconds, 6),
    }


def _csv_rows(fitted: FittedLoop) -> list:
    """Return the rows of fit.csv of a fit to a friction loop, in SI units.

    The file can be the measurement of another fit.
    """
    loop = fitted.loop
    unit = LABELS[loop.quantity][1]
    head = ["displacement [m]", f"{loop.quantity} [{unit}]", "fitted", "held"]
    columns = [loop.displacement, loop.reading, fitted.model]
    if loop.time is not None:
        head.insert(0, "time [s]")
        columns.insert(0, loop.time)
    rows = zip(*(column.tolist() for column in columns))
    is_held_out = fitted.held_out.tolist()
    return [head, *([*map(repr, row), int(out)] for row, out in zip(rows, is_held_out))]


def _draw_charts(fitted: FittedLoop) -> list:
    """Chart a measured and fitted friction loop, and the residual of each row."""
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
