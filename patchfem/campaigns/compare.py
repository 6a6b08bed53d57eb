"""Measures of a scene with the surface before and with the surface after wear, side by side.

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

COMPARED_MEASURES = {  # by measure: its text in a sentence, and what a scene needs for it
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
    """Results of one run.

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
    """A scene that was run with both surfaces.

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
        """Return the measures that at least one run has.

        They are tuples (name, text, measure before, measure after), where a measure may be None.
        """
        sides = [one.measures if one is not None else {} for one in (self.before, self.after)]
        return [
            (name, words, *(side.get(name) for side in sides))
            for name, (words, _) in COMPARED_MEASURES.items()
            if any(_is_known(side.get(name)) for side in sides)
        ]


def _is_known(measure: Measure | None) -> bool:
    """Return whether a measure is known."""
    return measure is not None and measure.value is not None


def run_both_surfaces(
    before: Model, after: Model, title: str, say: Callable | None = None
) -> SurfaceRuns:
    """Run a model with the surface before and one with the surface after; all else is equal.

    A run that is refused or does not converge is described in `failed`; the other run is still
    given.

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
    known = {
        name
        for side in sides
        if side is not None
        for name, m in side.measures.items()
        if _is_known(m)
    }
    lacking = (
        tuple(
            f"{words}: not computed, because the scene lacks {need}"
            for name, (words, need) in COMPARED_MEASURES.items()
            if name not in known
        )
        if any(sides)
        else ()
    )
    return SurfaceRuns(title, *sides, tuple(failed), lacking)


def _run_side(model: Model, say) -> SurfaceResult:
    """Run a model and return its results."""
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


def surface_runs_data(found: SurfaceRuns) -> dict:
    """Return the runs as plain data in SI."""

    def side(one: Measure | None):
        """Return value, error and unit of a measure; None for None."""
        return None if one is None else {"value": one.value, "error": one.error, "unit": one.unit}

    out = {
        name: {"before": side(first), "after": side(second)}
        for name, _, first, second in found.rows()
    }
    return {
        "scene": found.title,
        "measures": out,
        "failed": list(found.failed),
        "lacking": list(found.lacking),
        "outcome": {
            name: None if one is None else one.outcome
            for name, one in (("before", found.before), ("after", found.after))
        },
        "warnings": [
            f"{name}: {text}"
            for name, one in (("before", found.before), ("after", found.after))
            if one is not None
            for text in one.warnings
        ],
    }
