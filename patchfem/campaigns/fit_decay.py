"""Identification of a joint from frequency and damping over the amplitude: a decay, or any backbone."""

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from time import perf_counter

import numpy as np

from ..core import NotConverged, Outcome, PatchfemError, frozen_array
from ..core import say as words
from ..identify.least_squares import Fit, fit
from ..identify.space import space, spread_points
from ..identify.two_models import TwoModels
from ..identify.words import remarks
from ..inputs.cells import text_of
from ..inputs.columns import read_columns
from ..model.model import build
from ..model.source import placed
from ..response.errors import error_of_change
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
STARTS = 6  # of the search, unless given
OTHERS = 8  # values tried besides the scene's own, until a curve is known
SECONDS = 10.0  # from line to line of progress


@dataclass(frozen=True, eq=False, slots=True)
class FittedDecay:
    """A fitted curve: the ranges `free`, `found` in their order; amplitude (k,) [m]; measured, error, model (2, k):
    frequency [Hz] and damping ratio; method: how the model's were found; sets: that make the scene fitted; warnings:
    sentences; notes: sentences on what is compared, and on what the intervals have of the modes left out."""

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
    notes: tuple = ()

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
    table = _table(path)
    if len(set(table.labels.get("method", ("",)))) > 1:
        raise PatchfemError(f"{path}: the file contains the curves of several methods; keep the rows of one method "
                            "only")
    columns = {name.removeprefix("decay_"): one for name, one in table.values.items()}
    value = np.array([columns["frequency"], columns["damping"]])
    spread = np.array([columns[f"{name}_error"] / 2 if f"{name}_error" in columns else half * np.abs(one) for
                       name, half, one in zip(("frequency", "damping"), HALVES, value)])
    if (spread < 0).any():
        raise PatchfemError(f"{path}: errors must be 0 or more; of a value with a confidence interval, give half the "
                            "width of this interval as the error, or leave out the column of errors")
    if not (columns["amplitude"] > 0).all() or not (value[0] > 0).all():
        raise PatchfemError(f"{path}: amplitudes and frequencies must be above 0")
    order = np.argsort(columns["amplitude"], kind="stable")
    return columns["amplitude"][order], value[:, order], np.maximum(spread, LEAST * np.abs(value))[:, order]


def _table(path):
    units = {f"{before}{name}{after}": unit for before in ("decay_", "") for name, unit in UNITS.items()
             for after in ("", "_error")}
    return read_columns(path, units, tuple(f"decay_{name} {name}" for name in UNITS), HEADER, "a decay", labels=True)


