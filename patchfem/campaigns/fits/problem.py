"""Least-squares problem for free parameters of a scene, and the record of the fitted values.

A fit to a loop, a curve or a response table makes a `Problem` of its free parameters, solves it, and
returns `FittedKeys` with all warnings.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np

from ...core import Outcome, PatchfemError
from ...identify.fit_sentences import describe_fit
from ...identify.least_squares import Fit, Problem
from ...model.model import Model, build
from ...runs.patch import mesh_levels
from ...scene.assignments import BOUNDS, Range, read_assignments
from ...scene.lines import find_scene_value
from ...scene.overrides import BaseScene
from ...scene.scene import Scene, SceneError, add_sets

# Largest ratio high/low of a range whose middle is the arithmetic mean; the middle of a wider range
# is the geometric mean, as in `identify.space`.
MAX_LINEAR_RATIO = 10.0
# Tables of the joint that was bolted when the modes were measured.
JOINT_TABLES = ("contact.", "normal.", "friction.", "structure.bonded.", "structure.interface.")


@dataclass(frozen=True, eq=False, slots=True)
class FittedKeys:
    """Fitted values of the free parameters of a scene, with confidence intervals and warnings.

    Attributes
    ----------
    scene : Scene
        The scene before the fit.
    ranges : list of Range
        Bounds of the free parameters.
    fit : Fit
        Values and intervals in the order of `ranges`, followed by fitted offsets.
    sets : list of str
        The ``table.key=value`` strings of the fitted scene.
    warnings : list of str
    seconds : float
        Elapsed time of the fit.
    """

    scene: Scene
    ranges: list
    fit: Fit
    sets: list
    warnings: list
    seconds: float

    @property
    def outcome(self) -> Outcome:
        """Outcome of the fit: done, or not_converged if the search did not converge."""
        return self.fit.outcome

    def fitted_scene(self) -> Scene:
        """Return the scene with the fitted values."""
        return add_sets(self.scene, self.sets)


@dataclass(frozen=True, eq=False, slots=True)
class FreeKeys:
    """Free parameters of a scene as the unknowns of a least-squares problem.

    Attributes
    ----------
    scene : Scene
        Scene with the initial values.
    ranges : list of Range
        Bounds of the free parameters.
    offsets : sequence of Range
        Bounds of additional unknowns that are not scene keys.
    sets : sequence of str
        The ``table.key=value`` strings that are set for all values of the parameters.
    notes : sequence of str
        Assumptions of the model, which are added to the warnings.
    """

    scene: Scene
    ranges: list
    offsets: Sequence = ()
    sets: Sequence = ()
    notes: Sequence = ()

    @property
    def bounds(self) -> list:
        """Ranges of all unknowns; those of the scene keys come first."""
        return [*self.ranges, *self.offsets]

    def require_enough_rows(self, path: Path, count: int, name: str) -> None:
        """Raise PatchfemError if a measurement has too few values to determine the unknowns and their intervals.

        Parameters
        ----------
        path : Path
            File of the measurement.
        count : int
            Number of fitted values, without those that are held out.
        name : str
            Word for these values, such as "rows".
        """
        if count <= len(self.bounds):
            raise PatchfemError(
                f"{path}: only {count} {name} are used for the fit (what is held out does not count), too few to determine "
                f"{len(self.bounds)} values and their intervals"
            )

    def make_problem(self, residual: Callable) -> Problem:
        """Return the least-squares problem for a residual function of the unknowns.

        The starting point has the values of the scene, or the middle of a range if there is none.
        """
        return Problem(
            residual,
            low=[bound.low for bound in self.bounds],
            high=[bound.high for bound in self.bounds],
            start=[_find_initial_value(self.scene, bound) for bound in self.bounds],
        )

    def make_fitted_keys(
        self, fit: Fit, start_time: float, extra_warnings: Sequence = ()
    ) -> FittedKeys:
        """Return the fitted values with their confidence intervals and all warnings.

        Parameters
        ----------
        fit : Fit
        start_time : float
            Value of `perf_counter` at the start of the fit [s].
        extra_warnings : sequence of str
            Additional warnings of this kind of fit.
        """
        undetermined = describe_fit(fit, [bound.key for bound in self.bounds])
        warnings = [*self.scene.remarks, *self.notes, *undetermined, *extra_warnings]
        warnings += warn_of_bolted_joint(self.scene, self.ranges)
        sets = [*self.sets, *format_assignments(self.ranges, fit.values)]
        return FittedKeys(self.scene, self.ranges, fit, sets, warnings, perf_counter() - start_time)


def format_assignments(ranges: Iterable, values: Iterable) -> list:
    """Return the ``table.key=value`` strings that set free parameters to values (n,)."""
    return [bound.format_assignment(value) for bound, value in zip(ranges, values)]


def parse_ranges(texts: Iterable) -> list:
    """Parse the ranges of free parameters from "table.key=low..high" strings.

    Raises SceneError with all validation errors.
    """
    ranges, mistakes = read_assignments(texts, BOUNDS)
    if mistakes:
        raise SceneError(mistakes)
    return ranges


def build_changed_model(base: BaseScene, sets: Iterable) -> Model:
    """Build the model of a scene with changes.

    Parameters
    ----------
    base : BaseScene
        Scene before the changes.
    sets : iterable of str
        ``table.key=value`` strings of the changes.

    Raises
    ------
    PatchfemError
        If the changed scene is invalid; a search counts this as a failed evaluation.
    """
    try:
        return build(base.override(sets))
    except SceneError as error:
        raise PatchfemError(error.mistakes[0]) from None


def warn_of_bolted_joint(scene: Scene, ranges: Iterable) -> list:
    """Return a list with a warning if a free parameter changes a joint that was bolted in the modal test, or []."""
    structure = scene.structure
    if structure is None or structure.measured == "free" or structure.measured_joint == "case":
        return []
    keys = [bound.key for bound in ranges if bound.key.startswith(JOINT_TABLES)]
    if not keys:
        return []
    return [
        f"the joint of the scene as written is subtracted from the bolted modes for every value of {' and '.join(keys)}; if "
        'the fitted joint is the one that was bolted in the modal test, set structure.measured_joint = "case"'
    ]


def solve_contact(model: Model):
    """Solve the static contact problem of a model without error estimates.

    Raises PatchfemError if the surfaces do not touch.
    """
    patch = mesh_levels.solve_with_coarser(model.patch, model.accuracy.tolerance, False)[0]
    if patch.pressure.outcome is Outcome.NO_CONTACT:
        raise PatchfemError(patch.pressure.outcome.sentence, "")
    return patch


def _find_initial_value(scene: Scene, bound: Range) -> float:
    """Return the starting value of a free parameter: its value in the scene, clipped to its range.

    It is the middle of the range if the scene does not set the parameter.
    """
    _, value = find_scene_value(scene, bound.key)
    if not isinstance(value, float):
        value = (bound.low + bound.high) / 2
        if bound.low > 0 and bound.high > MAX_LINEAR_RATIO * bound.low:
            value = np.sqrt(bound.low * bound.high)
    return float(np.clip(value, bound.low, bound.high))
