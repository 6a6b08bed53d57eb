"""Measures of a scene with its surface before and after wear.

In: two models that differ only in their gap. Out: the measures of both runs with their errors
(`SurfaceRuns`).
"""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core import Measure, NotConverged, PatchfemError
from ..disk.atomic_write import write_text
from ..model.model import Model
from ..runs.plan import plan
from ..runs.results.result import patch_surface
from ..runs.run import run
from ..surface.compare.records import Comparison
from ..surface.profile import Profile, level, resample_evenly

# Description of each compared measure, and the tables that a scene requires for it.
COMPARED_MEASURES = {
    "pressure_peak": ("largest pressure", "[contact]"),
    "contact_fraction": ("fraction of the patch length that is in contact", "[contact]"),
    "normal_stiffness": ("normal stiffness K_n", "[contact]"),
    "tangential_stiffness": ("tangential stiffness K_t", "[contact.shear] or [contact.asperities]"),
    "onset_level": (
        "drive level at which slip begins",
        '[structure] and [drive] with waveform = "levels"',
    ),
    "loop_area": (
        "energy dissipated by friction per cycle",
        "[friction] with [slide], or with [structure] and [drive]",
    ),
}


class SurfaceResult(NamedTuple):
    """Measures, normal stress and outcome of a run with one of the two surfaces.

    Attributes
    ----------
    measures : dict
        Measures by name.
    outcome : str
    sentence : str
        Description of the outcome.
    x : (n,) array
        Positions of the nodes [m].
    stress : (n,) array
        Normal stress at the nodes [Pa].
    warnings : list
        Warnings and notes.
    """

    measures: dict
    outcome: str
    sentence: str
    x: np.ndarray
    stress: np.ndarray
    warnings: list


class SurfaceRuns(NamedTuple):
    """Results of a scene with the surface before and with the surface after wear.

    Attributes
    ----------
    title : str
        Title of the scene.
    before, after : SurfaceResult or None
        Result of each run; None if the run failed.
    failed : tuple of str
        Error messages of failed runs.
    lacking : tuple of str
        Messages about measures that this scene does not provide.
    """

    title: str
    before: SurfaceResult | None
    after: SurfaceResult | None
    failed: tuple
    lacking: tuple

    def measure_rows(self) -> list:
        """Return a row for each measure with a value in at least one of the two runs.

        A row is a tuple (name, description, measure before, measure after); a measure may be None.
        """
        before, after = (getattr(side, "measures", {}) for side in (self.before, self.after))
        rows = []
        for name, (text, _) in COMPARED_MEASURES.items():
            if _has_value(before.get(name)) or _has_value(after.get(name)):
                rows.append((name, text, before.get(name), after.get(name)))
        return rows


def _has_value(measure: Measure | None) -> bool:
    """Return whether a measure exists and has a value."""
    return measure is not None and measure.value is not None


def run_both_surfaces(
    before: Model, after: Model, title: str, say: Callable | None = None
) -> SurfaceRuns:
    """Run a model with the surface before and a model with the surface after wear.

    If one of the runs fails, its error message is in `failed` and the other result is returned.

    Parameters
    ----------
    before, after : Model
    title : str
        Title of the scene.
    say : callable, optional
        Called with a line of text that reports the progress.

    Returns
    -------
    SurfaceRuns
    """
    results = []
    failed = []
    for name, model in (("before", before), ("after", after)):
        try:
            results.append(_run_surface(model, say))
        except (PatchfemError, NotConverged) as error:
            results.append(None)
            failed.append(f"the surface {name}: {error}")
    runs = SurfaceRuns(title, *results, tuple(failed), ())
    if not any(results):
        return runs
    known_names = {name for name, *_ in runs.measure_rows()}
    lacking = []
    for name, (text, requirement) in COMPARED_MEASURES.items():
        if name not in known_names:
            lacking.append(f"{text}: not computed, because the scene lacks {requirement}")
    return runs._replace(lacking=tuple(lacking))


def _run_surface(model: Model, say) -> SurfaceResult:
    """Run a model and return its measures, normal stress and outcome."""
    result = run(plan(model), say)
    outcome = result.outcome
    surface = patch_surface(result.patch, result.fields)
    return SurfaceResult(
        dict(result.measures),
        str(outcome),
        outcome.sentence,
        np.array(surface.x),
        np.array(result.fields["normal_stress"][0]),
        [*result.warnings, *result.extra["notes"]],
    )


def write_common_traces(comparison: Comparison, folder: Path) -> list[Path]:
    """Write the common part of two compared traces as surface_before.csv and surface_after.csv.

    A scene reads them with heights = "surface": x counts from their middle, and the heights are levelled. Without a common
    part the whole traces are written.

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
        traces = [Profile(curves.x, z, "trace") for z in (curves.before, curves.after)]
    paths = []
    for name, trace in zip(("before", "after"), traces, strict=True):
        flat = level(resample_evenly(trace))
        x = 1e6 * (flat.x - (flat.x[0] + flat.x[-1]) / 2)
        rows = [f"{place:.6f},{height:.6f}" for place, height in zip(x, 1e6 * flat.z, strict=True)]
        paths.append(folder / f"surface_{name}.csv")
        write_text(paths[-1], "\n".join(["x [um],z [um]", *rows, ""]))
    return paths


def surface_runs_to_dict(runs: SurfaceRuns) -> dict:
    """Return the results with the surfaces before and after wear as a dict in SI units."""
    measures = {}
    for name, _, before, after in runs.measure_rows():
        measures[name] = {"before": _measure_to_dict(before), "after": _measure_to_dict(after)}
    results = {"before": runs.before, "after": runs.after}
    warnings = []
    for name, result in results.items():
        if result is not None:
            warnings += [f"{name}: {text}" for text in result.warnings]
    return {
        "scene": runs.title,
        "measures": measures,
        "failed": list(runs.failed),
        "lacking": list(runs.lacking),
        "outcome": {name: getattr(result, "outcome", None) for name, result in results.items()},
        "warnings": warnings,
    }


def _measure_to_dict(measure: Measure | None) -> dict | None:
    """Return value, error and unit of a measure; None if there is no measure."""
    if measure is None:
        return None
    return {"value": measure.value, "error": measure.error, "unit": measure.unit}