def fit_decay(scene: Scene, to: Path, free, say=None, starts: int = STARTS) -> FittedDecay:
    """Fit the keys `free` ("table.key=low..high" texts) of a rig's scene to the curve in the file `to`.

    The model's curve is that of a periodic motion at the same amplitudes, by balance. The values are searched by the
    curve of one static force, which takes a hundredth of the time, made to touch the balance (`identify.two_models`);
    where this does not settle, by the balance itself; where one of the two is not known, by the other. Each row counts
    by its error. Of a reduced structure the intervals contain what more of its modes change. Values at which the mode
    does not oscillate at all amplitudes are passed over; rows that only the balance lacks have its share of the nearest
    row, with a warning. starts: of the search by the static curve. SceneError and PatchfemError name bad input.
    """
    begin = perf_counter()
    wanted, wrong = ranges(free)
    if wrong:
        raise SceneError(wrong)
    amplitude, measured, error = read_curve(to)
    if 2 * amplitude.size <= len(wanted):
        raise PatchfemError(f"{to}: {amplitude.size} amplitudes are too few to determine {len(wanted)} values; at "
                            f"least {len(wanted) // 2 + 1} are needed")
    base, apart, said, count = Base(scene), np.unique(amplitude), begin, 0

    @lru_cache(8)
    def computed(values: tuple, method: str) -> np.ndarray:
        nonlocal said, count
        if say and perf_counter() - said >= SECONDS:
            said = perf_counter()
            say(f"{count} curves of the model computed in {said - begin:.0f} s")
        count += 1
        sets = [one.assigned(value) for one, value in zip(wanted, values)]
        try:
            model = joint.freed(build(base.changed(sets)))
        except SceneError as wrong_scene:
            raise PatchfemError(wrong_scene.mistakes[0]) from None
        return _curve(model, apart, method)[:, np.searchsorted(apart, amplitude)]

    def curve(values, method: str) -> np.ndarray:
        return computed(tuple(map(float, values)), method)

    def quick(values) -> np.ndarray:
        found = curve(values, ways[-1])
        if (lost := np.isnan(found[0])).any():
            raise PatchfemError("the mode of the model does not oscillate at the amplitudes "
                                f"{_listed(amplitude[lost])}; leave out these rows, or narrow the ranges of --free")
        return found

    def balanced(values) -> np.ndarray:
        found, beside = curve(values, ways[0]), curve(values, ways[-1])
        return np.where(np.isnan(found), beside * _nearest(found / beside, amplitude), found)

    def off(one) -> np.ndarray:
        return ((one - measured) / error).ravel()

    start, box = own_values(scene, wanted), space([one.low for one in wanted], [one.high for one in wanted])
    ways = _known(curve, [start, *map(box.values, spread_points(OTHERS, len(start)))])
    if say:
        say(f"{amplitude.size} amplitudes computed by {' and '.join(ways)}")
    model = quick
    if len(ways) > 1:
        try:
            model, start = TwoModels(quick, balanced, off, box).searched(start, starts)
        except NotConverged:
            raise
        except PatchfemError as reason:
            raise PatchfemError("with the fitted values harmonic balance finds no oscillation at the amplitudes "
                                f"{_listed(amplitude)}: "
                                f"{reason}; leave out the rows with the largest damping, or narrow the ranges of "
                                "--free") from None
        model, starts = model or balanced, 1
    found = fit(lambda values: off(model(values)), box.low, box.high, start=start, starts=starts, bars="series")
    best, lost = model(found.values), amplitude[np.isnan(curve(found.values, ways[0])[0])]
    warned = [f"harmonic balance found no oscillation at the amplitudes {_listed(lost)}; there, the values of the "
              "static curve are used, multiplied by the ratio of the two methods at the nearest amplitude at which "
              "both have a value"] if lost.size else []
    sets = [one.assigned(value) for one, value in zip(wanted, found.values)]
    notes = _compared(to, ways[0], amplitude, measured[1])

    def moved(change) -> np.ndarray:
        return np.abs(fit(lambda values: off(model(values) + change), box.low, box.high, start=found.values, starts=1,
                          bars="").values - found.values)

    richer = _of_more_modes(joint.freed(build(base.changed(sets))), apart, ways[0])
    if richer is not None:
        rows = np.searchsorted(apart, amplitude)
        found, more = _widened(found, box, richer if isinstance(richer, str) else richer[:, rows], moved,
                               curve(found.values, ways[0]), [one.key for one in wanted])
        notes += more
    return FittedDecay(scene, Path(to), wanted, found, amplitude, measured, error, best, ways[0], sets,
                       [*scene.remarks, *warned, *remarks(found, [one.key for one in wanted])], perf_counter() - begin,
                       notes)


def _compared(path, method: str, amplitude, damping) -> tuple:
    """Sentences on what is compared, where the curve in a file is not itself found by a method."""
    label = (*_table(path).labels.get("method", ()), "decay")[0]
    if label == method:
        return ()
    k = int(np.argmax(damping))
    lost = -np.expm1(-2 * np.pi * damping[k])
    return (f"the measured curve is compared with the curve by {method} at the same amplitudes, not with a computed "
            f"decay; a decay gives mean values over a cycle, so the two differ most where the damping is largest: at "
            f"{words(amplitude[k], 3)} one cycle reduces the amplitude by {100 * lost:.2g} %. The intervals do not "
            "contain this difference; `patchfem backbone scene.fitted.toml` computes both curves",)


