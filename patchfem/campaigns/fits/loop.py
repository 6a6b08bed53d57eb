"""Comparison of a bench scene with a measured friction loop.

The model is free of stress in the first row of the record and follows the measured displacement, which is interpolated
linearly between rows. If the force depends on the time steps, they are halved until the fit converges.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...convergence import convergence_error
from ...core import PatchfemError
from ...effects import law_has_trait
from ...formatting import format_length
from ...identify.intervals import IntervalKind
from ...inputs.loops import Loop, read_loop
from ...model.model import Model, build
from ...model.source import locate_errors
from ...runs.bench.bench import run_bench
from ...runs.interfaces.bond_lists import choose_slide_summation
from ...runs.patch.case_meshes import condense_for_contacts, solve_on_other_mesh
from ...runs.patch.condensed import CondensedPair
from ...runs.refine import NO_LIMIT, Verdict, refine
from ...scene.assignments import Range
from ...scene.scene import Scene, SceneError
from ..free_keys import FreeKeys, solve_contact
from .problem import Comparison, FittedKeys

# Number of time steps between two rows at which the steps are not halved any more.
MAX_STEPS_PER_ROW = 64
# Largest ratio of a change of the force to the tolerance at which the change is negligible in a fit.
MAX_STEP_CHANGE_OVER_TOLERANCE = 0.1
# Ratio of the rest speed of growing bonds to the largest measured speed.
REST_SPEED_FRACTION = 1e-3
# Ratio of the largest displacement of a record to that of the scene beyond which one of their units is doubtful
MAX_STROKE_RATIO = 100


class StepChange(NamedTuple):
    """Readings (k,) with a number of time steps between two rows, and with twice as many."""

    n_steps: int
    coarse: np.ndarray
    fine: np.ndarray


class LoopComparison(Comparison):
    """Force [N] or friction ratio (k,) at the rows of a measured loop, and of a bench scene.

    Parameters
    ----------
    scene : Scene
        Scene of a bench.
    path : path-like
        File of the measured loop.
    ranges : sequence of Range
        Bounds of the free keys.

    Raises
    ------
    SceneError, PatchfemError
        If the input is invalid.
    """

    interval_kind = IntervalKind.SERIES

    def __init__(self, scene: Scene, path: Path, ranges: Sequence[Range]):
        if scene.kind != "bench":
            raise SceneError(
                [
                    f"{scene.path}: fit: to fit a measured loop the scene must prescribe the motion "
                    f"with [slide], but this is a {scene.kind} scene; add [slide]"
                ]
            )
        loop = read_loop(path)
        time, notes = _find_row_times(scene, loop)
        keys = FreeKeys(scene, ranges, _set_rest_speed(scene, ranges, loop, time))
        super().__init__(keys, path, loop.reading, loop.labels)
        self.warnings += notes

        # Mistakes in the files that the scene names do not depend on the keys. They are raised here, because a search
        # takes an error as a failed evaluation.
        with locate_errors(scene):
            build(scene)

        self.loop = loop
        self.time = time
        law = scene.friction.law
        is_rigid = law_has_trait(law, "set-valued") and not law_has_trait(law, "averaged")
        # The force of elastic pieces does not jump where the speed does.
        contact = scene.contact
        is_elastic = contact is not None and bool(contact.compliance_key)
        self.is_discontinuous = (law_has_trait(law, "creeps") or is_rigid) and not is_elastic
        steps = scene.accuracy.steps_per_cycle
        self.has_fixed_steps = steps is not None
        self.steps_per_row = max(1, -(-(steps or 1) // (loop.reading.size - 1)))
        self.step_error = 0.0
        self.patch = None
        self.pairs: list[CondensedPair | None] = []

    def compute(self, values: Sequence[float], needed: np.ndarray | None = None) -> np.ndarray:
        """Compute the reading (k,) at all rows for values (n,) [SI] of the keys.

        Raises PatchfemError if the scene is invalid for these values, or if nothing presses the pieces together.
        """
        model = self.keys.build_model(values)
        with locate_errors(model.source):
            return self._compute_reading(model, self._solve_patch(model))

    def _compute_reading(self, model: Model, patch) -> np.ndarray:
        """Compute the force [N] or the friction ratio [1] (k,) of a model along the measured displacement.

        `patch` is the solved contact patch, or None for a [normal] contact.
        """
        corner = np.arange(self.time.size) * self.steps_per_row
        number = np.arange(corner[-1] + 1)
        time = np.interp(number, corner, self.time)
        displacement = np.interp(number, corner, self.loop.displacement)
        choice = choose_slide_summation(model, displacement, is_smooth=True)
        samples = (time, displacement, 0, 0.0)
        run = run_bench(model, patch, 4, path=samples, choice=choice, say=self.listener.say)
        if not run.load[0] > 0:
            raise PatchfemError(
                "the normal load is 0 or less; give a load that presses the pieces together", ""
            )
        reading = run.force[corner]
        if self.is_discontinuous:
            # At a row between two straight segments the reading is the mean of the forces before and after it.
            after = run.force[np.minimum(corner + 1, number[-1])]
            reading = np.where(corner == 0, after, (reading + after) / 2)
        return reading / run.load[0] if self.loop.quantity == "friction_ratio" else reading

    def _solve_patch(self, model: Model):
        """Return the solved contact patch of a model; None for a [normal] contact."""
        if model.patch is None:
            return None
        if self.keys.changes_contact:
            if not self.pairs:
                self.pairs.append(self._condense_common_mesh())
            self.patch = solve_contact(model, self.pairs[0])
        elif self.patch is None:
            self.patch = solve_contact(model)
        return self.patch

    def _condense_common_mesh(self) -> CondensedPair | None:
        """Condense the pieces on a mesh for the lower ends, the middles and the upper ends of the ranges.

        The result is None if these have different pieces, so that each value has its own mesh.
        """
        patches = []
        low, high = self.keys.bounds.T
        for part in (0.0, 0.5, 1.0):
            try:
                patches.append(self.keys.build_model(low + part * (high - low)).patch)
            except PatchfemError:
                continue  # the search counts this error as a failed evaluation, too
        return condense_for_contacts(patches)

    def measure_step_change(self, values: Sequence[float]) -> np.ndarray:
        """Return the change (k,) of the reading that follows from fitted `values` when the time steps are halved."""
        coarse = self.compute(values)
        self.steps_per_row *= 2
        fine = self.compute(values)
        self.steps_per_row //= 2
        return fine - coarse

    def refine(self, values: np.ndarray, training: np.ndarray) -> bool:
        """Halve the time steps until their effect on the reading is negligible, unless the scene sets them.

        The effect is negligible if halving the steps changes no reading by more than MAX_STEP_CHANGE_OVER_TOLERANCE times
        the tolerance of the scene, relative to the largest reading. There are at most MAX_STEPS_PER_ROW steps per row.
        """
        if self.has_fixed_steps or self.steps_per_row >= MAX_STEPS_PER_ROW:
            return False
        first_steps = self.steps_per_row
        limit = MAX_STEP_CHANGE_OVER_TOLERANCE * self.keys.scene.accuracy.tolerance

        def solve(n_steps: int, before: StepChange | None) -> StepChange:
            """Compute the change of the reading when a number of steps is doubled."""
            self.steps_per_row = n_steps
            coarse = self.compute(values) if before is None else before.fine
            self.steps_per_row = 2 * n_steps
            fine = self.compute(values)
            self.steps_per_row = n_steps
            return StepChange(n_steps, coarse, fine)

        def judge(change: StepChange, excesses: list[float]) -> Verdict:
            """Halve the time steps while their effect is not negligible."""
            n_steps = 2 * change.n_steps
            allowed = limit * np.abs(change.coarse).max()
            if np.abs(change.fine - change.coarse).max() <= allowed or n_steps > MAX_STEPS_PER_ROW:
                return Verdict(0.0)
            reason = f"{n_steps} time steps between neighbouring rows of the record"
            return Verdict(np.inf, n_steps, reason=reason)

        refine(solve, first_steps, judge, NO_LIMIT, self.listener.say)
        return self.steps_per_row > first_steps

    def estimate_mesh_error(self, values: Sequence[float]) -> np.ndarray:
        """Return the error (k,) of the computed reading by the mesh of a patch, with its sign; 0 without a patch.

        The error follows from another mesh. Raises PatchfemError if there is no other mesh, or if the patch cannot be
        solved on it.
        """
        model = self.keys.build_model(values)
        patch = self._solve_patch(model)
        if patch is None:
            return np.zeros(self.time.size)
        other = solve_on_other_mesh(patch, model.accuracy.tolerance)
        change = self._compute_reading(model, patch) - self._compute_reading(model, other)
        return convergence_error(1.0, ratio=2.0 if other.x.size < patch.x.size else 0.5) * change

    def estimate_changes(self, values: np.ndarray) -> np.ndarray:
        """Return the errors (m, k) of the reading by the time steps and, if it can be measured, by the mesh."""
        step_change = self.measure_step_change(values)
        self.step_error = np.abs(step_change).max()
        changes = [convergence_error(1.0, ratio=0.5, order=2.0) * step_change]
        try:
            changes.append(self.estimate_mesh_error(values))
        except (PatchfemError, MemoryError) as reason:
            self.warnings.append(
                "the intervals do not contain the numerical error of the mesh, which could not be measured: "
                f"{reason or 'out of memory'}"
            )
        return np.array(changes)

    def find_warnings(self, fitted: FittedKeys) -> list[str]:
        """Return warnings about correlated residuals, the force at the start and coarse steps."""
        peak = np.abs(self.measured).max()
        n_used = np.count_nonzero(~fitted.held_out)
        n_independent = fitted.fit.intervals.rows
        warnings = []

        # Correlated deviations are an error of the model. Deviations of the size of round-off say nothing.
        # Ratio of the residual to the peak force up to which round-off dominates the residual.
        is_exact_fit = fitted.fit.rms <= 1e-6 * peak
        # Smallest fraction of independent rows for which no warning about correlation is issued.
        if not is_exact_fit and n_independent < 0.6 * n_used:
            warnings.append(
                "the deviations of neighbouring rows are correlated, so the intervals are computed as "
                f"if the {n_used} rows were {max(n_independent, 1):.3g} independent rows; a part of the deviation "
                "is systematic"
            )

        # The model carries no force before its first slide. A law without memory does not depend on the start, and rows
        # that are held out are not fitted.
        first_force = abs(self.measured[0])
        scene = self.keys.scene
        needs_no_start = fitted.held_out[0] or law_has_trait(scene.friction.law, "memoryless")
        # Largest ratio of the force in the first row to the peak force for a record that begins at
        # rest.
        if first_force > 0.2 * peak and not needs_no_start:
            warnings.append(
                f"the force in the first row is {first_force / peak:.0%} of the largest force, but the model "
                "starts without force: repeat the rows of the first cycle before the record, with a column of labels, and "
                "hold out this cycle, as --hold cycle=1, or give a record that begins at rest"
            )

        stroke = np.abs(self.loop.displacement).max()
        own = scene.slide.amplitude
        if own and not 1 / MAX_STROKE_RATIO < stroke / own < MAX_STROKE_RATIO:
            warnings.append(
                f"the record slides by {format_length(stroke, 2)}, but slide.amplitude is {format_length(own, 2)}: if this "
                "is not meant, correct the unit in the header of the record"
            )

        if self.step_error > scene.accuracy.tolerance * peak:
            warnings.append(
                "if the time steps are halved, the force of the model changes by "
                f"{self.step_error / peak:.1g} of its peak, more than the tolerance"
            )
        return warnings


def _find_row_times(scene: Scene, loop: Loop) -> tuple[np.ndarray, list[str]]:
    """Return the times (k,) [s] of the rows of a loop, and a note if the record does not give them.

    Raises PatchfemError if the force under the law of the scene depends on such times.
    """
    if loop.time is not None:
        return loop.time, []
    law = scene.friction
    has_plain_bonds = law_has_trait(law.law, "bonds") and law.rest_growth is None
    load_varies = scene.normal is not None and scene.normal.amplitude
    if load_varies or not (law_has_trait(law.law, "timeless") or has_plain_bonds):
        raise PatchfemError(
            f"{loop.path}:1: law '{law.law}' needs the times of the rows of this record; add a column time [s]"
        )
    note = (
        f"{loop.path} has no column of time: its rows are taken as evenly spaced in time, "
        f"which does not affect the force of law '{law.law}'"
    )
    return np.arange(float(loop.reading.size)), [note]


def _set_rest_speed(
    scene: Scene, ranges: Sequence[Range], loop: Loop, time: np.ndarray
) -> list[str]:
    """Return the assignment of the rest speed of growing bonds from the largest speed in a loop.

    It is a list of one `table.key=value` string, which is empty if the scene sets the rest speed, if it is one of the
    free keys (`ranges`), or if the bonds do not grow. time (k,) [s] is that of the rows.
    """
    law = scene.friction
    grows = law_has_trait(law.law, "bonds") and law.rest_growth is not None
    is_free = "friction.rest_speed" in {bound.key for bound in ranges}
    if not grows or law.rest_speed is not None or is_free:
        return []
    speeds = np.abs(np.diff(loop.displacement) / np.diff(time))
    return [f"friction.rest_speed={REST_SPEED_FRACTION * float(speeds.max())!r} m/s"]
