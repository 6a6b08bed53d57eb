"""Fit of the wear coefficient to a measured worn depth, with its interval.

The worn depth depends only on the product of coefficient and cycles, so one run with the largest
coefficient gives the depth for all smaller ones. The coefficient is interpolated from this curve, and
then checked and corrected by further runs. A last run with error estimates gives the numerical error of
the depth, by which the interval is widened.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from ...core import Measure, Missing, NotConverged, PatchfemError
from ...inputs.damage import refuse_damage
from ...model.model import Model
from ...runs.patch import mesh_levels
from ...runs.run import run
from ...runs.wear import evolve
from ...scene.assignments import Range
from ...scene.keys.quantities import parse_quantity

MAX_WORN_DEPTH_NAME = "worn_depth_max"
# Names of the wear depths in compare.json, the more accurate one first.
WORN_DEPTH_NAMES = ("worn_depth_mean", MAX_WORN_DEPTH_NAME)
# Names in compare.json of the part that two measured surfaces of a piece have in common
COMMON_PART_NAMES = {"common_length", "common_area"}
MAX_WEAR_RUNS = 6  # Largest number of wear runs; the correction converges within two or three runs.
# Largest relative difference of computed and measured depth, over the tolerance, at which the search ends.
MAX_DEPTH_ERROR_OVER_TOLERANCE = 0.1
# Scene key of the wear coefficient [m2/N], the only one that is fitted to a wear depth
COEFFICIENT_KEY = "wear.coefficient"


@dataclass(frozen=True, slots=True)
class MeasuredDepth:
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


@dataclass(frozen=True, eq=False, slots=True)
class FittedCoefficient:
    """Fitted wear coefficient with its interval.

    Attributes
    ----------
    value, low, high : float
        Coefficient [m2/N] and its interval, which contains those of the measured and of the computed depth.
    measured : MeasuredDepth
        Wear depth to which the coefficient is fitted.
    model : Measure
        Wear depth that is computed with the fitted coefficient [m]. If its error is unknown, the interval lacks it.
    bounds : Range
        Bounds of the search.
    runs : int
        Number of wear runs.
    curve : (2, j) array
        Coefficients up to the upper bound [m2/N], and the wear depths with them [m].
    """

    value: float
    low: float
    high: float
    measured: MeasuredDepth
    model: Measure
    bounds: Range
    runs: int
    curve: np.ndarray


class WearCurve(NamedTuple):
    """Wear depth (j,) [m] as a function of the completed fraction of the cycles (j,)."""

    fraction: np.ndarray
    depth: np.ndarray


class FoundCoefficient(NamedTuple):
    """Wear coefficient without its interval.

    - value: coefficient [m2/N].
    - depth: depth of a run with it [m].
    - curve: depth with the upper bound of the coefficient.
    - inverse: function of a depth [m] on this curve that returns the fraction of the cycles.
    - runs: number of wear runs.
    """

    value: float
    depth: float
    curve: WearCurve
    inverse: PchipInterpolator
    runs: int


def read_measured_depth(text: str) -> MeasuredDepth:
    """Read a measured depth of both pieces from a text, or from a JSON file that `compare` writes for two runs.

    The text has the form "worn_depth_max=2.5 um..3.5 um", or gives a single value, or is the name of the file. Raises
    PatchfemError for an invalid depth and Missing for a missing file.
    """
    name, equals, value = (part.strip() for part in text.partition("="))
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


def fit_wear(
    model: Model, measured_depth: str, ranges: Sequence[Range], progress: Callable | None = None
) -> FittedCoefficient:
    """Fit the wear coefficient so that the computed worn depth equals the measured one.

    Parameters
    ----------
    model : Model
        Model with wear.
    measured_depth : str
        Measured depth, in the format of `read_measured_depth`.
    ranges : sequence of Range
        Bounds of the coefficient alone.
    progress : Callable, optional
        Called with the completed fraction of a run.

    Returns
    -------
    FittedCoefficient

    Raises
    ------
    SceneError, PatchfemError
        If the input is invalid, or if no coefficient within the range gives the depth.
    NotConverged
        If the runs do not converge to a coefficient.
    """
    if [bound.key for bound in ranges] != [COEFFICIENT_KEY]:
        raise PatchfemError(
            f"--free: in a scene with [wear] only {COEFFICIENT_KEY} can be fitted, for example {COEFFICIENT_KEY}=1e-16 "
            "m^2/N..1e-12 m^2/N"
        )

    # The measured depth needs a patch without earlier wear.
    bounds = ranges[0]
    target = read_measured_depth(measured_depth)
    if model.patch is None:
        raise PatchfemError(
            f"--to {target.name}: a [normal] contact has no worn depth; use [contact]", "normal"
        )
    if model.wear.start is not None:
        raise PatchfemError(
            f"fit {COEFFICIENT_KEY}: the fit must start from unworn pieces; leave out wear.start",
            "wear.start",
        )

    # The contact of the unworn pieces does not depend on the coefficient.
    patch = mesh_levels.solve_with_coarser(model.patch, model.accuracy.tolerance, False)[0]

    def compute(coefficient: float) -> WearCurve:
        """Compute the wear depth over the cycles for a wear coefficient [m2/N]."""
        return _compute_wear_curve(model, patch, coefficient, target.name, progress)

    found = _search_coefficient(
        compute, target, bounds, MAX_DEPTH_ERROR_OVER_TOLERANCE * model.accuracy.tolerance
    )
    value = found.value
    area = float(patch.pieces.interface.weight.sum())
    error = _estimate_depth_error(model, value, target, area, progress)

    # The depth depends almost only on the product of coefficient and cycles. So the curve of the depth gives the
    # coefficients at both ends of the measured interval, which the error of the computed depth widens.
    curve = found.curve
    ends = np.array([target.low - (error or 0.0), target.high + (error or 0.0)])
    ends = found.inverse(np.clip(ends, curve.depth[0], curve.depth[-1]))
    low, high = value * ends / found.inverse(target.value)
    return FittedCoefficient(
        value=value,
        low=float(low),
        high=float(high),
        measured=target,
        model=Measure(found.depth, "m", error),
        bounds=bounds,
        runs=found.runs + 1,
        curve=np.array([bounds.high * curve.fraction, curve.depth]),
    )


def _search_coefficient(
    compute: Callable[[float], WearCurve], target: MeasuredDepth, bounds: Range, tolerance: float
) -> FoundCoefficient:
    """Find the wear coefficient whose computed depth equals the measured one.

    Parameters
    ----------
    compute : callable
        Function of a wear coefficient [m2/N] that runs the wear with it.
    target : MeasuredDepth
        Measured depth.
    bounds : Range
        Bounds of the coefficient.
    tolerance : float
        Largest relative difference of both depths.

    Raises
    ------
    PatchfemError
        If no coefficient within the bounds gives the depth.
    NotConverged
        If MAX_WEAR_RUNS runs do not meet the tolerance.
    """
    # One run with the largest coefficient gives the depth for all smaller ones.
    curve = compute(bounds.high)
    max_depth = curve.depth[-1]
    if not max_depth >= target.value:
        raise PatchfemError(
            f"--free {COEFFICIENT_KEY}: with the high bound {bounds.high:.4g} m^2/N the scene reaches only "
            f"{target.name} = {max_depth:.4g}, but {target.value:.4g} was measured; raise the high bound, "
            "unless the coating is worn through"
        )

    # The interpolated coefficient is corrected until a run with it has the measured depth.
    is_growing = np.diff(curve.depth, prepend=-1.0) > 0
    inverse = PchipInterpolator(
        curve.depth[is_growing], curve.fraction[is_growing], extrapolate=False
    )
    value = float(bounds.high * inverse(target.value))
    n_runs = 1
    while n_runs < MAX_WEAR_RUNS:
        n_runs += 1
        depth = float(compute(value).depth[-1])
        if abs(depth / target.value - 1) <= tolerance:
            break
        value *= float(inverse(target.value) / inverse(depth))
    else:
        raise NotConverged(
            f"fit {COEFFICIENT_KEY}: after {MAX_WEAR_RUNS} runs the fit has reached only {target.name} = "
            f"{depth:.6g} in place of {target.value:.6g}"
        )

    if value < bounds.low:
        raise PatchfemError(
            f"--free {COEFFICIENT_KEY}: {target.name} = {target.value:.4g} needs a coefficient of {value:.4g} "
            f"m^2/N, which is below the low bound {bounds.low:.4g}; lower this bound"
        )
    return FoundCoefficient(value, depth, curve, inverse, n_runs)


def _estimate_depth_error(
    model: Model, coefficient: float, target: MeasuredDepth, area: float, progress
) -> float | None:
    """Estimate how far the exact depth with a wear coefficient [m2/N] may be from the measured one.

    That is the distance of the depth of a run, whose meshes may be finer than those of the fit, and its error.

    Parameters
    ----------
    model : Model
        Model with wear.
    coefficient : float
        Fitted coefficient [m2/N].
    target : MeasuredDepth
        Measured depth.
    area : float
        Area of the patch [m2].
    progress : callable or None
        Called with the completed fraction of the run.

    Returns
    -------
    float or None
        Distance [m], or None if the run has no error.
    """
    model = replace(model, wear=replace(model.wear, coefficient=coefficient))
    try:
        result = run(model, progress=progress)
    except (NotConverged, Missing):
        return None

    # The mean depth is the worn volume over the area.
    name = target.name
    divisor = 1.0
    if name != MAX_WORN_DEPTH_NAME:
        name = "worn_volume"
        divisor = area
    measure = result.measures.get(name)
    if measure is None or measure.error is None:
        return None
    return float(abs(measure.value / divisor - target.value) + measure.error / divisor)


def _compute_wear_curve(model: Model, patch, coefficient: float, name: str, progress) -> WearCurve:
    """Compute the wear depth of a model over the cycles for a wear coefficient [m2/N].

    `patch` is the solved contact of the unworn pieces, `name` one of WORN_DEPTH_NAMES, and `progress` is called with the
    progress, or None.
    """
    model = replace(model, wear=replace(model.wear, coefficient=coefficient))
    worn = evolve.compute_wear(model, patch, (None, None), progress)
    if worn.stopped:
        raise PatchfemError(f"fit {COEFFICIENT_KEY}: {worn.stopped}")
    area = patch.pieces.interface.weight.ravel()
    depths = np.array([moment.depth.ravel() for moment in worn.moments])
    depth = depths.max(axis=1) if name == MAX_WORN_DEPTH_NAME else depths @ area / area.sum()
    fraction = np.array([moment.cycle for moment in worn.moments]) / model.wear.cycles
    return WearCurve(fraction, depth)
