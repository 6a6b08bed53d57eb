"""Numerical error against computing time, for several tolerances or values of a setting.

In: a model, and the setting that varies. Out: a list of `Cost`, one per run, and sentences about the
cheapest setting that meets a tolerance.

Read `compute_tolerance_costs` first. It runs the model at several tolerances. If a run misses its
tolerance, the setting that its warnings propose is tried. `compute_setting_costs` varies a single
setting.

Times are CPU seconds of this process and its child processes, which are hardly affected by other
programs.
"""

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from time import perf_counter, process_time
from typing import NamedTuple

from ..compiled import cache_folder
from ..core import NotConverged, PatchfemError, compute_allowed_error
from ..formatting import format_number
from ..model.model import Model
from ..model.source import locate_errors
from ..runs.patch.mesh_levels import solve_on_split_mesh
from ..runs.plan import plan
from ..runs.run import run as run_plan
from .numerical_settings import (
    Setting,
    find_applicable_settings,
    list_tolerances,
    make_setting_values,
    with_accuracy_key,
)

# Name of the setting for a curve over tolerances, in addition to NUMERICAL_SETTINGS.
TOLERANCE = "tolerance"
# Number of timings of a short run; the shortest one is used, because disturbances only add time.
N_TIMINGS = 3
# Smallest CPU time [s] of a run that is timed only once; longer runs scatter by a few percent.
MIN_SECONDS_TIMED_ONCE = 0.3
# Largest total CPU time [s] of runs with proposed settings.
MAX_TRIAL_SECONDS = 10.0
# Pattern of the advice at the end of a warning about a missed tolerance.
_REMEDY_TEXT = re.compile(r"; the tolerance is [^;]*; (.*)", re.DOTALL)
_PROPOSED_SETTING = re.compile(
    r"(?:set|.*try) accuracy\.(steps_per_cycle|shear_modes|harmonics) = (\d+)"
)
# Smallest ratio of elapsed to CPU time at which both times are reported.
MIN_ELAPSED_TO_CPU_RATIO = 1.5
EQUAL_COST_RATIO = 1.1  # Largest ratio of the CPU times of equally expensive runs.
TIMING_SCATTER = 2e-3  # Scatter of the CPU time of repeated short runs [s].
# A setting is ineffective if the ratio of its smallest to its largest error exceeds this value.
NO_EFFECT_RATIO = 0.9
UNCHANGED_TOL = 1e-11  # Largest relative change of an unaffected measure.
# Largest change of a measure by round-off, as a fraction of its floor.
ROUND_OFF_FRACTION = 1e-6


@dataclass(frozen=True, eq=False, slots=True)
class Cost:
    """Run with a given value of a numerical setting: CPU time, measures and errors.

    Attributes
    ----------
    label : str
        Label of the setting, or of all settings with identical results.
    value : float or None
        Value of the setting in SI; None if it follows from the tolerance of the scene.
    words : str
        Description of the setting for use in a sentence.
    seconds : float
        CPU time of the run with its error estimates [s], the smallest of `timings` timings.
    wall_seconds : float
        Elapsed time of the same timing [s].
    timings : int
        Number of timings.
    values : dict
        Value of each measure.
    errors : dict
        Error estimate of each measure, in the unit of its value.
    floors : dict
        Absolute floor of the allowed error of each measure.
    distances : dict
        Absolute difference of each measure to the best run; empty for the best run.
    tolerance : float
        Tolerance of the run.
    remedies : tuple of str
        Advice from the warnings of a run that misses its tolerance.
    steps : int or None
        Number of time steps per cycle; None if the method takes no time steps.
    nodes : int or None
        Number of nodes of the interface; None without a patch.
    """

    label: str
    value: float | None
    words: str
    seconds: float
    wall_seconds: float
    timings: int
    values: dict
    errors: dict
    floors: dict
    distances: dict
    tolerance: float = 0.0
    remedies: tuple = ()
    steps: int | None = None
    nodes: int | None = None

    def meets_tolerance(self) -> bool:
        """Return whether every error estimate is within the tolerance of the run."""
        errors = self.errors.items()
        return all(self._is_allowed_error(name, error, self.tolerance) for name, error in errors)

    def known_error(self, name: str) -> float | None:
        """Return the known error of a measure; None if it is unknown.

        It is the larger one of the error estimate and the difference to the best run.
        """
        known = [errors[name] for errors in (self.errors, self.distances) if name in errors]
        return max(known, default=None)

    def needs_elapsed_time(self) -> bool:
        """Return whether the elapsed time must be reported because it far exceeds the CPU time."""
        return self.wall_seconds > MIN_ELAPSED_TO_CPU_RATIO * self.seconds

    def has_same_results(self, other) -> bool:
        """Return whether two numerical settings gave bit-identical results."""
        if None in (self.value, other.value):
            return False
        return (self.values, self.errors) == (other.values, other.errors)

    def is_within_tolerance(self, name: str, tolerance: float) -> bool:
        """Return whether the error of a measure is at most tolerance x |value| + floor."""
        error = self.known_error(name)
        return error is not None and self._is_allowed_error(name, error, tolerance)

    def _differs_from_best(self, name: str, relative_change: float, floor_fraction: float) -> bool:
        """Return whether a measure differs from the best run by more than an allowed change."""
        if name not in self.values:
            return False
        size = relative_change * abs(self.values[name])
        return self.distances.get(name, 0.0) > max(size, floor_fraction * self.floors[name])

    def _is_allowed_error(self, name: str, error: float, tolerance: float) -> bool:
        """Return whether an error of a measure is at most tolerance x |value| + floor."""
        return error <= compute_allowed_error(tolerance, self.values[name], self.floors[name])


