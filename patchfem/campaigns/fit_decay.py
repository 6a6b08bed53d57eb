"""Identification of a joint from frequency and damping over the amplitude: a decay, or any backbone."""

from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np

from ..core import NotConverged, Outcome, PatchfemError
from ..identify.least_squares import Fit, fit
from ..identify.words import remarks
from ..inputs.cells import text_of
from ..inputs.columns import read_columns
from ..model.model import build
from ..model.source import placed
from ..runs import joint
from ..scene.changed import Base
from ..scene.ranges import Range, ranges
from ..scene.scene import Scene, SceneError
from .backbone import backbone
from .fit import own_values

UNITS = {"amplitude": {"m": 1.0, "mm": 1e-3, "um": 1e-6}, "frequency": {"Hz": 1.0}, "damping": {"": 1.0, "1": 1.0}}
HEADER = "decay_amplitude [m],decay_frequency [Hz],decay_damping [1]"
HALVES = 0.5 * np.array([1e-3, 5e-2])  # of frequency and damping, standard deviations of rows without errors
LEAST = 1e-6  # of a value, a standard deviation at least
WAYS = ("balance", "quasi-static")  # the first tells, the last is quick
ROUNDS, SAME = 8, 1e-7  # of the search, until the share of the balance in the static curve changes by less


@dataclass(frozen=True, eq=False, slots=True)
class FittedDecay:
    """A fitted curve: the ranges `free`, `found` in their order; amplitude (k,) [m]; measured, error, model (2, k):
    frequency [Hz] and damping ratio; method: how the model's were found; sets: that make the scene fitted; warnings:
    sentences."""

    scene: Scene
    path: Path
    free: list[Range]
    found: Fit
    amplitude: np.ndarray
    measured: np.ndarray
    error: np.ndarray
    model: np.ndarray
    method: str
    sets: list
    warnings: list
    seconds: float

    @property
    def outcome(self) -> Outcome:
        """How the fit ended."""
        return self.found.outcome


def is_curve(path) -> bool:
    """Whether a file is a table of damping over amplitude, by its header."""
    path = Path(path)
    if path.suffix.lower() != ".csv" or not path.is_file():
        return False
    head = text_of(path, "a measured table").split("\n", 1)[0]
    return "amplitude" in head and "damping" in head


def read_curve(path) -> tuple:
    """(amplitude (k,) [m], frequency [Hz] and damping (2, k), their standard deviations (2, k)) of a table of `import
    --decay`, or of a curve such as one of backbone.csv."""
    units = {f"{before}{name}{after}": unit for before in ("decay_", "") for name, unit in UNITS.items()
             for after in ("", "_error")}
    table = read_columns(path, units, tuple(f"decay_{name} {name}" for name in UNITS), HEADER, "a decay",
                         labels=True)
    if len(set(table.labels.get("method", ("",)))) > 1:
        raise PatchfemError(f"{path}: curves of several methods; keep the rows of one")
    columns = {name.removeprefix("decay_"): one for name, one in table.values.items()}
    value = np.array([columns["frequency"], columns["damping"]])
    spread = np.array([columns[f"{name}_error"] / 2 if f"{name}_error" in columns else half * np.abs(one) for
                       name, half, one in zip(("frequency", "damping"), HALVES, value)])
    if (spread < 0).any():
        raise PatchfemError(f"{path}: an error below 0; give half the width of its interval, or leave the column out")
    if not (columns["amplitude"] > 0).all() or not (value[0] > 0).all():
        raise PatchfemError(f"{path}: amplitudes and frequencies must be above 0")
    order = np.argsort(columns["amplitude"], kind="stable")
    return columns["amplitude"][order], value[:, order], np.maximum(spread, LEAST * np.abs(value))[:, order]


def fit_decay(scene: Scene, to: Path, free, say=None) -> FittedDecay:
    """Fit the keys `free` ("table.key=low..high" texts) of a rig's scene to the curve in the file `to`.

    The model's curve is that of a periodic motion at the same amplitudes, by balance. The values are searched by the
    curve of one static force, which takes a hundredth of the time, times the share of the balance in it at the values
    found before, until that share stays; where one of the two is not known, by the other. Each row counts by its
    error. SceneError and PatchfemError name bad input.
    """
    begin = perf_counter()
    wanted, wrong = ranges(free)
    if wrong:
        raise SceneError(wrong)
    amplitude, measured, error = read_curve(to)
    if 2 * amplitude.size <= len(wanted):
        raise PatchfemError(f"{to}: {amplitude.size} amplitudes cannot determine {len(wanted)} values")
    base, apart = Base(scene), np.unique(amplitude)
    ways = _known(scene, apart)
    if say:
        say(f"{amplitude.size} amplitudes by {' and '.join(ways)}")

    def curve(values, method: str) -> np.ndarray:
        sets = [one.assigned(value) for one, value in zip(wanted, values)]
        try:
            model = joint.freed(build(base.changed(sets)))
        except SceneError as wrong_scene:
            raise PatchfemError(wrong_scene.mistakes[0]) from None
        return _curve(model, apart, method)[:, np.searchsorted(apart, amplitude)]

    share, start, starts = np.ones_like(measured), own_values(scene, wanted), 3
    for _ in range(ROUNDS):
        found = fit(lambda values: ((curve(values, ways[-1]) * share - measured) / error).ravel(),  # noqa: B023
                    [one.low for one in wanted], [one.high for one in wanted], start=start, starts=starts,
                    bars="series")
        best = curve(found.values, ways[0])
        before, share = share, best / curve(found.values, ways[-1]) if len(ways) > 1 else share
        if np.abs(share / before - 1).max() < SAME:
            break
        start, starts = found.values, 1
    sets = [one.assigned(value) for one, value in zip(wanted, found.values)]
    return FittedDecay(scene, Path(to), wanted, found, amplitude, measured, error, best, ways[0], sets,
                       [*scene.remarks, *remarks(found, [one.key for one in wanted])], perf_counter() - begin)


def _known(scene: Scene, amplitude) -> list:
    """The ways of WAYS that give the scene's own curve; PatchfemError with the reasons where none does."""
    found, reasons, model = [], [], joint.freed(build(scene))
    for method in WAYS:
        try:
            _curve(model, amplitude, method)
            found.append(method)
        except (NotConverged, PatchfemError) as reason:
            reasons.append(f"{method}: {reason}")
    if not found:
        raise PatchfemError(f"no curve of the scene is known; {'; '.join(reasons)}")
    return found


def _curve(model, amplitude, method: str) -> np.ndarray:
    """Frequency [Hz] and damping ratio (2, k) at rising amplitudes (k,) [m]."""
    with placed(model.source):
        found = backbone(model, "", amplitude, (method,))
    if method not in found.curves:
        raise PatchfemError(found.missing[method])
    one = found.curves[method]
    if one.amplitude.size != amplitude.size:
        lost = ", ".join(f"{a:.3g} m" for a in np.setdiff1d(amplitude, one.amplitude)[:6])
        raise PatchfemError(f"the model's mode does not oscillate at {lost}; leave out these rows, or narrow --free")
    return np.array([one.frequency, one.damping])
