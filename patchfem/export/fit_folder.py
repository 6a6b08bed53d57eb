"""A fit on disk: its object, rows, picture, and the fitted scene, which runs."""

from pathlib import Path

import numpy as np

from .. import __version__
from ..campaigns.fit import Fitted
from ..disk.whole import write_text
from ..identify.least_squares import Fit
from ..model.model import build, resolved
from ..scene.ranges import Range
from ..scene.scene import loads, moved
from .fit import draw, write_rows
from .results import Folder
from .summary import write_json


def fitted_scene(fitted: Fitted, folder: Path) -> str:
    """The fitted scene in SI with every default, its paths relative to `folder`; a comment says what was fitted."""
    whole = loads(fitted.scene.text, fitted.scene.path, [*fitted.scene.sets, *fitted.sets])
    return scene_text(whole, fitted.free, fitted.found, fitted.loop.path, folder)


def scene_text(whole, free, found: Fit, measured: Path, folder: Path) -> str:
    """A scene with its fitted values in SI and every default, its paths relative to `folder`; comments say what was
    fitted.

    free: the Ranges of what was fitted, in the order of `found`; measured: the file.
    """
    told = [f"# {one.key} fitted to {measured.name}: {value!r} {one.unit}" + _bar(ends) for one, value, ends in
            zip(free, found.values.tolist(), found.intervals.tolist())]
    model = build(whole)  # its files are where they were; `folder` may not be there yet
    return "\n".join(told) + "\n\n" + resolved(moved(whole, folder / "scene.fitted.toml"), model)


def _bar(ends) -> str:
    return f", 95 % in [{ends[0]!r}, {ends[1]!r}]" if np.isfinite(ends).all() else ", not determined"


def answer_of(fitted: Fitted) -> dict:
    """The object of fit.json, in SI."""
    found, loop = fitted.found, fitted.loop
    values = {one.key: value_of(one, found, k) for k, one in enumerate(fitted.free)}
    offsets = {one.what: value_of(one.range, found, k) for k, one in enumerate(fitted.offsets, len(values))}
    named = [*fitted.free, *(one.range for one in fitted.offsets)]
    unit = "N" if loop.quantity == "force" else "1"
    clean = [[None if not np.isfinite(x) else x for x in row] for row in found.correlation.tolist()]
    held = None if fitted.held_rms is None else {"rows": int(fitted.held.sum()), "rms": fitted.held_rms}
    unknown = [{one.key: x for one, x in zip(named, row) if x} for row in found.unknown.tolist()]
    return {"patchfem": __version__, "title": fitted.scene.title, "measured": loop.path.name, "quantity": loop.quantity,
            "outcome": str(fitted.outcome), "values": values, "offsets": offsets, "unknown": unknown,
            "correlation": clean, "unit": unit, "rows": int((~fitted.held).sum()),
            "effective_rows": None if np.isnan(found.rows) else found.rows, "rms": fitted.rms, "held": held,
            "peak": float(np.abs(loop.reading).max()), "step_error": fitted.step_error,
            "steps_between_rows": fitted.pieces, "evaluations": found.evaluations, "failures": found.failures,
            "descents_agreed": found.agreed, "warnings": fitted.warnings, "seconds": round(fitted.seconds, 6)}


def value_of(one: Range, found: Fit, k: int) -> dict:
    """The object of a fitted value in fit.json."""
    ends = found.intervals[k].tolist()
    low, high = ends if np.isfinite(ends).all() else (None, None)
    return {"value": float(found.values[k]), "unit": one.unit, "low": low, "high": high,
            "interval": None if low is None else ends,
            "method": found.methods[k], "bounds": [one.low, one.high], "at_bound": found.at_bound[k] or None,
            "sensitivity": float(found.sensitivity[k])}


def fit_into(fitted: Fitted, folder: Folder) -> dict:
    """Write a fit into an open results folder and return the object of fit.json.

    Files: fit.json, fit.csv, fit.svg, scene.fitted.toml.
    """
    answer, loop = answer_of(fitted), fitted.loop
    write_json(answer, folder.path / "fit.json")
    write_text(folder.path / "scene.fitted.toml", fitted_scene(fitted, folder.target))
    write_rows(folder.path / "fit.csv", loop.time, loop.displacement, loop.reading, fitted.model, fitted.held,
               loop.quantity)
    picture = draw(loop.displacement, loop.reading, fitted.model, fitted.held, loop.quantity)
    write_text(folder.path / "fit.svg", picture)
    return answer
