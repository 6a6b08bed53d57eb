"""Comparison of the measures of a scene with its surface before and after wear.

In: two models that differ only in the gap. Out: `SurfaceRuns`, the measures of both runs with their
errors.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..core import Measure, NotConverged, PatchfemError
from ..model.model import Model
from ..runs.plan import plan
from ..runs.results.result import patch_surface
from ..runs.run import run

# The table gives for each measure its text in a sentence, and what a scene needs for it.
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
    """Measures, stresses and outcome of a run with one of the two surfaces.

    Attributes
    ----------
    measures : dict
        Measures by name.
    outcome : str
    sentence : str
        The outcome as a sentence.
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
        None if the run failed.
    failed : tuple of str
        Reasons why runs failed.
    lacking : tuple of str
        Measures that this scene cannot give, and why.
    """

    title: str
    before: SurfaceResult | None
    after: SurfaceResult | None
    failed: tuple
    lacking: tuple

    def rows(self) -> list:
        """Return the measures that at least one of the two runs has.

        They are tuples (name, text, measure before, measure after), where a measure may be None.
        """
        before, after = (getattr(side, "measures", {}) for side in (self.before, self.after))
        rows = []
        for name, (text, _) in COMPARED_MEASURES.items():
            if _is_known(before.get(name)) or _is_known(after.get(name)):
                rows.append((name, text, before.get(name), after.get(name)))
        return rows


def _is_known(measure: Measure | None) -> bool:
    """Return whether a measure exists and has a value."""
    return measure is not None and measure.value is not None


def run_both_surfaces(
    before: Model, after: Model, title: str, say: Callable | None = None
) -> SurfaceRuns:
    """Run a model with the surface before and a model with the surface after wear.

    All else is equal. A run that is refused or does not converge is described in `failed`; the
    other run is still given.

    Parameters
    ----------
    before, after : Model
    title : str
        Title of the scene.
    say : callable, optional
        Takes a line of progress.

    Returns
    -------
    SurfaceRuns
    """
    sides = []
    failed = []
    for name, model in (("before", before), ("after", after)):
        try:
            sides.append(_run_side(model, say))
        except (PatchfemError, NotConverged) as error:
            sides.append(None)
            failed.append(f"the surface {name}: {error}")
    runs = SurfaceRuns(title, *sides, tuple(failed), ())
    if not any(sides):
        return runs
    known = {name for name, *_ in runs.rows()}
    lacking = []
    for name, (text, need) in COMPARED_MEASURES.items():
        if name not in known:
            lacking.append(f"{text}: not computed, because the scene lacks {need}")
    return runs._replace(lacking=tuple(lacking))


def _run_side(model: Model, say) -> SurfaceResult:
    """Run a model and return its measures, stresses and outcome."""
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


def surface_runs_data(runs: SurfaceRuns) -> dict:
    """Return both surface runs as plain data in SI units."""
    measures = {}
    for name, _, before, after in runs.rows():
        measures[name] = {"before": _measure_data(before), "after": _measure_data(after)}
    sides = {"before": runs.before, "after": runs.after}
    warnings = []
    for name, side in sides.items():
        if side is not None:
            warnings += [f"{name}: {text}" for text in side.warnings]
    return {
        "scene": runs.title,
        "measures": measures,
        "failed": list(runs.failed),
        "lacking": list(runs.lacking),
        "outcome": {name: getattr(side, "outcome", None) for name, side in sides.items()},
        "warnings": warnings,
    }


def _measure_data(measure: Measure | None) -> dict | None:
    """Return value, error and unit of a measure; None if there is no measure."""
    if measure is None:
        return None
    return {"value": measure.value, "error": measure.error, "unit": measure.unit}
