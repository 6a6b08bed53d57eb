"""The least-squares problem over keys of a scene that fits to loops, curves and rows solve."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from ...core import Outcome, PatchfemError
from ...identify.least_squares import Fit, fit
from ...identify.space import SearchSpace, make_space
from ...identify.words import describe_fit
from ...model.model import Model, build
from ...runs import joint
from ...runs.patch import ladder
from ...scene.lines import split_key
from ...scene.overrides import BaseScene
from ...scene.ranges import Range, read_ranges
from ...scene.scene import Scene, SceneError, loads

# high / low of a range above which its middle is the geometric mean, as in `identify.space`
LOG_RATIO = 10.0


@dataclass(frozen=True, eq=False, slots=True)
class FittedKeys:
    """Values of free keys of a scene.

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
class Problem:
    """A residual as a function of free keys of a scene.

    Attributes
    ----------
    scene : Scene
        The scene whose keys are free.
    ranges : list of Range
        Bounds of the free keys.
    residual : Callable
        Values (n,) -> residual (r,). A PatchfemError is a failed evaluation.
    offsets : sequence of Range
        Bounds of values that are fitted as well and are no keys of the scene; they follow the keys.
    sets : sequence of str
        The ``table.key=value`` strings that the scene takes for all values.
    notes : sequence of str
        Sentences about what the model assumes, which become warnings.
    """

    scene: Scene
    ranges: list
    residual: Callable
    offsets: Sequence = ()
    sets: Sequence = ()
    notes: Sequence = ()

    @property
    def bounds(self) -> list:
        """The Range of every value."""
        return [*self.ranges, *self.offsets]

    @property
    def box(self) -> SearchSpace:
        """The space of the values."""
        return make_space(
            [bound.low for bound in self.bounds], [bound.high for bound in self.bounds]
        )

    def own_values(self) -> list:
        """Return starting values: those of the scene, else the middle of each range."""
        return [_initial_value(self.scene, bound) for bound in self.bounds]

    def solve(self, start: Sequence, starts: int = 3, bars: str = "series") -> Fit:
        """Minimise the sum of squares of the residual.

        Parameters
        ----------
        start : sequence of float
            Values (n,) of the first start.
        starts : int
            Number of starts.
        bars : str
            Kind of intervals, as in `identify.least_squares.fit`.
        """
        box = self.box
        return fit(
            self.residual, box.low, box.high, start=start, max_descents=starts, interval_kind=bars
        )

    def assign(self, values: Sequence) -> list:
        """Return the strings that set the free keys to values (n,), after those of `sets`."""
        assigned = [bound.format_assignment(value) for bound, value in zip(self.ranges, values)]
        return [*self.sets, *assigned]

    def conclude(self, found: Fit, begin: float, doubts: Sequence = ()) -> FittedKeys:
        """Return the fitted keys with all warnings.

        Parameters
        ----------
        found : Fit
        begin : float
            Time of `perf_counter` at which the fit began [s].
        doubts : sequence of str
            Warnings that only this kind of fit gives.
        """
        told = describe_fit(found, [bound.key for bound in self.bounds])
        warnings = [*self.scene.remarks, *self.notes, *told, *doubts]
        sets = self.assign(found.values)
        seconds = perf_counter() - begin
        return FittedKeys(self.scene, self.ranges, found, sets, warnings, seconds)


def parse_ranges(texts: Iterable) -> list:
    """Parse the Range of each free key from "table.key=low..high" strings.

    Raises SceneError with all mistakes.
    """
    found, mistakes = read_ranges(texts)
    if mistakes:
        raise SceneError(mistakes)
    return found


def model_without_joint(base: BaseScene, sets: Iterable) -> Model:
    """Build a rig whose modes are those without the joint.

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
    """Press the patch of a model without error estimates; PatchfemError if nothing touches."""
    patch = ladder.solve_all(model.patch, model.accuracy.tolerance, False)[0]
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
    """Return a table of an array by its name or its number from 0; None if there is none."""
    named = [item for item in items if getattr(item, "name", None) == word]
    if named:
        return named[0]
    if word.isdecimal() and int(word) < len(items):
        return items[int(word)]
    return None