def compute_tolerance_costs(model: Model, say=None) -> list:
    """Run a model at several tolerances, including that of its scene.

    Parameters
    ----------
    model : Model
    say : callable, optional
        Called with a line of text for each run.

    Returns
    -------
    list of Cost
        From the largest to the smallest tolerance. A run that misses its tolerance is followed by
        runs with proposed settings, which have the same `tolerance`.

    Raises
    ------
    NotConverged
        If no run succeeds.
    """
    with locate_errors(model.source):
        settings = list_tolerances(model)
        # The first run includes imports and compilation, which the timings must not contain.
        _run_setting(settings[0], "first run, not timed", None)
        runs = []
        trial_seconds = 0.0
        for setting in settings:
            cost = _time_setting(setting, say)
            while cost is not None:
                if runs and cost.has_same_results(runs[-1]):
                    # The shorter time is valid for both runs, because they are identical.
                    faster = min(runs[-1], cost, key=lambda run: run.seconds)
                    runs[-1] = _replace_timing(runs[-1], faster)
                    cost = _replace_timing(cost, faster)
                runs.append(cost)
                if cost.meets_tolerance():
                    break
                setting = _find_proposed_setting(setting, cost, MAX_TRIAL_SECONDS - trial_seconds)
                if setting is None:
                    break
                cost = _time_setting(setting, say)
                trial_seconds += cost.seconds if cost is not None else 0.0
    if not runs:
        raise NotConverged("cost: no run of this scene succeeded", "")
    return runs


def _replace_timing(cost: Cost, other: Cost) -> Cost:
    """Return a run with the CPU time and the elapsed time of another run."""
    return replace(cost, seconds=other.seconds, wall_seconds=other.wall_seconds)


def _find_proposed_setting(setting: Setting, cost: Cost, max_seconds: float) -> Setting | None:
    """Return the numerical setting that the warnings of a run propose; None if they propose none.

    Returns None if no warning proposes a larger value than the current one, or if the run would take
    more than `max_seconds`.

    Parameters
    ----------
    setting : Setting
        Setting of the run.
    cost : Cost
        Finished run.
    max_seconds : float
        Largest CPU time of the next run [s].
    """
    for remedy in cost.remedies:
        proposal = _PROPOSED_SETTING.match(remedy)
        if proposal is None:
            continue
        key = proposal[1]
        count = int(proposal[2])
        current = getattr(setting.model.accuracy, key)
        if not current and key == "steps_per_cycle":
            current = cost.steps
        current = current or 1
        # The time of a run is about proportional to its number of steps, modes or harmonics.
        if current < count and cost.seconds * count / current <= max_seconds:
            label = f"{cost.tolerance:g}, {count} {key.replace('_', ' ')}"
            model = with_accuracy_key(setting.model, key, count)
            return Setting(label, cost.tolerance, f"tolerance {label}", model)
    return None


