"""Contents of the files of a fit, and their writing."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ... import __version__
from ...campaigns.fits.problem import FittedKeys
from ...disk.atomic_write import write_rows, write_text
from ...identify.least_squares import Fit
from ...model.model import build, write_resolved
from ...scene.ranges import Range
from ...scene.scene import move_scene
from ..drawing import pictures
from ..results import PAGE, Folder
from ..summary import write_json
from .page import page_html

FITTED_SCENE = "scene.fitted.toml"


class FitFiles(NamedTuple):
    """Contents of all files that a fit writes.

    Attributes
    ----------
    answer : dict
        Content of fit.json in SI units.
    lines : list of str
        Lines of text with the result.
    summary : list of str
        Lines of text at the top of the page.
    scenes : dict
        Text of each scene by the name of its file.
    rows : list
        Rows of fit.csv, the header first.
    charts : list
        Charts of fit.svg.
    caption : str
        Caption of fit.svg.
    """

    answer: dict
    lines: list
    summary: list
    scenes: dict
    rows: list | tuple = ()
    charts: list | tuple = ()
    caption: str = ""


def write_fit(files: FitFiles, folder: Folder) -> None:
    """Write all files of a fit into an open results folder.

    They are fit.json, fit.csv, fit.svg, the scenes and the page.
    """
    write_json(files.answer, folder.path / "fit.json")
    for name, text in files.scenes.items():
        write_text(folder.path / name, text)
    if files.rows:
        write_rows(folder.path / "fit.csv", files.rows)
    picture = ""
    if files.charts:
        picture = pictures.draw_charts(files.charts)
        write_text(folder.path / "fit.svg", picture)
    text = page_html(
        files.answer,
        lines=files.lines,
        summary=files.summary,
        picture=picture,
        caption=files.caption,
        scene_text=files.scenes[FITTED_SCENE],
    )
    write_text(folder.path / PAGE, text)


def describe_measurement(title: str, measured: str, quantity: str, outcome) -> dict:
    """Return the first entries of fit.json: program, title, measured file and outcome."""
    return {
        "patchfem": __version__,
        "title": title,
        "measured": measured,
        "quantity": quantity,
        "outcome": str(outcome),
    }


def describe_values(keys: FittedKeys) -> dict:
    """Return all fitted values as a dict of scene keys, as written in fit.json."""
    return {bound.key: describe_value(bound, keys.fit, k) for k, bound in enumerate(keys.ranges)}


def describe_value(bound: Range, fit: Fit, k: int) -> dict:
    """Return fitted value k with its confidence interval and range, as written in fit.json."""
    ends = fit.intervals.ends[k].tolist()
    low, high = ends if np.isfinite(ends).all() else (None, None)
    return {
        "value": float(fit.values[k]),
        "unit": bound.unit,
        "low": low,
        "high": high,
        "interval": None if low is None else ends,
        "method": fit.intervals.methods[k],
        "bounds": [bound.low, bound.high],
        "at_bound": fit.at_bound[k] or None,
        "sensitivity": float(fit.intervals.sensitivity[k]),
    }


def describe_unknown(bounds: list, fit: Fit) -> list:
    """Return the changes of fitted values that the data do not determine, as written in fit.json."""
    return [
        {bound.key: part for bound, part in zip(bounds, row) if part}
        for row in fit.intervals.unknown.tolist()
    ]


def describe_correlation(fit: Fit) -> list:
    """Return the correlation matrix of the fitted values, as written in fit.json."""
    return [
        [part if np.isfinite(part) else None for part in row]
        for row in fit.intervals.correlation.tolist()
    ]


def fitted_scene_text(keys: FittedKeys, measured: str, folder: Path) -> str:
    """Return the text of the fitted scene, in SI units with all defaults.

    Parameters
    ----------
    keys : FittedKeys
    measured : str
        Name of the measured file, for the comments that say what was fitted.
    folder : Path
        Folder to which the paths of the scene are relative.
    """
    scene = keys.fitted_scene()
    comments = []
    for bound, value, ends in zip(
        keys.ranges, keys.fit.values.tolist(), keys.fit.intervals.ends.tolist()
    ):
        interval = ", not determined"
        if np.isfinite(ends).all():
            interval = f", 95 % in [{ends[0]!r}, {ends[1]!r}]"
        comments.append(f"# {bound.key} fitted to {measured}: {value!r} {bound.unit}{interval}")
    # The model is built before the scene moves, because its file names are relative to its folder.
    model = build(scene)
    text = write_resolved(move_scene(scene, folder / FITTED_SCENE), model)
    return "\n".join(comments) + "\n\n" + text
