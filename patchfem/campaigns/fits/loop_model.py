"""Friction force along a measured displacement, as a function of free keys of the scene."""

from itertools import product

import numpy as np

from ...core import PatchfemError
from ...effects import law_has_trait
from ...inputs.loops import Loop
from ...model.gap import find_shape_side
from ...model.model import Model, build
from ...model.source import locate_errors
from ...runs.batch import meshes
from ...runs.bench import bench as law_bench
from ...runs.bench.engine import choose_smooth_bond_summation
from ...runs.bench.ledger import BenchOptions
from ...scene.overrides import BaseScene
from ...scene.scene import Scene, SceneError
from .loop_path import count_whole_cycles, prepend_warm_up
from .problem import format_assignments, press_patch

# Largest number of free [contact] keys whose bounds and middles choose the shared meshes: 3**3
# models.
MAX_MESH_KEYS = 3
REST_SPEED_FRACTION = 1e-3  # Speed over the largest measured speed below which bonds are at rest.
AMPLITUDE_TOL = 0.02  # Relative difference of two amplitudes above which a note names them.


class BenchModel:
    """Model force or friction ratio (k,) at the rows of a measured loop, by free parameters.

    Parameters
    ----------
    scene : Scene
        With its [slide].
    loop : Loop
        The measured loop.
    ranges : list of Range
        Bounds of the free keys.
    offsets : sequence of Offset
        Their values follow those of the keys.
    warm : bool
        Whether the complete cycles of the record are driven once beforehand.
    say : Callable, optional
        Takes a line of progress.
    """

    def __init__(
        self, scene: Scene, loop: Loop, ranges: list, offsets=(), *, warm: bool = False, say=None
    ):
        self.scene = scene
        self.loop = loop
        self.ranges = ranges
        self.say = say
        self.base = BaseScene(scene)  # The text is parsed once, not at every evaluation.
        self.offsets = [offset.name for offset in offsets]
        self.warm = count_whole_cycles(loop) if warm else 0
        self.notes: list = []
        self.time = self._row_times()
        self._note_amplitude()
        law = scene.friction
        self.sets = self._rest_speed_sets()
        rigid = law_has_trait(law.law, "set-valued") and not law_has_trait(law.law, "averaged")
        self.force_jumps = law_has_trait(law.law, "creeps") or rigid
        self.exact = self._is_exact()
        steps = scene.accuracy.steps_per_cycle
        self.pinned = steps is not None
        self.pieces = 1
        if self.pinned and not self.exact:
            self.pieces = max(1, -(-steps // (loop.reading.size - 1)))
        self.first_error = None
        self.n_computed = 0
        self.patch = None
        self.moves_contact = any(bound.key.startswith("contact.") for bound in ranges)
        # The meshes are shared by all values, and chosen when a patch is first pressed.
        self.meshes = None

    def _rest_speed_sets(self) -> list:
        """Return the assignment of a rest speed for growing bonds from the measured motion.

        It is [] if the scene sets the rest speed, or if the bonds do not grow.
        """
        law = self.scene.friction
        grows = law_has_trait(law.law, "bonds") and law.rest_growth is not None
        is_free = "friction.rest_speed" in {bound.key for bound in self.ranges}
        if not grows or law.rest_speed is not None or is_free:
            return []
        speeds = np.abs(np.diff(self.loop.displacement) / np.diff(self.time))
        speed = REST_SPEED_FRACTION * float(speeds.max())
        return [f"friction.rest_speed={speed!r} m/s"]

    def _is_exact(self) -> bool:
        """Return whether the force at the rows is independent of the time steps."""
        law = self.scene.friction
        contact = self.scene.contact
        bonds = law_has_trait(law.law, "bonds")
        is_closed_form = law.rest_growth is None and (law.reading == "report" or law.order == 1)
        if bonds and not is_closed_form:
            return False
        if contact is None:
            return True
        return not (bonds and contact.compliance_key) and find_shape_side(contact) != "lower"

    def __call__(self, values) -> np.ndarray:
        """Compute the reading (k,) at the rows; PatchfemError for values that make no scene."""
        count = len(self.ranges)
        offsets = dict(zip(self.offsets, values[count:]))
        model = self._model(self.build_scene(values[:count]))
        self.n_computed += 1
        with locate_errors(model.source):
            reading = self._reading(model, offsets.get("displacement", 0.0))
        return reading + offsets.get("force", 0.0)

    def _model(self, scene: Scene) -> Model:
        """Build the model of a scene, and store the first error."""
        try:
            with locate_errors(scene):
                return build(scene)
        except PatchfemError as error:
            # Building reads files of the scene, and its errors do not depend on the free keys.
            self.first_error = self.first_error or error
            raise

    def _reading(self, model: Model, offset: float) -> np.ndarray:
        """Compute force or friction ratio (k,) of a model for a displacement with an offset [m]."""
        patch = self._patch(model)
        path = prepend_warm_up(self.time, self.loop.displacement, self.warm, offset)
        corner = np.arange(path.time.size) * self.pieces
        number = np.arange(corner[-1] + 1)
        time = np.interp(number, corner, path.time)
        displacement = np.interp(number, corner, path.displacement)
        options = BenchOptions(choose_smooth_bond_summation(model, displacement), self.say)
        run = law_bench.run_bench(model, patch, 4, 0, (time, displacement, 0, 0.0), options)
        if not run.load[0] > 0:
            raise PatchfemError(
                "the normal load is 0 or less; give a load that presses the pieces together", ""
            )
        reading = run.force[corner]
        if self.force_jumps:
            # The force jumps at a row between two straight segments; the reading is the mean of
            # both sides.
            after = run.force[np.minimum(corner + 1, number[-1])]
            reading = np.where(corner == 0, after, (reading + after) / 2)
        reading = reading[path.n_before :]
        return reading / run.load[0] if self.loop.quantity == "friction_ratio" else reading

    def build_scene(self, values) -> Scene:
        """Return the scene with given values of its free keys."""
        try:
            return self.base.override([*self.sets, *format_assignments(self.ranges, values)])
        except SceneError as error:
            self.first_error = self.first_error or error
            raise PatchfemError(error.mistakes[0]) from None

    def _patch(self, model: Model):
        """Return the pressed patch of a model; None for a [normal] contact."""
        if model.patch is None:
            return None
        if self.moves_contact:
            self.patch = press_patch(self._shared_meshes().with_shared_meshes(model))
        elif self.patch is None:
            self.patch = press_patch(model)
        return self.patch

    def _shared_meshes(self):
        """Return meshes shared by the bounds and the middle of each range of a [contact] key."""
        if self.meshes is not None:
            return self.meshes
        middle = [(bound.low + bound.high) / 2 for bound in self.ranges]
        keys = [bound.key for bound in self.ranges]
        contact_keys = [k for k, key in enumerate(keys) if key.startswith("contact.")]
        contact_keys = contact_keys[:MAX_MESH_KEYS]
        levels = [(self.ranges[k].low, middle[k], self.ranges[k].high) for k in contact_keys]
        models = []
        first_error = self.first_error
        for values in product(*levels):
            point = list(middle)
            for k, value in zip(contact_keys, values):
                point[k] = value
            try:
                models.append(build(self.build_scene(point)))
            except PatchfemError:
                continue  # The search meets the same error and counts it as a failed evaluation.
        self.first_error = first_error
        self.meshes = meshes.SharedMeshes(models, False)
        return self.meshes

    def _row_times(self) -> np.ndarray:
        """Return the times of the measured rows [s].

        They are measured, or computed from the speed of the motion, or equally spaced if time has
        no effect.
        """
        loop = self.loop
        scene = self.scene
        if loop.time is not None:
            return loop.time
        law = scene.friction
        plain_bonds = law_has_trait(law.law, "bonds") and law.rest_growth is None
        needs_time = not law_has_trait(law.law, "timeless") and not plain_bonds
        load_varies = scene.normal is not None and scene.normal.amplitude
        if not needs_time and not load_varies:
            self.notes.append(
                f"{loop.path} has no column of time: its rows are taken as evenly spaced in time, "
                f"which does not affect the force of law '{law.law}'"
            )
            return np.arange(float(loop.reading.size))
        steps = np.abs(np.diff(loop.displacement))
        if scene.slide.kind in ("constant", "triangle") and steps.all():
            self.notes.append(
                f"{loop.path} has no column of time: the times of its rows are computed from "
                "slide.speed"
            )
            return np.concatenate([[0.0], np.cumsum(steps / scene.slide.speed)])
        raise PatchfemError(
            f"{loop.path}:1: law '{law.law}' needs the times of the rows of this record; add a "
            "column time [s] (the times can be computed from slide.speed only for a constant or "
            "triangle slide without rests)"
        )

    def _note_amplitude(self) -> None:
        """Add a note if the amplitude of the scene differs from that of the record."""
        slide = self.scene.slide
        amplitude = float(np.ptp(self.loop.displacement)) / 2
        if slide.kind not in ("sine", "triangle"):
            return
        if abs(slide.amplitude - amplitude) > AMPLITUDE_TOL * amplitude:
            self.notes.append(
                f"slide.amplitude is {slide.amplitude:.4g} m, but the amplitude of the measured "
                f"displacement is {amplitude:.4g} m; the fit follows the measured displacement; for a run "
                "of the fitted scene set slide.amplitude"
            )
