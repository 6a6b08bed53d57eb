"""Free keys of a scene as the unknowns of a least-squares problem, and the record of their fitted values.

A fit to a loop, a curve or a response table makes a `Problem` of its `FreeKeys` and of a residual, which compares the model
that `FreeKeys.build_model` returns with the measurement. `make_fitted_keys` returns the result with all warnings.
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
from ...model.rig import JOINT_TABLES
from ...model.structure import name_joint_source
from ...runs.patch import mesh_levels
from ...scene.assignments import BOUNDS_FORM, Range, read_assignments
from ...scene.lines import find_scene_value
from ...scene.overrides import BaseScene
from ...scene.scene import Scene, SceneError, add_sets
from .options import FitOptions


@dataclass(frozen=True, slots=True)
class Listener:
    """Callbacks by which a fit reports its progress.

    - say: takes a line of text.
    - progress: takes the completed fraction, from 0 to 1.
    """

    say: Callable | None = None
    progress: Callable | None = None


# Options of a fit for which the user gives none
DEFAULT_OPTIONS = FitOptions()
# Listener that reports nothing
SILENT_LISTENER = Listener()


@dataclass(frozen=True, eq=False, slots=True)
class FittedKeys:
    """Fitted values of the free keys of a scene, with confidence intervals and warnings.

    Attributes
    ----------
    scene : Scene
        The scene before the fit.
    ranges : list of Range
        Bounds of the free keys.
    fit : Fit
        Values and intervals in the order of `ranges`.
    sets : list of str
        The ``table.key=value`` strings of the fitted scene.
    warnings : list of str
        Sentences for the user on the fit and its assumptions.
    seconds : float
        Elapsed time of the fit.
    """

    scene: Scene
    ranges: list[Range]
    fit: Fit
    sets: list[str]
    warnings: list[str]
    seconds: float

    @property
    def outcome(self) -> Outcome:
        """Outcome of the fit: done, or not_converged if the search did not converge."""
        return self.fit.outcome

    def fitted_scene(self) -> Scene:
        """Return the scene with the fitted values."""
        return add_sets(self.scene, self.sets)


class FreeKeys:
    """Free keys of a scene, and the models of the scene with their values.

    Parameters
    ----------
    scene : Scene
        Scene with the initial values.
    ranges : sequence of Range
        Bounds of the free keys.
    sets : sequence of str
        The ``table.key=value`` strings that are set for all values of the keys.
    notes : sequence of str
        Assumptions of the fit, which are added to the warnings.
    """

    def __init__(
        self,
        scene: Scene,
        ranges: Sequence[Range],
        sets: Sequence[str] = (),
        notes: Sequence[str] = (),
    ):
        self.scene = scene
        self.ranges = list(ranges)
        self.sets = list(sets)
        self.notes = list(notes)
        self.base = BaseScene(add_sets(scene, self.sets))
        self.start_time = perf_counter()

    def assign(self, values: Iterable[float]) -> list[str]:
        """Return the ``table.key=value`` strings that set the keys to values (n,) [SI]."""
        return [bound.format_assignment(value) for bound, value in zip(self.ranges, values)]

    @property
    def changes_contact(self) -> bool:
        """Whether a key changes the static contact solution."""
        return any(bound.key.startswith("contact.") for bound in self.ranges)

    def build_model(self, values: Iterable[float]) -> Model:
        """Build the model of the scene with values (n,) [SI] of the keys.

        Raises PatchfemError if the scene is invalid with them; a search counts this as a failed evaluation.
        """
        try:
            return build(self.base.override(self.assign(values)))
        except SceneError as error:
            raise PatchfemError(error.mistakes[0]) from None

    def start(self) -> list[float]:
        """Return the values of the scene, clipped to their ranges; NaN for a key that the scene does not set."""
        values = []
        for bound in self.ranges:
            _, value = find_scene_value(self.scene, bound.key)
            known = value if isinstance(value, float) else np.nan
            values.append(np.clip(known, bound.low, bound.high))
        return values

    def require_enough_rows(self, path: Path, count: int, name: str) -> None:
        """Raise PatchfemError if a measurement has too few values to determine the keys and their intervals.

        Parameters
        ----------
        path : Path
            File of the measurement.
        count : int
            Number of fitted values, without those that are held out.
        name : str
            Word for these values, such as "rows".
        """
        if count <= len(self.ranges):
            raise PatchfemError(
                f"{path}: only {count} {name} are used for the fit (what is held out does not count), too few to determine "
                f"{len(self.ranges)} values and their intervals"
            )

    def make_problem(self, residual: Callable[[np.ndarray], np.ndarray], start=None) -> Problem:
        """Return the least-squares problem of a residual, a function of the values (n,) [SI] of the keys.

        The search begins at the values `start` (n,), or at those of the scene.
        """
        low = [bound.low for bound in self.ranges]
        high = [bound.high for bound in self.ranges]
        return Problem(residual, low, high, self.start() if start is None else start)

    def widen(self, fit: Fit, changes: np.ndarray) -> Fit:
        """Return a fit with wider intervals that contain the effect of numerical errors of the model (`Fit.widen`).

        `changes` (m, r) are the changes of the r residuals by each of m errors.
        """
        return fit.widen(changes, [(bound.low, bound.high) for bound in self.ranges])

    def make_fitted_keys(self, fit: Fit, warnings: Sequence[str] = ()) -> FittedKeys:
        """Return the fitted values with their intervals and all warnings, after those of this kind of fit."""
        undetermined = describe_fit(fit, [bound.key for bound in self.ranges])
        every = [*self.scene.remarks, *self.notes, *undetermined, *warnings]
        every += warn_of_bolted_joint(self.scene, self.ranges)
        return FittedKeys(
            self.scene,
            self.ranges,
            fit,
            [*self.sets, *self.assign(fit.values)],
            every,
            perf_counter() - self.start_time,
        )


def parse_ranges(texts: Iterable[str]) -> list[Range]:
    """Parse the ranges of free keys from "table.key=low..high" texts.

    Raises SceneError with all validation errors.
    """
    ranges, mistakes = read_assignments(texts, BOUNDS_FORM)
    if mistakes:
        raise SceneError(mistakes)
    return ranges


def warn_of_bolted_joint(scene: Scene, ranges: Iterable[Range]) -> list[str]:
    """Return a list with a warning if a free key changes a joint that was bolted in the modal test.

    `ranges` are those of the free keys of the scene. The list is empty otherwise.
    """
    structure = scene.structure
    if structure is None or structure.measured == "free":
        return []
    if name_joint_source(structure) != "written":
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
