"""Friction force along a measured displacement as a function of free parameters."""

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
from ...scene.overrides import BaseScene
from ...scene.scene import Scene, SceneError
from .loop_path import count_warm_up_rows, prepend_warm_up
from .problem import format_assignments, solve_contact

# Number of time steps between two rows at which the steps are not halved any more.
MAX_STEPS_PER_ROW = 64
# Largest ratio of a change of the force to the tolerance at which the change is negligible in a
# fit.
STEP_FRACTION = 0.1
# Ratio of the rest speed of growing bonds to the largest measured speed.
REST_SPEED_FRACTION = 1e-3
AMPLITUDE_TOL = 0.02  # Largest relative difference of two amplitudes that is not reported.


class BenchModel:
    """Callable that computes the force or friction ratio (k,) at the rows of a measured loop.

    Parameters
    ----------
    scene : Scene
        Scene with a table [slide].
    loop : Loop
        Measured loop.
    ranges : list of Range
        Bounds of the free parameters.
    offsets : sequence of Offset
        Offsets, whose values follow those of the free parameters.
    warm_up : bool
        Whether the complete cycles of the record are repeated before it as a warm-up.
    say : Callable, optional
        Called with a line of text that reports the progress.
    """

    def __init__(
        self, scene: Scene, loop: Loop, ranges: list, offsets=(), *, warm_up: bool = False, say=None
    ):
        self.scene = scene
        self.loop = loop
        self.ranges = ranges
        self.say = say
        self.base = BaseScene(scene)  # The scene is parsed only once.
        self.offsets = [offset.name for offset in offsets]
        self.n_warm_up_rows = count_warm_up_rows(loop) if warm_up else 0
        self.notes: list = []
        self.time = self._find_row_times()
        self._note_amplitude()
        friction = scene.friction
        self.assignments = self._rest_speed_assignments()
        rigid = law_has_trait(friction.law, "set-valued") and not law_has_trait(
            friction.law, "averaged"
        )
        self.is_force_discontinuous = law_has_trait(friction.law, "creeps") or rigid
        self.is_exact = self._force_is_step_independent()
        steps = scene.accuracy.steps_per_cycle
        self.has_fixed_steps = steps is not None
        self.steps_per_row = 1
        if self.has_fixed_steps and not self.is_exact:
            self.steps_per_row = max(1, -(-steps // (loop.reading.size - 1)))
        self.first_error = None
        self.n_computed = 0
        self.patch = None
        self.changes_contact = any(bound.key.startswith("contact.") for bound in ranges)
        # The common meshes of all values are chosen when a contact is first solved.
        self.meshes = None

    def _rest_speed_assignments(self) -> list:
        """Return the assignment of a rest speed from the measured speed, for bonds that grow at rest.

        The list is empty if the scene sets the rest speed or if the bonds do not grow.
        """
        law = self.scene.friction
        grows = law_has_trait(law.law, "bonds") and law.rest_growth is not None
        is_free = "friction.rest_speed" in {bound.key for bound in self.ranges}
        if not grows or law.rest_speed is not None or is_free:
            return []
        speeds = np.abs(np.diff(self.loop.displacement) / np.diff(self.time))
        speed = REST_SPEED_FRACTION * float(speeds.max())
        return [f"friction.rest_speed={speed!r} m/s"]

    def _force_is_step_independent(self) -> bool:
        """Return whether the computed force at the rows does not depend on the time steps."""
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
        """Compute the reading (k,) at the rows for free parameters and offsets (n,).

        Raises PatchfemError if the scene is invalid for these values.
        """
        n_keys = len(self.ranges)
        offsets = dict(zip(self.offsets, values[n_keys:]))
        model = self._build_model(self.build_scene(values[:n_keys]))
        self.n_computed += 1
        with locate_errors(model.source):
            reading = self._compute_reading(model, offsets.get("displacement", 0.0))
        return reading + offsets.get("force", 0.0)

    def _build_model(self, scene: Scene) -> Model:
        """Build the model of a scene, and store the first error that occurs."""
        try:
            with locate_errors(scene):
                return build(scene)
        except PatchfemError as error:
            # The files of the scene are read here; their errors do not depend on the free parameters.
            self.first_error = self.first_error or error
            raise

    def _compute_reading(self, model: Model, offset: float) -> np.ndarray:
        """Compute the force or friction ratio (k,) for the displacement with an offset [m]."""
        patch = self._get_solved_patch(model)
        path = prepend_warm_up(self.time, self.loop.displacement, self.n_warm_up_rows, offset)
        corner = np.arange(path.time.size) * self.steps_per_row
        number = np.arange(corner[-1] + 1)
        time = np.interp(number, corner, path.time)
        displacement = np.interp(number, corner, path.displacement)
        choice = choose_smooth_bond_summation(model, displacement)
        samples = (time, displacement, 0, 0.0)
        run = law_bench.run_bench(model, patch, 4, path=samples, choice=choice, say=self.say)
        if not run.load[0] > 0:
            raise PatchfemError(
                "the normal load is 0 or less; give a load that presses the pieces together", ""
            )
        reading = run.force[corner]
        if self.is_force_discontinuous:
            # The force is discontinuous at a row between two straight segments, where the reading
            # is the mean of the values before and after.
            after = run.force[np.minimum(corner + 1, number[-1])]
            reading = np.where(corner == 0, after, (reading + after) / 2)
        reading = reading[path.n_before :]
        return reading / run.load[0] if self.loop.quantity == "friction_ratio" else reading

    def build_scene(self, values) -> Scene:
        """Return the scene with given values of the free parameters."""
        try:
            return self.base.override([*self.assignments, *format_assignments(self.ranges, values)])
        except SceneError as error:
            self.first_error = self.first_error or error
            raise PatchfemError(error.mistakes[0]) from None

    def _get_solved_patch(self, model: Model):
        """Return the solved contact patch of a model; None for a [normal] contact."""
        if model.patch is None:
            return None
        if self.changes_contact:
            self.patch = solve_contact(self._get_shared_meshes().with_shared_meshes(model))
        elif self.patch is None:
            self.patch = solve_contact(model)
        return self.patch

    def _get_shared_meshes(self) -> meshes.SharedMeshes:
        """Return the meshes that all values of the free parameters have in common.

        They are chosen on the first call, for the lower ends, the middles and the upper ends of the ranges.
        """
        if self.meshes is None:
            models = []
            first_error = self.first_error
            for part in (0.0, 0.5, 1.0):
                values = [bound.low + part * (bound.high - bound.low) for bound in self.ranges]
                try:
                    models.append(build(self.build_scene(values)))
                except PatchfemError:
                    continue  # The search counts this error as a failed evaluation too.
            self.first_error = first_error
            self.meshes = meshes.SharedMeshes(models, False)
        return self.meshes

    def measure_step_error(self, values) -> float:
        """Return the largest change of the computed reading when the time steps are halved."""
        coarse = self(values)
        self.steps_per_row *= 2
        fine = self(values)
        self.steps_per_row //= 2
        return float(np.abs(fine - coarse).max())

    def refine_steps(self, values) -> None:
        """Halve the time steps until their effect on the reading is negligible, unless the scene sets them."""
        limit = STEP_FRACTION * self.scene.accuracy.tolerance
        while not self.has_fixed_steps and self.steps_per_row < MAX_STEPS_PER_ROW:
            if self.measure_step_error(values) <= limit * np.abs(self(values)).max():
                return
            self.steps_per_row *= 2
            if self.say:
                self.say(f"{self.steps_per_row} time steps between neighbouring rows of the record")

    def _find_row_times(self) -> np.ndarray:
        """Return the time of each measured row [s].

        The times are measured, or computed from the speed of the slide. They are equally spaced if
        the force does not depend on time.
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
        """Add a note if the slide amplitude of the scene differs from the measured amplitude."""
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
