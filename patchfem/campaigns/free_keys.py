"""Free keys of a scene: their ranges, and the models of the scene with other values of them."""

from collections.abc import Iterable, Sequence

import numpy as np

from ..core import Outcome, PatchfemError
from ..model.model import Model, build
from ..runs.patch import case_meshes
from ..runs.patch.press import solve_patch_contact
from ..scene.assignments import BOUNDS_FORM, Range, read_assignments
from ..scene.keys.lines import find_scene_value
from ..scene.overrides import BaseScene
from ..scene.scene import Scene, SceneError, add_sets


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
    """

    def __init__(self, scene: Scene, ranges: Sequence[Range], sets: Sequence[str] = ()):
        self.scene = scene
        self.ranges = list(ranges)
        self.sets = list(sets)
        self.base = BaseScene(add_sets(scene, self.sets))

    def assign(self, values: Iterable[float]) -> list[str]:
        """Return the ``table.key=value`` strings that set the keys to values (n,) [SI]."""
        return [bound.format_assignment(value) for bound, value in zip(self.ranges, values)]

    @property
    def names(self) -> list[str]:
        """Names of the keys."""
        return [bound.key for bound in self.ranges]

    @property
    def bounds(self) -> np.ndarray:
        """Bounds (n, 2) of the keys [SI]."""
        return np.array([(bound.low, bound.high) for bound in self.ranges])

    @property
    def changes_contact(self) -> bool:
        """Whether a key changes the static contact solution."""
        return any(name.startswith("contact.") for name in self.names)

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


def parse_ranges(texts: Iterable[str]) -> list[Range]:
    """Parse the ranges of free keys from "table.key=low..high" texts.

    Raises SceneError with all validation errors.
    """
    ranges, mistakes = read_assignments(texts, BOUNDS_FORM)
    if mistakes:
        raise SceneError(mistakes)
    return ranges


def solve_contact(model: Model, pair=None):
    """Solve the static contact problem of a model without error estimates.

    `pair` are its condensed pieces, by default those on a mesh of its own. Raises PatchfemError if the surfaces do not
    touch.
    """
    if pair is None:
        patch = case_meshes.solve_with_coarser(model.patch, model.accuracy.tolerance, False)[0]
    else:
        patch = solve_patch_contact(model.patch, pair)
    if patch.pressure.outcome is Outcome.NO_CONTACT:
        raise PatchfemError(patch.pressure.outcome.sentence, "")
    return patch
