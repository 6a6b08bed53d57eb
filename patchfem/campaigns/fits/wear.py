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
from ...model.model import Model
from ...runs.patch import mesh_levels
from ...runs.patch.press import nodal_areas
from ...runs.run import run
from ...runs.wear import evolve
from ...scene.assignments import Range
from ...scene.keys.quantities import parse_quantity

MAX_DEPTH = "worn_depth_max"
# Names of the wear depths in compare.json, the more accurate one first.
QUANTITIES = ("worn_depth_mean", MAX_DEPTH)
MAX_RUNS = 6  # Largest number of wear runs; the correction converges within two or three runs.
# Largest ratio of the relative error of the computed depth to the specified tolerance.
DEPTH_TOL = 0.1
# Scene key of the wear coefficient [m2/N], the only one that is fitted to a wear depth
COEFFICIENT_KEY = "wear.coefficient"


@dataclass(frozen=True, slots=True)
class MeasuredDepth:
    """Measured wear depth with its interval.

    - name: one of QUANTITIES.
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


def read_measured_depth(text: str) -> MeasuredDepth:
    """Read a measured depth from a text, or from a JSON file written by `compare`.

    The text has the form "worn_depth_max=2.5 um..3.5 um", or gives a single value, or is the name of the file. Raises
    PatchfemError for an invalid depth and Missing for a missing file.
    """
    name, equals, value = (part.strip() for part in text.partition("="))
    if not equals:
        return _read_depth_file(Path(text))
    if name not in QUANTITIES:
        raise PatchfemError(
            f"--to {text}: {name} is not a possible quantity; use one of {', '.join(QUANTITIES)}, "
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
    """Read a measured depth from the JSON file `path`, written by `compare`."""
    try:
        content = json.loads(path.read_text("utf-8"))
    except FileNotFoundError:
        raise Missing(
            f"{path}: no such file; give --to the JSON file that compare writes, or "
            "worn_depth_max=VALUE"
        ) from None
    except (OSError, ValueError, RecursionError) as error:
        raise PatchfemError(
            f"{path}: this is not the JSON file that compare writes ({error})"
        ) from None

    # Of several depths in the file the first in the order of QUANTITIES is fitted.
    measures = content.get("measures", content) if isinstance(content, dict) else {}
    for name in QUANTITIES:
        try:
            numbers = [float(measures[name][part]) for part in ("value", "low", "high")]
        except (KeyError, TypeError, ValueError):
            continue
        if np.isfinite(numbers).all() and numbers[0] > 0:
            value, low, high = numbers
            return MeasuredDepth(name, value, max(low, 0.0), high, str(path))

    raise PatchfemError(
        f"{path}: the file contains no worn depth above zero; compare writes a depth only if the "
        "traces have a common reference"
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

    bounds = ranges[0]
    # The measured depth needs a patch without earlier wear
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

    # one run with the largest coefficient gives the depth for all smaller ones
    curve = compute(bounds.high)
    max_depth = curve.depth[-1]
    if not max_depth >= target.value:
        raise PatchfemError(
            f"--free {COEFFICIENT_KEY}: with the high bound {bounds.high:.4g} m^2/N the scene reaches only "
            f"{target.name} = {max_depth:.4g}, but {target.value:.4g} was measured; raise the high bound, "
            "unless the coating is worn through"
        )

    # the interpolated coefficient is corrected until a run with it has the measured depth
    is_growing = np.diff(curve.depth, prepend=-1.0) > 0
    inverse = PchipInterpolator(
        curve.depth[is_growing], curve.fraction[is_growing], extrapolate=False
    )
    value = float(bounds.high * inverse(target.value))

    n_runs = 1
    while n_runs < MAX_RUNS:
        n_runs += 1
        computed_depth = compute(value).depth[-1]
        error = abs(computed_depth / target.value - 1)
        if error <= DEPTH_TOL * model.accuracy.tolerance:
            break
        value *= float(inverse(target.value) / inverse(computed_depth))
    else:
        raise NotConverged(
            f"fit {COEFFICIENT_KEY}: after {MAX_RUNS} runs the fit has reached only {target.name} = "
            f"{computed_depth:.6g} in place of {target.value:.6g}"
        )

    if value < bounds.low:
        raise PatchfemError(
            f"--free {COEFFICIENT_KEY}: {target.name} = {target.value:.4g} needs a coefficient of {value:.4g} "
            f"m^2/N, which is below the low bound {bounds.low:.4g}; lower this bound"
        )

    # The depth depends nearly on coefficient times cycles alone, so the curve turns the interval of the depth into that
    # of the coefficient. The error of the computed depth adds to both sides, by the slope of the curve.
    middle = float(inverse(target.value))
    low, high = inverse(np.minimum([target.low, target.high], max_depth)) / middle
    area = float(nodal_areas(model.patch, patch.pieces.interface).sum())
    model_error = _estimate_depth_error(model, value, target, area, progress)
    error = (model_error or 0.0) * float(inverse.derivative()(target.value)) / middle
    return FittedCoefficient(
        value=value,
        low=float(value * max(low - error, 0.0)),
        high=float(value * (high + error)),
        measured=target,
        model=Measure(computed_depth, "m", model_error),
        bounds=bounds,
        runs=n_runs + 1,
        curve=np.array([bounds.high * curve.fraction, curve.depth]),
    )


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
        [m]; None if the run has no error.
    """
    model = replace(model, wear=replace(model.wear, coefficient=coefficient))
    try:
        result = run(model, progress=progress)
    except (NotConverged, Missing):
        return None

    # the mean depth is the worn volume over the area
    name = target.name
    divisor = 1.0
    if name != MAX_DEPTH:
        name = "worn_volume"
        divisor = area
    measure = result.measures.get(name)
    if measure is None or measure.error is None:
        return None
    return float(abs(measure.value / divisor - target.value) + measure.error / divisor)


def _compute_wear_curve(model: Model, patch, coefficient: float, name: str, progress) -> WearCurve:
    """Compute the wear depth of a model over the cycles for a wear coefficient [m2/N].

    `patch` is the solved contact of the unworn pieces, `name` one of QUANTITIES, and `progress` is called with the
    progress, or None.
    """
    model = replace(model, wear=replace(model.wear, coefficient=coefficient))
    worn = evolve.compute_wear(model, patch, (None, None), progress)
    if worn.stopped:
        raise PatchfemError(f"fit {COEFFICIENT_KEY}: {worn.stopped}")
    area = nodal_areas(model.patch, patch.pieces.interface).ravel()
    depths = np.array([moment.depth.ravel() for moment in worn.moments])
    depth = depths.max(axis=1) if name == MAX_DEPTH else depths @ area / area.sum()
    fraction = np.array([moment.cycle for moment in worn.moments]) / model.wear.cycles
    return WearCurve(fraction, depth)
