"""The wear coefficient that explains a measured depth, with the interval of the measurement.

Worn depth depends on the coefficient and the cycles by their product alone, so one run at the largest coefficient
gives the depth for all smaller ones. The value read off it is then run itself and corrected.
"""

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from ..core import Missing, NotConverged, PatchfemError
from ..model.model import Model
from ..runs.patch import ladder
from ..runs.patch.press import areas
from ..runs.wear import evolve
from ..scene.keys.quantities import parse
from ..scene.ranges import Range, ranges
from ..scene.scene import SceneError

QUANTITIES = ("worn_depth_mean", "worn_depth_max")  # as compare's JSON names them, the better known first
MOST_RUNS = 6
LARGEST = 1 << 20  # bytes of a file of compare
KEY = "wear.coefficient"


@dataclass(frozen=True, slots=True)
class Measured:
    """A measured depth [m], by name, with its interval low..high; where: its source."""

    name: str
    value: float
    low: float
    high: float
    where: str


@dataclass(frozen=True, slots=True)
class Coefficient:
    """A wear coefficient [m2/N] with its interval; model: what the scene gives with it, of the measured quantity;
    bounds: of the search; runs: how many wear runs it took."""

    value: float
    low: float
    high: float
    measured: Measured
    model: float
    bounds: Range
    runs: int


def measured_of(text: str) -> Measured:
    """A measured quantity from "worn_depth_max=2.5 um..3.5 um" (or one value), or from a file of `compare --json`.

    PatchfemError and Missing name what is wrong.
    """
    name, equals, value = (part.strip() for part in text.partition("="))
    if not equals:
        return _from_file(Path(text))
    if name not in QUANTITIES:
        raise PatchfemError(f"--to {text}: {name} is not a possible quantity; use one of {', '.join(QUANTITIES)}, such "
                            'as "worn_depth_max=2.5 um..3.5 um", or the JSON file that compare writes')
    try:
        ends = [parse(part.strip(), "length") for part in value.split("..")]
    except ValueError as error:
        raise PatchfemError(f"--to {name}: {error}") from None
    if len(ends) > 2 or not 0 < ends[0] <= ends[-1]:
        raise PatchfemError(f"--to {text}: give one value above zero, or a range low..high above zero")
    return Measured(name, (ends[0] + ends[-1]) / 2, ends[0], ends[-1], "--to")


def _from_file(path: Path) -> Measured:
    try:
        if path.stat().st_size > LARGEST:
            raise PatchfemError(f"{path}: the file is larger than {LARGEST} bytes; give the JSON file that compare "
                                "writes")
        found = json.loads(path.read_text("utf-8"))
    except FileNotFoundError:
        raise Missing(f"{path}: no such file; give --to the JSON file that compare writes, or "
                      "worn_depth_max=VALUE") from None
    except (OSError, ValueError, RecursionError) as error:
        raise PatchfemError(f"{path}: this is not the JSON file that compare writes ({error})") from None
    found = found.get("measures", found) if isinstance(found, dict) else {}
    for name in QUANTITIES:
        one = found.get(name) if isinstance(found, dict) else None
        parts = [one.get(key) for key in ("value", "low", "high")] if isinstance(one, dict) else [None]
        if all(isinstance(part, (int, float)) and math.isfinite(part) for part in parts) and parts[0] > 0:
            return Measured(name, float(parts[0]), max(float(parts[1]), 0.0), float(parts[2]), str(path))
    raise PatchfemError(f"{path}: the file contains no worn depth above zero; compare writes a depth only if the "
                        "traces have a common reference")


def wear_coefficient(model: Model, to: str, free, progress=None) -> Coefficient:
    """The coefficient of a model with [wear] within free ("wear.coefficient=low..high",) that gives what was measured.

    to: as `measured_of` takes it. PatchfemError where no coefficient in the range does, NotConverged where the runs do
    not settle on one.
    """
    bounds, target = _bounds(free), measured_of(to)
    if model.patch is None:
        raise PatchfemError(f"--to {target.name}: a [normal] contact has no worn depth; use [contact]", "normal")
    if model.wear.start is not None:
        raise PatchfemError(f"fit {KEY}: the fit must start from unworn pieces; leave out wear.start", "wear.start")

    patch = ladder.solve_all(model.patch, model.accuracy.tolerance, False)[0]  # no coefficient changes it
    curve, most = _curve(model, patch, bounds.high, target.name, progress)
    if not curve[1][-1] >= target.value:
        raise PatchfemError(f"--free {KEY}: with the high bound {bounds.high:.4g} m^2/N the scene reaches only "
                            f"{target.name} = "
                            f"{curve[1][-1]:.4g}, but {target.value:.4g} was measured; "
                            + ("with this bound as the coefficient the coating is worn through before the last "
                               "cycle" if curve[0][-1] < 1 else
                               "raise the high bound"))
    inverse = _inverse(curve)
    value, runs, reached = float(bounds.high * inverse(target.value)), 1, math.nan
    while runs < MOST_RUNS:
        runs += 1
        _, reached = _curve(model, patch, value, target.name, progress)
        if abs(reached - target.value) <= 0.1 * model.accuracy.tolerance * target.value:
            break
        value *= float(inverse(target.value) / inverse(reached))
    else:
        raise NotConverged(f"fit {KEY}: after {MOST_RUNS} runs the fit has reached only {target.name} = {reached:.6g} "
                           f"in place of {target.value:.6g}")
    if value < bounds.low:
        raise PatchfemError(f"--free {KEY}: {target.name} = {target.value:.4g} needs a coefficient of {value:.4g} "
                            f"m^2/N, which is below the low bound {bounds.low:.4g}; lower this bound")
    low, high = (value * inverse(min(end, most)) / inverse(target.value) for end in (target.low, target.high))
    return Coefficient(float(value), float(low), float(high), target, float(reached), bounds, runs)


def _bounds(free) -> Range:
    found, wrong = ranges(free)
    if wrong:
        raise SceneError(wrong)
    if [one.key for one in found] != [KEY]:
        raise PatchfemError(f"--free: in a scene with [wear] only {KEY} can be fitted, for example {KEY}=1e-16 "
                            "m^2/N..1e-12 m^2/N")
    return found[0]


def _curve(model: Model, patch, coefficient: float, name: str, progress) -> tuple:
    """((share of the cycles, quantity) (j,) each, the last quantity) of a model with this coefficient.

    patch: that of the model as it is new.
    """
    model = replace(model, wear=replace(model.wear, coefficient=coefficient))
    found = evolve.evolve(model, patch, (None, None), progress)
    if found.stopped:
        raise PatchfemError(f"fit {KEY}: {found.stopped}")
    area = areas(model.patch, patch.pieces.interface).ravel()
    rows = np.array([one.depth.ravel() for one in found.moments])
    depth = rows.max(axis=1) if name == "worn_depth_max" else rows @ area / area.sum()
    return (np.array([one.cycle for one in found.moments]) / model.wear.cycles, depth), float(depth[-1])


def _inverse(curve: tuple):
    """Share of the cycles as a function of the quantity."""
    share, quantity = curve
    keep = np.concatenate([[True], np.diff(quantity) > 0])
    return PchipInterpolator(quantity[keep], share[keep], extrapolate=False) if keep.sum() > 2 else \
        lambda value: np.interp(value, quantity[keep], share[keep])
