"""A fitted decay on disk: its object, rows, and the fitted scene, which runs."""

import numpy as np

from .. import __version__
from ..campaigns.fit_decay import FittedDecay
from ..disk.whole import write_rows, write_text
from ..scales import axis_unit
from ..scene.scene import loads
from . import fit_folder
from .drawing.pictures import BLUE, GREY, drawing, styled
from .fit import line_of
from .results import Folder
from .summary import write_json

HEAD = ("amplitude [m]", "frequency [Hz]", "frequency_error [Hz]", "damping", "damping_error",
        "frequency_fitted [Hz]", "damping_fitted")


def answer_of(fitted: FittedDecay) -> dict:
    """The object of fit.json, in SI."""
    found = fitted.found
    off = (fitted.model - fitted.measured) / np.abs(fitted.measured)
    rms = np.sqrt(np.mean(off**2, axis=1)).tolist()
    return {"patchfem": __version__, "title": fitted.scene.title, "measured": fitted.path.name, "quantity": "decay",
            "outcome": str(fitted.outcome), "method": fitted.method, "rows": int(fitted.amplitude.size),
            "values": {one.key: fit_folder.value_of(one, found, k) for k, one in enumerate(fitted.free)},
            "rms": {"frequency": rms[0], "damping": rms[1]}, "evaluations": found.evaluations,
            "failures": found.failures, "descents_agreed": found.agreed, "warnings": fitted.warnings,
            "notes": list(fitted.notes), "seconds": round(fitted.seconds, 6)}


def fit_into(fitted: FittedDecay, folder: Folder) -> dict:
    """Write fit.json, fit.csv, fit.svg and scene.fitted.toml into an open results folder, and return the object of
    fit.json."""
    answer = answer_of(fitted)
    whole = loads(fitted.scene.text, fitted.scene.path, [*fitted.scene.sets, *fitted.sets])
    write_json(answer, folder.path / "fit.json")
    text = fit_folder.scene_text(whole, fitted.free, fitted.found, fitted.path, folder.target)
    write_text(folder.path / "scene.fitted.toml", text)
    rows = zip(fitted.amplitude, fitted.measured[0], 2 * fitted.error[0], fitted.measured[1], 2 * fitted.error[1],
               *fitted.model)
    write_text(folder.path / "fit.svg", draw(fitted))
    write_rows(folder.path / "fit.csv", [HEAD, *([repr(float(one)) for one in row] for row in rows)])
    return answer


@styled
def draw(fitted: FittedDecay):
    """Draw frequency and damping ratio over the amplitude, measured with errors and fitted, as SVG text."""
    figure, axes = drawing(2, 3.6)
    along, size = axis_unit(fitted.amplitude, "m")
    for k, (axis, name) in enumerate(zip(axes, ("frequency [Hz]", "damping ratio"))):
        axis.errorbar(fitted.amplitude * size, fitted.measured[k], 2 * fitted.error[k], fmt=".", color=GREY, ms=5,
                      lw=0.8, label="measured")
        axis.plot(fitted.amplitude * size, fitted.model[k], color=BLUE, lw=1.2, label="fitted")
        axis.set(xlabel=f"amplitude [{along}]", ylabel=name, xscale="log")
    axes[0].legend(frameon=False)
    return figure


def lines_of(answer: dict) -> list:
    """The answer as lines of text: one per value with its interval, then what is left over."""
    rms = answer["rms"]
    return [f"{answer['outcome']}: {answer['rows']} amplitudes of {answer['measured']} by {answer['method']}, "
            f"{answer['evaluations']} evaluations",
            *(line_of(f"{key:<26}", one) for key, one in answer["values"].items()),
            f"  rms of the residual   {100 * rms['frequency']:.2g} % of the frequency, {100 * rms['damping']:.2g} % of "
            "the damping ratio",
            *(f"  note: {text}" for text in answer["notes"])]