def compute_setting_costs(model: Model, setting_name: str, say=None) -> list:
    """Run a model with several values of a numerical setting, from coarse to fine.

    Parameters
    ----------
    model : Model
    setting_name : str
        One of NUMERICAL_SETTINGS, or TOLERANCE.
    say : callable, optional
        Called with a line of text for each run.

    Returns
    -------
    list of Cost
        Consecutive identical runs are merged. The automatic setting follows after the fixed values.

    Raises
    ------
    PatchfemError
        If the scene does not have this setting, or if fewer than three runs succeed.
    """
    if setting_name == TOLERANCE:
        return compute_tolerance_costs(model, say)
    with locate_errors(model.source):
        possible = find_applicable_settings(model)
        if setting_name not in possible:
            raise PatchfemError(
                f"cost --over {setting_name}: the cost of this setting cannot be measured for this scene; "
                f"possible settings: {', '.join(possible) or 'none'}",
                "",
            )
        settings = make_setting_values(model, setting_name)
        # The first run includes imports and compilation, which the timings must not contain.
        _run_setting(settings[0], "first run, not timed", None)
        runs: list = []
        n_succeeded = 0
        for setting in settings:
            is_last = setting is settings[-1]
            cost = _time_setting(setting, say, runs[-1:], can_split=not is_last)
            if cost is None:
                continue
            n_succeeded += 1
            if runs and cost.has_same_results(runs[-1]):
                runs[-1] = _merge_identical_runs(runs[-1], cost)
            else:
                runs.append(cost)
        if n_succeeded < 3:
            raise PatchfemError(
                f"cost --over {setting_name}: runs with fewer than three values of this setting succeeded",
                "",
            )
    best = _find_best_run(runs)
    others = [replace(run, distances=_compute_distances(run, best)) for run in runs]
    return [best if run is best else other for run, other in zip(runs, others)]


def _find_best_run(runs: list) -> Cost:
    """Return the reference run: that of the finest value or that of the automatic setting.

    Of these two runs, it is the one whose least accurate measure has the smaller error estimate.
    """
    last = runs[-1]
    if last.value is not None:
        return last
    finest = runs[-2]
    common_names = last.errors.keys() & finest.errors.keys()
    return min(
        (last, finest),
        key=lambda run: find_worst_error(run, common_names, run.tolerance).fraction,
    )


def _compute_distances(cost: Cost, best: Cost) -> dict:
    """Return the absolute difference of each measure between a run and the best run."""
    common_names = [name for name in cost.values if name in best.values]
    return {name: abs(cost.values[name] - best.values[name]) for name in common_names}


def _merge_identical_runs(first: Cost, second: Cost) -> Cost:
    """Merge the runs of two settings with identical results into one run with both labels.

    The description in a sentence is the shorter one, which is that of the automatic setting.
    """
    faster = min(first, second, key=lambda run: run.seconds)
    return replace(
        _replace_timing(first, faster),
        label=f"{first.label}, {second.label.removeprefix('tolerance ')}",
        words=min(first.words, second.words, key=len),
        timings=first.timings + second.timings,
    )


def _time_setting(
    setting: Setting, say, previous_runs=(), *, can_split: bool = True
) -> Cost | None:
    """Run a model with a numerical setting several times; return its cost, or None if it fails.

    The run is timed N_TIMINGS times; once if it is long and nothing was compiled, or if its results
    are identical to those of a previous run. None if the run fails.

    Parameters
    ----------
    setting : Setting
    say : callable or None
        Called with a line of text.
    previous_runs : sequence of Cost
        Previous runs whose results may be identical.
    can_split : bool
        Whether the mesh of a file may be refined once more for its error estimate.
    """
    timings = []
    cost = None
    identical_runs: list = []
    while cost is None or (len(timings) < N_TIMINGS and not identical_runs):
        n_compiled = _count_compiled_functions()
        begin = (_measure_cpu_time(), perf_counter())
        finished = _run_setting(setting, setting.label, say, can_split=can_split)
        if finished is None:
            return None
        timings.append((_measure_cpu_time() - begin[0], perf_counter() - begin[1]))
        cost = _make_cost(setting, timings, finished)
        identical_runs = [run for run in previous_runs if cost.has_same_results(run)]
        if cost.seconds >= MIN_SECONDS_TIMED_ONCE and _count_compiled_functions() == n_compiled:
            break
    if say is not None:
        text = f"{cost.words}: {cost.seconds:.2f} CPU s"
        if cost.needs_elapsed_time():
            text += f" ({cost.wall_seconds:.2f} s elapsed)"
        for run in identical_runs:
            text += f", the same run as with {run.words}"
        if not identical_runs and cost.timings == 1:
            text += ", timed once"
        say(text)
    return cost


