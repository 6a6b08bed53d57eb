"""A fitted wear coefficient on disk: fit.json and the fitted scene, which runs."""

from pathlib import Path

from .. import __version__
from ..campaigns.wear_coefficient import KEY, Coefficient
from ..disk.whole import write_text
from .results import Folder
from .summary import write_json


def fit_into(fitted: Coefficient, title: str, text: str, folder: Folder) -> dict:
    """Write fit.json and scene.fitted.toml into an open results folder and return the object of fit.json, in SI.

    title and text: of the fitted scene.
    """
    one, bounds = fitted.measured, fitted.bounds
    value = {"value": fitted.value, "unit": "m2 N-1", "low": fitted.low, "high": fitted.high,
             "interval": [fitted.low, fitted.high], "bounds": [bounds.low, bounds.high]}
    answer = {"patchfem": __version__, "title": title, "measured": one.where, "quantity": one.name,
              "outcome": "done", "runs": fitted.runs, "model": fitted.model,
              "data": {"value": one.value, "low": one.low, "high": one.high},
              "values": {KEY: value},
              "warnings": []}
    write_json(answer, folder.path / "fit.json")
    told = f"# {KEY} fitted to {one.name}" + ("" if one.where == "--to" else f" of {Path(one.where).name}")
    write_text(folder.path / "scene.fitted.toml", f"{told}\n\n{text}")
    return answer
