"""Least-squares problem over free keys of a scene, and the record of the fitted keys.

A fit to a loop, a curve or rows makes an `identify.least_squares.Problem` of its free keys, solves it,
and concludes with the fitted keys and all warnings.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from ...core import Outcome, PatchfemError
from ...identify.least_squares import Fit, Problem
from ...identify.words import describe_fit
from ...model.model import Model, build
from ...runs import joint
from ...runs.patch import ladder
from ...scene.lines import split_key
from ...scene.overrides import BaseScene
from ...scene.ranges import Range, read_ranges
from ...scene.scene import Scene, SceneError, loads

# Ratio high/low of a range above which its middle is the geometric mean, as in `identify.space`.
LOG_RATIO = 10.0


@dataclass(frozen=True, eq=False, slots=True)
class FittedKeys:
    """Fitted values of the free keys of a scene, with intervals and warnings.

    Attributes
    ----------
    scene : Scene
        The scene before the fit.
    ranges : list of Range
        Bounds of the free keys.
    fit : Fit
        Values and intervals, in the order of `ranges`, then of values that are no keys.
    sets : list of str
        The ``table.key=value`` strings that make the scene the fitted one.
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
        return loads(self.scene.text, self.scene.path, [*self.scene.sets, *self.sets])


@dataclass(frozen=True, eq=False, slots=True)
class FreeKeys:
    """Free keys of a scene as the unknowns of a least-squares problem.

    Attributes
    ----------
    scene : Scene
        The scene whose keys are free.
    ranges : list of Range
        Bounds of the free keys.
    offsets : sequence of Range
        Bounds of values that are fitted as well and are no keys of the scene; they follow the keys.
    sets : sequence of str
        The ``table.key=value`` strings that the scene takes for all values.
    notes : sequence of str
        Sentences about what the model assumes, which become warnings.
    """

    scene: Scene
    ranges: list
    offsets: Sequence = ()
    sets: Sequence = ()
    notes: Sequence = ()

    @property
    def bounds(self) -> list:
        """Ranges of all unknowns, keys first."""
        return [*self.ranges, *self.offsets]

    def make_problem(self, residual: Callable) -> Problem:
        """Return the least-squares problem for a residual function of the unknowns.

        It starts from the values of the scene, else from the middle of each range.
        """
        return Problem(
            residual,
            low=[bound.low for bound in self.bounds],
            high=[bound.high for bound in self.bounds],
            start=[_initial_value(self.scene, bound) for bound in self.bounds],
        )

    def conclude(self, fit: Fit, begin: float, doubts: Sequence = ()) -> FittedKeys:
        """Return the fitted keys with intervals and all warnings.

        Parameters
        ----------
        fit : Fit
        begin : float
            Time of `perf_counter` at which the fit began [s].
        doubts : sequence of str
            Warnings that only this kind of fit gives.
        """
        undetermined = describe_fit(fit, [bound.key for bound in self.bounds])
        warnings = [*self.scene.remarks, *self.notes, *undetermined, *doubts]
        sets = [*self.sets, *format_assignments(self.ranges, fit.values)]
        return FittedKeys(self.scene, self.ranges, fit, sets, warnings, perf_counter() - begin)


def format_assignments(ranges: Iterable, values: Iterable) -> list:
    """Return the ``table.key=value`` strings that set free keys to values (n,)."""
    return [bound.format_assignment(value) for bound, value in zip(ranges, values)]


def parse_ranges(texts: Iterable) -> list:
    """Parse the ranges of free keys from "table.key=low..high" strings.

    Raises SceneError with all mistakes.
    """
    ranges, mistakes = read_ranges(texts)
    if mistakes:
        raise SceneError(mistakes)
    return ranges


def model_without_joint(base: BaseScene, sets: Iterable) -> Model:
    """Build a rig model whose modes are those without the joint.

    Parameters
    ----------
    base : BaseScene
        The scene whose keys are changed.
    sets : iterable of str
        ``table.key=value`` strings.

    Raises
    ------
    PatchfemError
        For values that make no scene, so that a search counts them as a failed evaluation.
    """
    try:
        return joint.remove_joint(build(base.override(sets)))
    except SceneError as error:
        raise PatchfemError(error.mistakes[0]) from None


def press_patch(model: Model):
    """Solve the contact of a model without error estimates; PatchfemError without contact."""
    patch = ladder.solve_with_coarser(model.patch, model.accuracy.tolerance, False)[0]
    if patch.pressure.outcome is Outcome.NO_CONTACT:
        raise PatchfemError(patch.pressure.outcome.sentence, "")
    return patch


def _initial_value(scene: Scene, bound: Range) -> float:
    """Return the value of a key in a scene, limited to its range.

    If the scene does not set it, it is the middle of the range.
    """
    value = scene
    for part in split_key(bound.key):
        value = _find_item(value, part) if isinstance(value, tuple) else getattr(value, part, None)
    if not isinstance(value, float):
        value = (bound.low + bound.high) / 2
        if bound.low > 0 and bound.high > LOG_RATIO * bound.low:
            value = np.sqrt(bound.low * bound.high)
    return float(np.clip(value, bound.low, bound.high))


def _find_item(items: tuple, word: str):
    """Return the table of an array by its name or its number from 0; None if not found."""
    named = [item for item in items if getattr(item, "name", None) == word]
    if named:
        return named[0]
    if word.isdecimal() and int(word) < len(items):
        return items[int(word)]
    return None