class _FinishedRun(NamedTuple):
    """Measures, warnings, number of steps per cycle and number of interface nodes of a finished run.

    The number of steps is None if the method takes no time steps, and that of nodes without a patch.
    """

    measures: dict
    warnings: Sequence
    steps: int | None = None
    nodes: int | None = None


def _make_cost(setting: Setting, timings: list, finished: _FinishedRun) -> Cost:
    """Return the cost of a setting from its pairs of CPU time and elapsed time [s]."""
    values = {}
    errors = {}
    floors = {}
    for name, measure in finished.measures.items():
        if measure.value is not None:
            values[name] = measure.value
            floors[name] = measure.floor
            if measure.error is not None:
                errors[name] = measure.error
    remedies = [remedy[1] for remedy in map(_REMEDY_TEXT.search, finished.warnings) if remedy]
    seconds, wall_seconds = min(timings)
    return Cost(
        label=setting.label,
        value=setting.value,
        words=setting.words,
        seconds=seconds,
        wall_seconds=wall_seconds,
        timings=len(timings),
        values=values,
        errors=errors,
        floors=floors,
        distances={},
        tolerance=setting.model.accuracy.tolerance,
        remedies=tuple(remedies),
        steps=finished.steps,
        nodes=finished.nodes,
    )


def _measure_cpu_time() -> float:
    """Return the CPU time [s] of this process and its finished child processes."""
    children = os.times()
    return process_time() + children.children_user + children.children_system


def _count_compiled_functions() -> int:
    """Return the number of compiled functions in the cache.

    An increase shows that a run has compiled a function.
    """
    try:
        return len(os.listdir(cache_folder() / "code"))
    except OSError:
        return 0


def _run_setting(
    setting: Setting, label: str, say, *, can_split: bool = True
) -> _FinishedRun | None:
    """Run a model with a numerical setting; return None if the run fails.

    A run fails if it does not converge or runs out of memory. The pieces are condensed again instead
    of being loaded from the cache.
    """
    try:
        if setting.level:
            fine, *_ = solve_on_split_mesh(setting.model.patch, setting.level, can_split)
            return _FinishedRun(fine.measures, ())
        result = run_plan(plan(setting.model), fresh=True)
        steps = result.extra.get("steps_per_cycle") or result.extra.get("steps")
        nodes = None if result.patch is None else int(result.patch.x.size)
        return _FinishedRun(result.measures, result.warnings, steps, nodes)
    except (NotConverged, MemoryError) as error:
        if say is not None:
            say(f"{label}: left out ({error or 'out of memory'})")
        return None


def find_affected_measures(runs: list) -> list:
    """Return the names of the measures that depend on the numerical setting.

    A measure counts as dependent if it changes by more than UNCHANGED_TOL times its value, and by more
    than the round-off of its floor.
    """
    names = []
    for name in runs[0].values:
        if any(run._differs_from_best(name, UNCHANGED_TOL, ROUND_OFF_FRACTION) for run in runs):
            names.append(name)
    return names


def find_fastest_settings(runs: list, tolerance: float) -> dict:
    """Return, for each measure, the label of the fastest run whose error is within the tolerance, or None.

    A coarse run that is accurate by chance is excluded: all finer runs must meet the tolerance as well.
    """
    labels = {}
    for name in find_affected_measures(runs):
        confirmed = _select_confirmed_runs(runs, [name], tolerance)
        fastest = min(confirmed, key=lambda run: run.seconds, default=None)
        labels[name] = None if fastest is None else fastest.label
    return labels


