"""Picture of the accuracy of a run against its computing time, and the sentences below it."""

from ...formatting import format_number
from ...runs.accuracy_curve import STEPS_KEY, AccuracyCurve, StepSetting
from . import charts

# Factor by which a logarithmic axis extends beyond its smallest and its largest value.
AXIS_ROOM = 1.6
CAUSES = {
    "mesh": "the mesh of the pieces",
    "modes": "the modes that are left out",
    "bonds": "the sum over bonds",
    "cells": "the cells of the friction law",
    "end": "the end of the run, which is not exactly at the requested time",
}


def accuracy_charts(curve: AccuracyCurve) -> list:
    """Return the chart of the largest error against CPU seconds, which marks the run and its neighbours."""
    settings = [*curve.coarser[::-1], curve.present]
    marks = [_make_line(settings, "solid")]
    if curve.finer is not None:
        marks.append(_make_line([curve.present, curve.finer], "dashed"))
    marks.append(_make_dots(curve.coarser, "soft", "fewer steps per cycle", "square"))
    if curve.finer is not None:
        marks.append(_make_dots([curve.finer], "warm", "twice the steps (expected)", "square"))
    marks.append(_make_dots([curve.present], "accent", "this run", "circle"))
    all_settings = [*settings, *([curve.finer] if curve.finer is not None else [])]
    seconds = [setting.seconds for setting in all_settings]
    errors = [setting.error for setting in all_settings] + [curve.tolerance]
    ends = _axis_range(seconds)
    limit = f"tolerance {format_number(curve.tolerance, 2)}"
    marks.append(charts.make_line(ends, 2 * [curve.tolerance], "soft", limit, dash="dotted"))
    x_axis = charts.make_axis("CPU seconds of the motion", "", True) | {"range": ends}
    y_axis = charts.make_axis("error of the worst main measure", "", True)
    y_axis["range"] = _axis_range(errors)
    return [charts.make_chart("What accuracy costs", x_axis, y_axis, marks)]


def accuracy_caption(curve: AccuracyCurve) -> str:
    """Return the sentences that name the run, the next cheaper and the next better setting."""
    cheaper = curve.coarser[0]
    sentences = [
        "Worst error of the main measures of the motion, as the tolerance that would allow it (a warning names other "
        "measures that miss the tolerance), against "
        "the CPU time of the motion alone, without pieces, error estimates and files. The error of a "
        "coarser run is its distance from this run plus the error of this run.",
        f"This run: {curve.present.steps} steps per cycle, {_describe(curve.present)}.",
        f"Next cheaper: {STEPS_KEY} = {cheaper.steps}, {_describe(cheaper)}.",
    ]
    if curve.finer is not None:
        sentences.append(
            f"Next better: {STEPS_KEY} = {curve.finer.steps}, expected {_describe(curve.finer)}."
        )
    else:
        cause = CAUSES.get(curve.cause, "other causes than the steps")
        sentences.append(
            f"Twice the steps would hardly reduce the worst error: that of {curve.limiting_measure} "
            f"would remain, mainly because of {cause}."
        )
    sentences.append(
        "`patchfem cost SCENE` measures the time and errors of whole runs at several tolerances."
    )
    return " ".join(sentences)


def _describe(setting: StepSetting) -> str:
    """Return a text that states the error of a setting, the measure with this error, and the CPU seconds."""
    error = format_number(setting.error, 2)
    return f"{error} ({setting.measure}) in {format_number(setting.seconds, 2)} s"


def _make_line(settings: list, dash: str) -> dict:
    """Return the chart line that connects several settings."""
    x, y = _coordinates(settings)
    return charts.make_line(x, y, "accent", dash=dash, width=1.0)


def _make_dots(settings: list, colour: str, name: str, shape: str) -> dict:
    """Return the chart points of several settings."""
    return charts.make_dots(*_coordinates(settings), colour, name, shape=shape, size=8)


def _coordinates(settings: list) -> tuple:
    """Return the CPU times [s] and the errors of runs with several settings."""
    seconds = [setting.seconds for setting in settings]
    errors = [setting.error for setting in settings]
    return seconds, errors


def _axis_range(values: list) -> list:
    """Return both ends of a logarithmic axis that contains given values."""
    return [min(values) / AXIS_ROOM, max(values) * AXIS_ROOM]
