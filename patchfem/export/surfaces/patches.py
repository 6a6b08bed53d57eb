"""Patch of a run from its results folder: surface, measures and scene."""

import tomllib
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core import Missing, PatchfemError
from ...wear.between_runs import PatchState
from .. import store
from ..answer import Answer

REQUIRED_VARIABLES = ("x", "weight", "unloaded_gap", "normal_stress")


class PatchRun(NamedTuple):
    """Run of a patch: its answer, the tables of its scene, and the state of its surface at the end."""

    answer: Answer
    tables: dict[str, dict]
    state: PatchState

    @property
    def cycles(self) -> float:
        """Number of cycles of wear."""
        cycles = self.answer.data.get("wear_frame")
        return 0.0 if cycles is None else float(cycles.values[-1])


def read_patch(folder: Path) -> PatchRun:
    """Read the run of a patch from a results folder.

    Raises
    ------
    Missing
        If there is no such folder.
    PatchfemError
        If it does not have the results of a run with [contact].
    """
    if not folder.exists():
        raise Missing(f"{folder}: there is no such folder")
    answer = store.read_answer(folder)
    data = answer.data
    scene = tomllib.loads(answer.origin.get("resolved", ""))
    if "contact" not in scene:
        raise PatchfemError(f"{folder}: a run without [contact] has no surfaces to compare")
    missing = [name for name in REQUIRED_VARIABLES if name not in data]
    if missing:
        raise PatchfemError(
            f"{folder}: result.nc contains no {' and no '.join(missing)}; run the scene again"
        )

    # A field over a face has a row for each y.
    x = data["x"].values
    y = data["y"].values if "y" in data else None
    shape = x.shape if y is None else (y.size, x.size)
    depth = worn_depths(answer)[-1] if "wear" in scene else np.zeros(x.size)
    weight = data["weight"].values
    fields = (weight, data["unloaded_gap"].values, depth)
    try:
        area, gap, depth = (np.broadcast_to(field, shape) for field in fields)
    except ValueError:
        raise PatchfemError(f"{folder}: the fields in result.nc differ in length") from None

    # Measures of the wear with their errors, as far as the run has them.
    measures = {
        name: (answer.quantities[name].value, answer.quantities[name].error)
        for name in ("worn_volume", "worn_depth_max")
        if name in answer.quantities
    }
    state = PatchState(str(folder), scene["contact"], x, y, area, gap, depth, measures)
    return PatchRun(answer, scene, state)


def worn_depths(answer: Answer) -> np.ndarray:
    """Return the worn depth [m] of both pieces after the cycles of `wear_frame`: (f, m), or (f, ny, nx) over a face."""
    if "wear_worn_depth" not in answer.data:
        raise PatchfemError("result.nc contains no wear_worn_depth; run the scene again")
    return answer.data["wear_worn_depth"].values