def _select_confirmed_runs(runs: list, names: Sequence, tolerance: float) -> list:
    """Select the runs that meet a tolerance, provided that all finer runs meet it as well.

    The run with the automatic setting is judged independently of the others.

    Parameters
    ----------
    runs : list of Cost
    names : sequence of str
        Names of measures, which need not exist in every run.
    tolerance : float
    """

    def is_accurate(run: Cost) -> bool:
        """Return whether the named measures of a run are within the tolerance."""
        return all(run.is_within_tolerance(name, tolerance) for name in names if name in run.values)

    confirmed = []
    for run in reversed([run for run in runs if run.value is not None]):
        # Without error estimates, the best run only serves as the reference of the others.
        if not run.errors and not run.distances:
            continue
        if not is_accurate(run):
            break
        confirmed.append(run)
    return confirmed + [run for run in runs if run.value is None and is_accurate(run)]


def find_fastest_run(runs: list, tolerance: float) -> Cost | None:
    """Return the run with the shortest CPU time that meets a tolerance; None if no run meets it.

    Among equally expensive runs, the one with the coarsest setting is returned.
    """
    confirmed = _select_confirmed_runs(runs, find_measures_with_error(runs), tolerance)
    shortest = min((run.seconds for run in confirmed), default=inf)
    for run in runs:
        if run in confirmed and run.seconds <= EQUAL_COST_RATIO * shortest + TIMING_SCATTER:
            return run
    return None


def describe_fastest_setting(runs: list, tolerance: float) -> str:
    """Describe the fastest setting that meets a tolerance, or the measure that misses it.

    If no setting meets the tolerance, the description contains the worst measure of the best run.
    """
    names = find_measures_with_error(runs)
    fastest = find_fastest_run(runs, tolerance)
    if fastest is not None:
        cost = f"{_format_cpu_time(fastest)} per run"
        if len(runs) > 1 and not _setting_has_effect(runs, tolerance):
            return (
                f"this setting changes no result by more than the tolerance {tolerance:g}; fastest in these timings: "
                f"{fastest.words}, {cost}"
            )
        return f"{fastest.words}: {cost}, with every measure within the tolerance {tolerance:g}"
    known = [run for run in runs if run.errors or run.distances]
    best = min(known, key=lambda run: find_worst_error(run, names, tolerance))
    worst = find_worst_error(best, names, tolerance)
    size = format_number(worst.fraction, 2)
    sizes = []
    for run in known:
        if worst.name in run.values:
            sizes.append(find_worst_error(run, [worst.name], tolerance).fraction)
    if worst.fraction >= NO_EFFECT_RATIO * max(sizes):
        return (
            f"no setting meets the tolerance {tolerance:g}: with every setting the error of {worst.name} is "
            f"{size}"
        )
    return (
        f"no setting meets the tolerance {tolerance:g}: the best run, with {best.words}, has an error of "
        f"{size} in {worst.name} and takes {_format_cpu_time(best)}"
    )


def _setting_has_effect(runs: list, tolerance: float) -> bool:
    """Return whether any result differs from that of the best run by more than the tolerance."""
    names = find_affected_measures(runs)
    for run in runs:
        for name in names:
            distance = run.distances.get(name, 0.0)
            if name in run.values and not run._is_allowed_error(name, distance, tolerance):
                return True
    return False


def _format_cpu_time(run: Cost) -> str:
    """Format the CPU time of a run with two digits."""
    return f"{format_number(run.seconds, 2)} CPU s"


class WorstError(NamedTuple):
    """Measure with the largest error of a run, relative to the error that the tolerance allows.

    fraction: error over the allowed error at a tolerance of 1, to be compared with the tolerance;
    name: name of the measure, "" if no error is known.
    """

    fraction: float
    name: str


def find_worst_error(run: Cost, names: Sequence, tolerance: float) -> WorstError:
    """Find the measure with the largest error relative to a tolerance.

    Parameters
    ----------
    run : Cost
    names : sequence of str
        Names of the measures to compare.
    tolerance : float

    Returns
    -------
    WorstError
    """
    worst = WorstError(0.0, "")
    for name in names:
        error = run.known_error(name)
        if error:
            size = abs(run.values[name]) + run.floors[name] / tolerance
            worst = max(worst, WorstError(error / size if size else inf, name))
    return worst


def find_worst_run_error(run: Cost) -> WorstError:
    """Find the measure of a run with the largest error relative to the tolerance of the run."""
    return find_worst_error(run, list(run.values), run.tolerance)


def find_measures_with_error(runs: list) -> list:
    """Return the measures with an error estimate in any run; all measures if there is none."""
    names = list(runs[-1].values)
    return [name for name in names if any(name in run.errors for run in runs)] or names
