"""Measures of a scene with its surface before and after wear.

In: two models that differ only in their gap. Out: the results of both runs (`SurfaceRuns`).
"""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core import NotConverged, PatchfemError
from ..disk.atomic_write import write_text
from ..model.model import Model
from ..runs.plan import plan
from ..runs.results.result import Result
from ..runs.run import run
from ..surface.areal import level
from ..surface.compare.records import Comparison
from ..surface.profile import Profile, resample_evenly

# The two surfaces of a comparison, in names of files and results
SURFACE_NAMES = ("before", "after")


class SurfaceRuns(NamedTuple):
    """Results of a scene with the surface before and with the surface after wear.

    Attributes
    ----------
    title : str
        Title of the scene.
    results : dict
        Result of each run that did not fail, by side ("before", "after").
    failed : tuple of str
        Error messages of failed runs.
    """

    title: str
    results: dict[str, Result]
    failed: tuple[str, ...]


def run_both_surfaces(
    before: Model, after: Model, title: str, say: Callable | None = None
) -> SurfaceRuns:
    """Run a model with the surface before and a model with the surface after wear.

    Parameters
    ----------
    before, after : Model
        Models of the same scene with the two surfaces.
    title : str
        Title of the scene.
    say : callable, optional
        Called with a line of text that reports the progress.
    """
    results = {}
    failed = []
    for side, model in zip(SURFACE_NAMES, (before, after)):
        try:
            results[side] = run(plan(model), say)
        except (PatchfemError, NotConverged) as error:
            failed.append(f"the surface {side}: {error}")
    return SurfaceRuns(title, results, tuple(failed))


def write_common_traces(comparison: Comparison, folder: Path) -> list[Path]:
    """Write the common part of two compared traces as surface_before.csv and surface_after.csv.

    A scene reads them with heights = "surface": x counts from their middle, and the heights are levelled. Without a common
    part the whole traces are written.

    Parameters
    ----------
    comparison : Comparison
        Comparison of two traces.
    folder : Path
        Folder of the files.

    Returns
    -------
    list of Path
        Both files.

    Raises
    ------
    PatchfemError
        If scans were compared.
    """
    if comparison.is_areal:
        raise PatchfemError(
            "compare --scene: the contact can be computed only for traces; write one line of heights of each scan to a "
            "file of its own"
        )
    curves = comparison.evidence.curves
    traces = [comparison.before, comparison.after]
    if curves is not None and np.isfinite(curves.before).any():
        traces = [Profile(curves.x, z, "trace") for z in curves.heights]
    paths = []
    for side, trace in zip(SURFACE_NAMES, traces, strict=True):
        flat = level(resample_evenly(trace))
        x = 1e6 * (flat.x - (flat.x[0] + flat.x[-1]) / 2)
        rows = [f"{place:.6f},{height:.6f}" for place, height in zip(x, 1e6 * flat.z, strict=True)]
        paths.append(folder / f"surface_{side}.csv")
        write_text(paths[-1], "\n".join(["x [um],z [um]", *rows, ""]))
    return paths
