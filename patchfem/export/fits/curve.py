"""Files of a fit to frequency and damping against amplitude."""

from pathlib import Path

import numpy as np

from ...campaigns.fits.curve import FittedCurve
from ...formatting import choose_axis_unit
from ..drawing import charts
from .files import (
    FITTED_SCENE,
    FitFiles,
    describe_measurement,
    describe_values,
    fitted_scene_text,
)
from .text import format_values

CSV_HEADERS = (
    "amplitude [m]",
    "frequency [Hz]",
    "frequency_error [Hz]",
    "damping",
    "damping_error",
    "frequency_fitted [Hz]",
    "damping_fitted",
)


def describe_curve_fit(fit: FittedCurve, folder: Path) -> FitFiles:
    """Return the output files of a fit to measured frequency and damping as functions of amplitude.

    The paths in the fitted scene are relative to `folder`.
    """
    fit_data = _collect_fit_data(fit)
    rms = fit_data["rms"]
    head = (
        f"{fit_data['outcome']}: {fit_data['rows']} amplitudes of {fit_data['measured']} by "
        f"{fit_data['method']}, {fit_data['evaluations']} curves of the model computed"
    )
    details = [
        f"  rms of the residual   {100 * rms['frequency']:.2g} % of the frequency, "
        f"{100 * rms['damping']:.2g} % of the damping ratio",
        *(f"  note: {text}" for text in fit_data["notes"]),
    ]
    scene = fitted_scene_text(fit.keys, fit.path.name, folder)
    return FitFiles(
        answer=fit_data,
        lines=[head, *format_values(fit_data), *details],
        summary=[head, *details],
        scenes={FITTED_SCENE: scene},
        rows=_csv_rows(fit),
        charts=_draw_charts(fit),
        caption="Frequency and damping ratio against amplitude: measured values with "
        f"{'assumed errors' if fit.measured.assumed else 'errors'}, and the fit",
    )


def _collect_fit_data(fit: FittedCurve) -> dict:
    """Return the contents of fit.json for a fit to a frequency and damping curve."""
    keys = fit.keys
    measured = fit.measured
    deviation = (fit.model - measured.value) / np.abs(measured.value)
    frequency_rms, damping_rms = np.sqrt(np.mean(deviation**2, axis=1)).tolist()
    name = fit.path.name
    return describe_measurement(keys.scene.title, name, "decay", keys.outcome) | {
        "method": fit.method,
        "rows": int(measured.amplitude.size),
        "values": describe_values(keys),
        "rms": {"frequency": frequency_rms, "damping": damping_rms},
        "evaluations": fit.n_computed,
        "failures": keys.fit.counts.failures,
        "descents_agreed": keys.fit.agreed,
        "warnings": keys.warnings,
        "notes": list(fit.notes),
        "seconds": round(keys.seconds, 6),
    }


def _csv_rows(fit: FittedCurve) -> list:
    """Return the rows of fit.csv for a fit to a frequency and damping curve.

    Errors are half the width of a 95 % interval.
    """
    measured = fit.measured
    errors = 2 * measured.error
    columns = np.column_stack(
        [
            measured.amplitude,
            measured.value[0],
            errors[0],
            measured.value[1],
            errors[1],
            *fit.model,
        ]
    )
    return [CSV_HEADERS, *([*map(repr, row)] for row in columns.tolist())]


def _draw_charts(curve_fit: FittedCurve) -> list:
    """Draw measured and fitted frequency and damping ratio against amplitude."""
    measured = curve_fit.measured
    unit, scale = choose_axis_unit(measured.amplitude, "m")
    x_axis = charts.make_axis("amplitude", unit, True)
    x = measured.amplitude * scale
    drawn_charts = []
    for k, (title, name, value_unit) in enumerate(
        (("Frequency", "frequency", "Hz"), ("Damping ratio", "damping ratio", ""))
    ):
        errors = 2 * measured.error[k]
        dots = charts.make_dots(x, measured.value[k], "soft", "measured", errors=errors)
        fit = charts.make_line(x, curve_fit.model[k], "accent", "fitted")
        drawn_charts.append(
            charts.make_chart(title, x_axis, charts.make_axis(name, value_unit), [dots, fit])
        )
    return drawn_charts
