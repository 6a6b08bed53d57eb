"""Comparison of a rig with a table of measured responses.

A residual is ln(computed/measured). A reading flagged U (unstable) is a lower bound: the motion was still growing, so that
only a smaller computed value is a misfit.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...core import G_N
from ...scene.assignments import Range
from ...scene.scene import Scene
from ..rows.cells import MAX_LOG_RATIO, compute_rms_scores, read_response_table
from ..rows.condition_models import ConditionModels
from ..rows.model_readings import ModelReadings
from .problem import Comparison, FittedKeys


class RowsComparison(Comparison):
    """Readings (n,) of accelerations [m s-2] and displacements [m], measured and of a rig.

    Parameters
    ----------
    scene : Scene
        Scene of a rig.
    path : Path
        File of the table.
    ranges : sequence of Range
        Bounds of the free keys.

    Raises
    ------
    SceneError, PatchfemError
        If the input is invalid.
    """

    default_starts = 8
    values_name = "readings"
    is_expensive = True

    def __init__(self, scene: Scene, path: Path, ranges: Sequence[Range]):
        self.cells = read_response_table(path)
        models = ConditionModels(scene, self.cells.conditions, ranges, Path(path))
        super().__init__(models, path, self.cells.measured, self.cells.columns)
        self.warnings += models.notes
        self.readings = ModelReadings(models)
        self.forget_motions = self.readings.reset_motions
        places = [f"at {f:.6g} Hz and {level / G_N:.4g} g" for f, level in self.cells.conditions]
        self.places = [places[k] for k in self.cells.condition]

    def compute(self, values: Sequence[float], needed: np.ndarray) -> np.ndarray:
        """Compute the readings (n,) for values of the keys; those at conditions that are not needed are NaN."""
        self.readings.say = self.listener.say
        conditions = sorted(set(self.cells.condition[needed].tolist()))
        return self.cells.select_computed(*self.readings(values, conditions))

    def compare(self, computed: np.ndarray) -> np.ndarray:
        """Return the log ratios (n,), at most 0 for a reading flagged U."""
        logs = self.cells.compute_logs(computed)
        return np.where(self.cells.unstable, np.minimum(logs, 0.0), logs)

    def find_warnings(self, fitted: FittedKeys) -> list[str]:
        """Return warnings about rows without readings, unstable readings and an unreliable search."""
        cells = self.cells
        warnings = []
        if cells.empty_rows:
            numbers = ", ".join(str(k + 1) for k in cells.empty_rows)
            warnings.append(
                f"{len(cells.empty_rows)} of {len(cells.rows)} rows have no reading and are left out: rows {numbers}"
            )
        n_unstable = int(cells.unstable.sum())
        if n_unstable:
            warnings.append(
                f"{n_unstable} readings flagged U (unstable) count in the fit as lower bounds; scores_stable leaves these "
                "readings out"
            )

        # A motion that is not bounded has the largest log ratio in place of a reading.
        unbounded = set()
        for k in cells.row[np.abs(cells.compute_logs(fitted.computed)) >= MAX_LOG_RATIO]:
            unbounded.add(f"{cells.rows[k].frequency:.6g} Hz, {cells.rows[k].input:.4g} m/s^2")
        if unbounded:
            warnings.append(
                f"no bounded motion is found at {'; '.join(sorted(unbounded))}: each row at these inputs "
                f"counts as if the model were wrong by a factor of {np.exp(MAX_LOG_RATIO):.0f}"
            )
        fit = fitted.fit
        if fit.n_best == 1 and fit.descent_rms.size > 1:
            warnings.append(
                f"only one of {fit.descent_rms.size} searches ended within 1 % of the best training score, so "
                "a better fit may exist; raise --starts"
            )
        return warnings

    def compute_scores(
        self, fitted: FittedKeys, *, only_stable: bool = False
    ) -> dict[str, dict | None]:
        """Return the scores of the "fitted", the "held_out" and the "left_out" readings (`cells.compute_rms_scores`).

        Parameters
        ----------
        fitted : FittedKeys
            Fitted values, with the readings that they compute.
        only_stable : bool
            Whether to leave out the readings flagged U (unstable).
        """
        counts = ~self.cells.unstable if only_stable else np.ones(fitted.held_out.size, bool)
        logs = self.cells.compute_logs(fitted.computed)
        left_out = self.cells.compute_logs(fitted.left_out)
        groups = {
            "fitted": (logs, ~fitted.held_out),
            "held_out": (logs, fitted.held_out),
            "left_out": (left_out, ~np.isnan(left_out)),
        }
        scores = {}
        for name, (values, is_in_group) in groups.items():
            scores[name] = compute_rms_scores(self.cells, values, counts & is_in_group)
        return scores