def _of_more_modes(model, amplitude, method: str):
    """The curve (2, k) of more modes of a reduced structure, or why there is none; None of any other structure."""
    if model.rig.richer is None:
        return None
    try:
        return _curve(replace(model, rig=model.rig.richer), amplitude, method)
    except PatchfemError as reason:
        return str(reason)


def _widened(found: Fit, box, richer, moved, own, names) -> tuple:
    """(the Fit with intervals wider by what more modes of the structure change, sentences).

    richer: the curve of more modes (2, k), or why there is none; own: that of the modes (2, k); moved(a change of the
    curve (2, k)) -> how much the values move (n,).
    """
    if isinstance(richer, str):
        return found, (f"the intervals do not contain the error of the modes left out of the structure: {richer}",)
    change = np.nan_to_num(richer - own)
    by = moved(error_of_change(change, ratio=0.5, order=2.0))
    ends = found.intervals + by[:, None] * [-1, 1]
    shares = ", ".join(f"{name} by {_share_of(part, value)}" for name, part, value in zip(names, by, found.values))
    return replace(found, intervals=frozen_array(np.clip(ends, box.low[:, None], box.high[:, None]))), (
        "the intervals contain the error of the modes left out of the structure; a computation with more modes changes "
        f"frequencies by up to {100 * np.nanmax(np.abs(change[0] / own[0])):.2g} % and damping ratios by up to "
        f"{100 * np.nanmax(np.abs(change[1] / own[1])):.2g} %, and moves {shares}",)


def _share_of(part: float, value: float) -> str:
    """A change as a share of a value."""
    return f"{100 * part / abs(value):.2g} %" if value else f"{part:.2g}"


def _known(curve, tried: list) -> list:
    """The ways of WAYS that give a curve(values, way) at the first of some values at which all do, or at which most do;
    PatchfemError with the reasons where none does."""
    reasons, most = [], []
    for values in tried:
        found = []
        for method in WAYS:
            try:
                curve(values, method)
                found.append(method)
            except PatchfemError as reason:
                reasons.append(f"{method}: {reason}")
        most = max(most, found, key=len)
        if len(most) == len(WAYS):
            break
    if not most:
        raise PatchfemError("no curve of frequency and damping could be computed within the ranges of --free; "
                            f"{'; '.join(reasons[:len(WAYS)])}; leave out the rows with the largest damping, or change "
                            "the ranges of --free")
    return most


def _nearest(share, amplitude) -> np.ndarray:
    """Shares (2, k) with those of the row nearest in amplitude (k,) [m] in the rows that are NaN."""
    known = np.flatnonzero(~np.isnan(share[0]))
    return share[:, known[_places(amplitude[known], amplitude)]]


def _places(amplitude, of) -> np.ndarray:
    """Numbers (m,) of the amplitudes (k,) [m] nearest to others (m,) [m], by their ratio."""
    return np.abs(np.log(np.asarray(of)[:, None] / amplitude)).argmin(axis=1)


def _listed(amplitudes) -> str:
    return ", ".join(words(one, 3) for one in amplitudes[:6]) + (", ..." if len(amplitudes) > 6 else "")


def _curve(model, amplitude, method: str) -> np.ndarray:
    """Frequency [Hz] and damping ratio (2, k) at rising amplitudes (k,) [m], NaN where the mode does not oscillate;
    PatchfemError where it does so nowhere."""
    with placed(model.source):
        found = backbone(model, "", amplitude, (method,), errors=False)
    if method not in found.curves:
        raise PatchfemError(found.missing[method])
    one, out = found.curves[method], np.full((2, amplitude.size), np.nan)
    out[:, _places(amplitude, one.amplitude)] = one.frequency, one.damping
    return out
