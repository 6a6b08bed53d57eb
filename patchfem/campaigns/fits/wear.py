"""Comparison of a worn depth with that of a scene, which gives the wear coefficient.

The worn depth depends almost only on the product of coefficient and cycles, so one run with the largest
coefficient gives the depth for all smaller ones. A factor corrects this curve by runs with the fitted coefficient. A last
run with error estimates gives the numerical error of the depth, by which the interval is widened.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.special import stdtrit

from ...core import Missing, NotConverged, PatchfemError
from ...formatting import format_length
from ...identify.intervals import IntervalKind
from ...inputs.damage import refuse_damage
from ...runs.patch import case_meshes
from ...runs.run import run
from ...runs.wear import evolve
from ...scene.assignments import Range
from ...scene.keys.quantities import parse_quantity
from ...scene.scene import Scene
from ..free_keys import FreeKeys
from .problem import Comparison, FittedKeys

MAX_WORN_DEPTH_NAME = "worn_depth_max"
# Names of the wear depths in compare.json, the more accurate one first.
WORN_DEPTH_NAMES = ("worn_depth_mean", MAX_WORN_DEPTH_NAME)
# Names in compare.json of the part that two measured surfaces of a piece have in common
COMMON_PART_NAMES = {"common_length", "common_area"}
# Half-width of a 95 % interval in standard deviations
HALF_WIDTH = stdtrit(np.inf, 0.975)
# Scene key of the wear coefficient [m2/N], the only one that is fitted to a wear depth
COEFFICIENT_KEY = "wear.coefficient"


class MeasuredDepth(NamedTuple):
    """Measured wear depth with its interval.

    - name: one of WORN_DEPTH_NAMES.
    - value: depth [m].
    - low, high: ends of its interval [m].
    - source: "--to" or a file.
    """

    name: str
    value: float
    low: float
    high: float
    source: str


def read_measured_depth(text: str) -> MeasuredDepth:
    """Read a measured depth of both pieces from a text, or from a JSON file that `compare` writes for two runs.

    The text has the form "worn_depth_max=2.5 um..3.5 um", or gives a single value, or is the name of the file. Raises
    PatchfemError for an invalid depth and Missing for a missing file.
    """
    name, equals, value = (part.strip() for part in str(text).partition("="))
    if not equals:
        return _read_depth_file(Path(text))
    if name not in WORN_DEPTH_NAMES:
        raise PatchfemError(
            f"--to {text}: {name} is not a possible quantity; use one of {', '.join(WORN_DEPTH_NAMES)}, "
            'such as "worn_depth_max=2.5 um..3.5 um", or the JSON file that compare writes'
        )
    try:
        bounds = [parse_quantity(part.strip(), "length") for part in value.split("..")]
    except ValueError as error:
        raise PatchfemError(f"--to {name}: {error}") from None
    if len(bounds) > 2 or not 0 < bounds[0] <= bounds[-1]:
        raise PatchfemError(
            f"--to {text}: give one value above zero, or a range low..high above zero"
        )
    return MeasuredDepth(name, (bounds[0] + bounds[-1]) / 2, bounds[0], bounds[-1], "--to")


def _read_depth_file(path: Path) -> MeasuredDepth:
    """Read a worn depth of both pieces from the JSON file `path`, written by `compare` for two runs.

    Raises PatchfemError for a comparison of measured surfaces, whose depth is that of one piece.
    """
    if not path.is_file():
        raise Missing(
            f"{path}: no such file; give --to the JSON file that compare writes for two runs, or "
            "worn_depth_max=VALUE"
        )
    with refuse_damage(f"{path}: this is not the JSON file that compare writes"):
        content = json.loads(path.read_text("utf-8"))

    # compare.json has the depths beside other tables, and summary.json among its measures.
    measures = content if isinstance(content, dict) else {}
    if isinstance(measures.get("measures"), dict):
        measures = measures["measures"] | measures
    # patchfem 1.0 wrote no common part, but only two runs have `runs` beside their registration
    is_measured = "registration" in measures and "runs" not in measures
    if is_measured or COMMON_PART_NAMES & measures.keys():
        raise PatchfemError(
            f"{path}: the worn depth of two measured surfaces is that of one piece and of their common part, but the fit "
            "needs that of both pieces and of the whole patch; to fit the coefficient to two traces run `patchfem compare "
            'BEFORE AFTER --predicted RESULTS_FOLDER`, or give a depth such as "worn_depth_mean=2.5 um..3.5 um"'
        )

    # Of several depths in the file the first in the order of WORN_DEPTH_NAMES is fitted.
    for name in WORN_DEPTH_NAMES:
        try:
            numbers = [float(measures[name][part]) for part in ("value", "low", "high")]
        except (KeyError, TypeError, ValueError):
            continue
        if np.isfinite(numbers).all() and numbers[0] > 0:
            value, low, high = numbers
            return MeasuredDepth(name, value, max(low, 0.0), high, str(path))

    raise PatchfemError(
        f"{path}: the file contains no worn depth above zero; give --to the JSON file that compare writes for two runs"
    )


class DepthComparison(Comparison):
    """Worn depth (1,) [m], measured and of a scene with wear.

    Parameters
    ----------
    scene : Scene
        Scene of a patch with wear.
    path : str
        Measured depth, in the format of `read_measured_depth`.
    ranges : sequence of Range
        Bounds of the coefficient alone.

    Raises
    ------
    SceneError, PatchfemError
        If the input is invalid, or if no coefficient within the range gives the depth.
    """

    default_starts = 1
    interval_kind = IntervalKind.KNOWN

    def __init__(self, scene: Scene, path: str, ranges: Sequence[Range]):
        if [bound.key for bound in ranges] != [COEFFICIENT_KEY]:
            raise PatchfemError(
                f"--free: in a scene with [wear] only {COEFFICIENT_KEY} can be fitted, for example "
                f"{COEFFICIENT_KEY}=1e-16 m^2/N..1e-12 m^2/N"
            )
        self.n_runs = 0
        self.depth = depth = read_measured_depth(path)
        super().__init__(FreeKeys(scene, ranges), depth.source, np.array([depth.value]), {})

        # The measured depth needs a patch without earlier wear.
        low, high = self.keys.bounds[0]
        model = self.keys.build_model([high])
        if model.patch is None:
            raise PatchfemError(
                f"--to {depth.name}: a [normal] contact has no worn depth; use [contact]", "normal"
            )
        if model.wear.start is not None:
            raise PatchfemError(
                f"fit {COEFFICIENT_KEY}: the fit must start from unworn pieces; leave out wear.start",
                "wear.start",
            )

        # The contact of the unworn pieces does not depend on the coefficient.
        self.patch = case_meshes.solve_with_coarser(model.patch, model.accuracy.tolerance, False)[0]
        self.curve = self._compute_curve(high)
        self.interpolate = PchipInterpolator(*self.curve)
        self.factor = 1.0
        smallest = float(self.interpolate(low))
        largest = self.curve[1, -1]
        if not smallest <= depth.value <= largest:
            side = "lower the low" if depth.value < smallest else "raise the high"
            raise PatchfemError(
                f"--free {COEFFICIENT_KEY}: within these bounds {depth.name} is {format_length(smallest, 4)} to "
                f"{format_length(largest, 4)}, but {format_length(depth.value, 4)} was measured; {side} bound, unless the "
                "coating is worn through"
            )

    def _compute_curve(self, coefficient: float) -> np.ndarray:
        """Compute coefficients [m2/N] up to a given one, and the depths [m] with them (2, j), from the course of one run."""
        self.n_runs += 1
        model = self.keys.build_model([coefficient])
        worn = evolve.compute_wear(model, self.patch, (None, None), self.listener.progress)
        if worn.stopped:
            raise PatchfemError(f"fit {COEFFICIENT_KEY}: {worn.stopped}")
        area = self.patch.pieces.interface.weight.ravel()
        depths = np.array([moment.depth.ravel() for moment in worn.moments])
        is_max = self.depth.name == MAX_WORN_DEPTH_NAME
        depth = depths.max(axis=1) if is_max else depths @ area / area.sum()
        cycles = np.array([moment.cycle for moment in worn.moments])
        return np.array([coefficient * cycles / model.wear.cycles, depth])

    def compute(self, values: Sequence[float], needed: np.ndarray) -> np.ndarray:
        """Return the depth (1,) [m] with a coefficient, from the corrected curve."""
        return self.factor * self.interpolate(values)

    def compare(self, computed: np.ndarray) -> np.ndarray:
        """Return the distance (1,) from the measured depth, in standard deviations of the interval on this side."""
        end = np.where(computed < self.measured, self.depth.low, self.depth.high)
        # Standard deviation of a depth that is given without an interval, relative to the depth; it
        # keeps its weight finite
        half_width = np.maximum(np.abs(end - self.measured), 1e-9 * self.measured)
        return HALF_WIDTH * (computed - self.measured) / half_width

    def refine(self, values: np.ndarray, training: np.ndarray) -> bool:
        """Correct the curve by a run with the fitted coefficient, and return whether the depth has changed."""
        depth = self._compute_curve(values[0])[1, -1]
        correction = float(depth / self.compute(values, training)[0])
        # Largest relative difference of computed and measured depth, over the tolerance, at which
        # the search ends.
        tolerance = 0.1 * self.keys.scene.accuracy.tolerance
        if abs(correction - 1) <= tolerance:
            return False
        self.factor *= correction
        return True

    def estimate_changes(self, values: np.ndarray) -> np.ndarray:
        """Return the distance (1, 1) of the exact depth with a coefficient from the computed one, as a residual.

        That is the distance of the depth of a run, whose meshes may be finer than those of the fit, and its error.
        """
        self.error = None
        self.n_runs += 1
        try:
            measures = run(self.keys.build_model(values), progress=self.listener.progress).measures
        except (NotConverged, Missing):
            measures = {}
        # The mean depth is the worn volume over the area.
        is_max = self.depth.name == MAX_WORN_DEPTH_NAME
        measure = measures.get(self.depth.name if is_max else "worn_volume")
        if measure is None or measure.error is None:
            self.warnings.append(
                "the numerical error of the computed depth is unknown, so the interval of the coefficient does not contain "
                "it"
            )
            return np.zeros((0, 1))
        area = 1.0 if is_max else float(self.patch.pieces.interface.weight.sum())
        self.error = abs(measure.value / area - self.measured[0]) + measure.error / area
        ends = self.compare(self.measured + self.error * np.array([-1, 1]))
        return np.array([[np.ptp(ends) / 2]])

    def find_warnings(self, fitted: FittedKeys) -> list[str]:
        """Return a warning about a depth that is given without an interval."""
        if self.depth.low < self.depth.high:
            return []
        return [
            f"{self.depth.name} was given without an interval, so that of the coefficient does not contain the error of the "
            f'measurement; give both ends, such as "{self.depth.name}=2.5 um..3.5 um"'
        ]
