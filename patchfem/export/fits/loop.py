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


def describe_loop_fit(fit: FittedLoop, folder: Path) -> FitFiles:
    """Return the output files of a fit to a measured friction loop.

    The paths in the fitted scene are relative to `folder`.
    """
    fit_data = _collect_fit_data(fit)
    rms_fraction = fit_data["rms"] / fit_data["peak"]
    head = (
        f"{fit_data['outcome']}: {fit_data['rows']} rows of {fit_data['measured']}, "
        f"{fit_data['evaluations']} evaluations"
    )
    rms = format_quantity(fit_data["rms"], fit_data["unit"], 4)
    details = [f"  rms of the residual   {rms}, {format_number(rms_fraction, 2)} of the peak"]
    if fit.loop.quantity == "force":
        work = np.trapezoid([fit.loop.reading, fit.model], fit.loop.displacement)
        measured, fitted = (format_quantity(value, "J", 4) for value in work)
        details.append(f"  work over the record   {measured} measured, {fitted} fitted")
    if fit_data["held"] is not None:
        held_out_score = fit_data["held"]
        rms = format_quantity(held_out_score["rms"], fit_data["unit"], 4)
        details.append(f"  rms of held-out rows   {rms} ({held_out_score['rows']} rows)")
    scene = fitted_scene_text(fit.keys, fit.loop.path.name, folder)
    return FitFiles(
        answer=fit_data,
        lines=[head, *format_values(fit_data), *details],
        summary=[head, *details],
        scenes={FITTED_SCENE: scene},
        rows=_csv_rows(fit),
        charts=_draw_charts(fit),
        caption="Measured and fitted values; on the right the residual of each row",
    )


def _collect_fit_data(loop_fit: FittedLoop) -> dict:
    """Return the contents of fit.json of a fit to a friction loop."""
    keys = loop_fit.keys
    loop = loop_fit.loop
    fit = keys.fit
    first = len(keys.ranges)
    offsets = {
        offset.name: describe_value(offset.range, fit, first + k)
        for k, offset in enumerate(loop_fit.offsets)
    }
    bounds = [*keys.ranges, *(offset.range for offset in loop_fit.offsets)]
    held_out_score = None
    if loop_fit.held_out_rms is not None:
        held_out_score = {"rows": int(loop_fit.held_out.sum()), "rms": loop_fit.held_out_rms}
    measured = loop.path.name
    return describe_measurement(keys.scene.title, measured, loop.quantity, keys.outcome) | {
        "values": describe_values(keys),
        "offsets": offsets,
        "unknown": describe_unknown(bounds, fit),
        "correlation": describe_correlation(fit),
        "unit": LABELS[loop.quantity][1],
        "rows": int((~loop_fit.held_out).sum()),
        "effective_rows": None if np.isnan(fit.intervals.rows) else fit.intervals.rows,
        "rms": loop_fit.rms,
        "held": held_out_score,
        "peak": float(np.abs(loop.reading).max()),
        "step_error": loop_fit.step_error,
        "steps_between_rows": loop_fit.steps_per_row,
        "evaluations": fit.counts.evaluations,
        "failures": fit.counts.failures,
        "descents_agreed": fit.agreed,
        "warnings": keys.warnings,
        "seconds": round(keys.seconds, 6),
    }


def _csv_rows(fit: FittedLoop) -> list:
    """Return the rows of fit.csv of a fit to a friction loop, in SI units.

    The file can be the measurement of another fit.
    """
    loop = fit.loop
    unit = LABELS[loop.quantity][1]
    head = ["displacement [m]", f"{loop.quantity} [{unit}]", "fitted", "held"]
    columns = [loop.displacement, loop.reading, fit.model]
    if loop.time is not None:
        head.insert(0, "time [s]")
        columns.insert(0, loop.time)
    rows = zip(*(column.tolist() for column in columns))
    is_held_out = fit.held_out.tolist()
    return [head, *([*map(repr, row), int(out)] for row, out in zip(rows, is_held_out))]


def _draw_charts(fit: FittedLoop) -> list:
    """Draw a measured and a fitted friction loop, and the residual at each row of the measurement."""
    loop = fit.loop
    name, unit = LABELS[loop.quantity]
    slide_unit, slide_scale = choose_axis_unit(loop.displacement, "m")
    reading_unit, scale = choose_axis_unit(loop.reading, "N") if unit == "N" else ("1", 1.0)
    number = np.arange(loop.reading.size)
    slide = loop.displacement * slide_scale
    reading = loop.reading * scale
    residual = (fit.model - loop.reading) * scale
    over_slide = []
    over_rows = [charts.make_line(number[[0, -1]], [0.0, 0.0], "soft", width=0.8)]
    groups = (
        (~fit.held_out, "soft", "measured"),
        (fit.held_out, "warm", "measured, held out"),
    )
    for rows, colour, text in groups:
        if rows.any():
            over_slide.append(
                charts.make_dots(slide[rows], reading[rows], colour, text, size=DOT_SIZE)
            )
            over_rows.append(charts.make_dots(number[rows], residual[rows], colour, size=DOT_SIZE))
    over_slide.append(charts.make_line(slide, fit.model * scale, "accent", "fitted", width=1.0))
    return [
        charts.make_chart(
            "Measured and fitted",
            charts.make_axis("slide", slide_unit),
            charts.make_axis(name, reading_unit),
            over_slide,
        ),
        charts.make_chart(
            "Residual",
            charts.make_axis("row"),
            charts.make_axis("fitted - measured", reading_unit),
            over_rows,
        ),
    ]
