"""Error of a scene against computing time, over tolerances or values of a numerical setting.

In: a model, and the setting that varies. Out: a list of `Cost`, one per run, and sentences about the
cheapest setting that meets a tolerance.

Read `tolerance_curve` first: it runs the scene at several tolerances, and if a run misses its
tolerance, it tries the setting that the warnings of this run propose. `setting_curve` varies one setting
alone.

Times are CPU seconds of this process and its children, because other work on the machine does not
change them.
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
from ..runs.patch.ladder import solve_on_split_mesh
from ..runs.patch.measures import estimate_static_measures
from ..runs.plan import plan
from ..runs.run import run as run_plan
from .numerical_settings import (
    Setting,
    applicable_settings,
    list_settings,
    with_setting,
    with_tolerance,
)

# Name of the curve over tolerances, which is accepted in addition to NUMERICAL_SETTINGS.
TOLERANCE = "tolerance"
# Number of timings of a short run; the shortest one counts, because other work only adds time.
N_TIMINGS = 3
# CPU time [s] above which a run is timed only once, because its timings differ by a few percent.
MIN_SECONDS_TIMED_ONCE = 0.3
# CPU time [s] that runs with proposed settings may take in total, so that `cost` ends within
# seconds.
MAX_TRIAL_SECONDS = 10.0
# A warning of a run ends with its tolerance and what to do; this second part may name a setting
# that can be tried here.
_REMEDY_TEXT = re.compile(r"; the tolerance is [^;]*; (.*)", re.DOTALL)
_PROPOSED_SETTING = re.compile(
    r"(?:set|.*try) accuracy\.(steps_per_cycle|shear_modes|harmonics) = (\d+)"
)
MIN_ELAPSED_TO_CPU_RATIO = 1.5  # Ratio of elapsed to CPU time above which both times are reported.
EQUAL_COST_RATIO = 1.1  # Ratio of CPU times up to which two runs count as equally expensive.
TIMING_SCATTER = 2e-3  # Difference of the CPU times of repeated runs of a short scene [s].
NO_EFFECT_RATIO = 0.9  # Ratio of smallest to largest error above which a setting does not help.
UNCHANGED_TOL = 1e-11  # Relative change of a measure below which a setting does not affect it.
# Fraction of the floor of a measure below which a change of it is round-off.
ROUND_OFF_FRACTION = 1e-6


@dataclass(frozen=True, eq=False, slots=True)
class Cost:
    """Run of a cost curve: CPU time, measures and errors for a value of a setting.

    Attributes
    ----------
    label : str
        Label of the setting, or of all settings that gave this run bit for bit.
    value : float or None
        Value of the setting in SI; None if the tolerance of the scene chose it.
    words : str
        The setting as part of a sentence.
    seconds : float
        CPU seconds of the whole run with its error estimates: the smallest of `timings` timings.
    wall_seconds : float
        Elapsed seconds in the same timing.
    timings : int
        Number of timings.
    values : dict
        Values by measure.
    errors : dict
        Errors by measure as the run states them, in the unit of the value.
    floors : dict
        Floors of the errors by measure.
    distances : dict
        Distances to the best run by measure; empty for the best run.
    tolerance : float
        Tolerance that was set for the run.
    remedies : tuple of str
        What the warnings of the run propose if it misses the tolerance.
    steps : int or None
        Time steps per cycle; None if the run has none.
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

    def meets_tolerance(self) -> bool:
        """Return whether every stated error is within the tolerance of the run."""
        return all(self._allows(name, error, self.tolerance) for name, error in self.errors.items())

    def known_error(self, name: str) -> float | None:
        """Return the known error of a measure, stated or seen in the best run; None if unknown.

        It is the larger of the error that the run states and its distance to the best run.
        """
        known = [errors[name] for errors in (self.errors, self.distances) if name in errors]
        return max(known, default=None)

    def has_waited(self) -> bool:
        """Return whether the elapsed time exceeds the CPU time so much that both are reported."""
        return self.wall_seconds > MIN_ELAPSED_TO_CPU_RATIO * self.seconds

    def is_same_run(self, other) -> bool:
        """Return whether two numerical settings gave the same results bit for bit."""
        if None in (self.value, other.value):
            return False
        return (self.values, self.errors) == (other.values, other.errors)

    def is_within(self, name: str, tolerance: float) -> bool:
        """Return whether the error of a measure is at most tolerance x |value| + floor."""
        error = self.known_error(name)
        return error is not None and self._allows(name, error, tolerance)

    def _is_changed(self, name: str, relative_change: float, floor_fraction: float) -> bool:
        """Return whether a measure deviates from the best run by more than an allowed change."""
        if name not in self.values:
            return False
        size = relative_change * abs(self.values[name])
        return self.distances.get(name, 0.0) > max(size, floor_fraction * self.floors[name])

    def _allows(self, name: str, error: float, tolerance: float) -> bool:
        """Return whether a given error of a measure is at most tolerance x |value| + floor."""
        return error <= compute_allowed_error(tolerance, self.values[name], self.floors[name])


def tolerance_curve(model: Model, say=None) -> list:
    """Run a model at several tolerances, including that of its scene.

    Parameters
    ----------
    model : Model
    say : callable, optional
        Takes a line of text per run.

    Returns
    -------
    list of Cost
        From the largest to the smallest tolerance. A run that misses its tolerance is followed by
        the runs with the proposed settings, which have the same `tolerance`.

    Raises
    ------
    NotConverged
        If no run succeeds.
    """
    with locate_errors(model.source):
        settings = with_tolerance(model)
        # The first run includes imports and compilation, which the timings must not contain.
        _run_setting(settings[0], "first run, not timed", None)
        runs = []
        trial_seconds = 0.0
        for setting in settings:
            cost = _time_setting(setting, say)
            while cost is not None:
                if runs and cost.is_same_run(runs[-1]):
                    # The runs are identical, so that the faster timing holds for both.
                    faster = min(runs[-1], cost, key=lambda run: run.seconds)
                    runs[-1] = _replace_timing(runs[-1], faster)
                    cost = _replace_timing(cost, faster)
                runs.append(cost)
                if cost.meets_tolerance():
                    break
                setting = _proposed_setting(setting, cost, MAX_TRIAL_SECONDS - trial_seconds)
                if setting is None:
                    break
                cost = _time_setting(setting, say)
                trial_seconds += cost.seconds if cost is not None else 0.0
    if not runs:
        raise NotConverged("cost: no run of this scene succeeded", "")
    return runs


def _replace_timing(cost: Cost, other: Cost) -> Cost:
    """Return the record of a run with its CPU and elapsed times replaced."""
    return replace(cost, seconds=other.seconds, wall_seconds=other.wall_seconds)


def _proposed_setting(setting: Setting, cost: Cost, seconds: float) -> Setting | None:
    """Return the numerical setting that the warnings of a run propose, or None.

    None if no warning proposes a setting that is larger than the present one, or if the run with it
    would take longer than `seconds`.

    Parameters
    ----------
    setting : Setting
        Setting of the run.
    cost : Cost
        The run.
    seconds : float
        CPU seconds that the next run may take.
    """
    for remedy in cost.remedies:
        proposal = _PROPOSED_SETTING.match(remedy)
        if proposal is None:
            continue
        key = proposal[1]
        count = int(proposal[2])
        present = getattr(setting.model.accuracy, key)
        if not present and key == "steps_per_cycle":
            present = cost.steps
        present = present or 1
        # The time of a run grows about in proportion to its steps, modes or harmonics.
        if present < count and cost.seconds * count / present <= seconds:
            label = f"{cost.tolerance:g}, {count} {key.replace('_', ' ')}"
            model = with_setting(setting.model, key, count)
            return Setting(label, cost.tolerance, f"tolerance {label}", model)
    return None


def setting_curve(model: Model, knob: str, say=None) -> list:
    """Run a model with several values of a numerical setting, from coarse to fine.

    Parameters
    ----------
    model : Model
    knob : str
        One of NUMERICAL_SETTINGS, or TOLERANCE.
    say : callable, optional
        Takes a line of text per run.

    Returns
    -------
    list of Cost
        Identical neighbours are merged. The value that the tolerance chooses follows after the
        fixed values.

    Raises
    ------
    PatchfemError
        If the scene does not have this setting, or if fewer than three values can be run.
    """
    if knob == TOLERANCE:
        return tolerance_curve(model, say)
    with locate_errors(model.source):
        possible = applicable_settings(model)
        if knob not in possible:
            raise PatchfemError(
                f"cost --over {knob}: the cost of this setting cannot be measured for this scene; "
                f"possible settings: {', '.join(possible) or 'none'}",
                "",
            )
        settings = list_settings(model, knob)
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
            if runs and cost.is_same_run(runs[-1]):
                runs[-1] = _merge_identical_runs(runs[-1], cost)
            else:
                runs.append(cost)
        if n_succeeded < 3:
            raise PatchfemError(
                f"cost --over {knob}: runs with fewer than three values of this setting succeeded",
                "",
            )
    best = _best_run(runs)
    others = [replace(run, distances=_compute_distances(run, best)) for run in runs]
    return [best if run is best else other for run, other in zip(runs, others)]


def _best_run(runs: list) -> Cost:
    """Return the reference run: that of the finest value or that which the tolerance chooses.

    Of these two it is the run whose stated errors are the smaller ones for most measures.
    """
    last = runs[-1]
    if last.value is not None:
        return last
    finest = runs[-2]
    shared = last.errors.keys() & finest.errors.keys()
    n_smaller = sum(last.errors[name] <= finest.errors[name] for name in shared)
    return last if 2 * n_smaller >= len(shared) else finest


def _compute_distances(cost: Cost, best: Cost) -> dict:
    """Return the distances of the values of a run from those of the best run, by measure."""
    shared = [name for name in cost.values if name in best.values]
    return {name: abs(cost.values[name] - best.values[name]) for name in shared}


def _merge_identical_runs(first: Cost, second: Cost) -> Cost:
    """Merge two settings that gave the same results into a single run with both labels.

    In a sentence it is named by the shorter text, which is that of the setting without a number,
    chosen by the scene.
    """
    faster = min(first, second, key=lambda run: run.seconds)
    return replace(
        _replace_timing(first, faster),
        label=f"{first.label}, {second.label.removeprefix('tolerance ')}",
        words=min(first.words, second.words, key=len),
        timings=first.timings + second.timings,
    )


def _time_setting(setting: Setting, say, before=(), *, can_split: bool = True) -> Cost | None:
    """Run a numerical setting several times and return its cost; None if it cannot be run.

    It is timed N_TIMINGS times, or once if the run is long and nothing was compiled, or if it repeats
    a run in `before`.

    Parameters
    ----------
    setting : Setting
    say : callable or None
        Takes a line of text.
    before : sequence of Cost
        Runs with which this one may be identical.
    can_split : bool
        Whether the mesh of a file may be split once more for its error estimate.
    """
    timings = []
    cost = None
    same: list = []
    while cost is None or (len(timings) < N_TIMINGS and not same):
        n_compiled = _count_compiled()
        begin = (_measure_cpu(), perf_counter())
        finished = _run_setting(setting, setting.label, say, can_split=can_split)
        if finished is None:
            return None
        timings.append((_measure_cpu() - begin[0], perf_counter() - begin[1]))
        cost = _make_cost(setting, timings, finished)
        same = [run for run in before if cost.is_same_run(run)]
        if cost.seconds >= MIN_SECONDS_TIMED_ONCE and _count_compiled() == n_compiled:
            break
    if say is not None:
        text = f"{cost.words}: {cost.seconds:.2f} CPU s"
        if cost.has_waited():
            text += f" ({cost.wall_seconds:.2f} s elapsed)"
        for run in same:
            text += f", the same run as with {run.words}"
        if not same and cost.timings == 1:
            text += ", timed once"
        say(text)
    return cost


class _FinishedRun(NamedTuple):
    """Measures, warnings and steps per cycle of a finished run.

    The steps are None if the run has none.
    """

    measures: dict
    warnings: Sequence
    steps: int | None


def _make_cost(setting: Setting, timings: list, finished: _FinishedRun) -> Cost:
    """Return the cost of a setting from its timings (CPU time, elapsed time) [s]."""
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
    )


def _measure_cpu() -> float:
    """Return the CPU time [s] of this process, its threads and its finished child processes."""
    children = os.times()
    return process_time() + children.children_user + children.children_system


def _count_compiled() -> int:
    """Return the number of functions whose compiled code is cached.

    A run that increases this number has compiled a function.
    """
    try:
        return len(os.listdir(cache_folder() / "code"))
    except OSError:
        return 0


def _run_setting(
    setting: Setting, label: str, say, *, can_split: bool = True
) -> _FinishedRun | None:
    """Run a setting; None if it does not converge or needs more memory than there is.

    The pieces are condensed again instead of being taken from the cache.
    """
    try:
        if setting.level:
            fine, *coarser = solve_on_split_mesh(setting.model.patch, setting.level, can_split)
            return _FinishedRun(estimate_static_measures(fine, *coarser), (), None)
        result = run_plan(plan(setting.model), fresh=True)
        steps = result.extra.get("steps_per_cycle") or result.extra.get("steps")
        return _FinishedRun(result.measures, result.warnings, steps)
    except (NotConverged, MemoryError) as error:
        if say is not None:
            say(f"{label}: left out ({error or 'out of memory'})")
        return None


def changed_measures(runs: list) -> list:
    """Return the names of the measures that the setting changes, in the order of the runs.

    A measure counts as changed if it differs by more than UNCHANGED_TOL times its value and by more than
    the round-off of its floor.
    """
    names = []
    for name in runs[0].values:
        if any(run._is_changed(name, UNCHANGED_TOL, ROUND_OFF_FRACTION) for run in runs):
            names.append(name)
    return names


def fastest_by_measure(runs: list, tolerance: float) -> dict:
    """Return, by measure, the label of the fastest run within the tolerance, or None.

    A coarse run that is accurate by chance does not count: no finer run may exceed the tolerance
    again.
    """
    out = {}
    for name in changed_measures(runs):
        confirmed = _select_confirmed_runs(runs, [name], tolerance)
        fastest = min(confirmed, key=lambda run: run.seconds, default=None)
        out[name] = None if fastest is None else fastest.label
    return out


def _select_confirmed_runs(runs: list, names: Sequence, tolerance: float) -> list:
    """Select the runs that meet a tolerance and are confirmed by all finer runs.

    The run that the tolerance chooses is judged on its own.

    Parameters
    ----------
    runs : list of Cost
    names : sequence of str
        Measures; a run may lack some of them.
    tolerance : float
    """

    def is_good(run: Cost) -> bool:
        """Return whether a run has all named measures within the tolerance."""
        return all(run.is_within(name, tolerance) for name in names if name in run.values)

    confirmed = []
    for run in reversed([run for run in runs if run.value is not None]):
        # The best run has no error if it only serves as the reference of the others.
        if not run.errors and not run.distances:
            continue
        if not is_good(run):
            break
        confirmed.append(run)
    return confirmed + [run for run in runs if run.value is None and is_good(run)]


def fastest_run(runs: list, tolerance: float) -> Cost | None:
    """Return the run with the least CPU time that has all measures within a tolerance.

    Of runs that are equally expensive it is the one that comes first, with the coarsest setting.
    None if there is no such run.
    """
    confirmed = _select_confirmed_runs(runs, measures_with_error(runs), tolerance)
    shortest = min((run.seconds for run in confirmed), default=inf)
    for run in runs:
        if run in confirmed and run.seconds <= EQUAL_COST_RATIO * shortest + TIMING_SCATTER:
            return run
    return None


def cost_sentence(runs: list, tolerance: float) -> str:
    """Return the sentence on the fastest setting that meets a tolerance.

    If none does, it names a measure that misses it.
    """
    names = measures_with_error(runs)
    fastest = fastest_run(runs, tolerance)
    if fastest is not None:
        cost = f"{_format_seconds(fastest)} per run"
        if len(runs) > 1 and not _has_effect(runs, tolerance):
            return (
                f"this setting changes no result by more than the tolerance {tolerance:g}; fastest in these timings: "
                f"{fastest.words}, {cost}"
            )
        return f"{fastest.words}: {cost}, with every measure within the tolerance {tolerance:g}"
    known = [run for run in runs if run.errors or run.distances]
    best = min(known, key=lambda run: worst_error(run, names, tolerance))
    worst = worst_error(best, names, tolerance)
    size = format_number(worst.fraction, 2)
    sizes = []
    for run in known:
        if worst.name in run.values:
            sizes.append(worst_error(run, [worst.name], tolerance).fraction)
    if worst.fraction >= NO_EFFECT_RATIO * max(sizes):
        return (
            f"no setting meets the tolerance {tolerance:g}: with every setting the error of {worst.name} is "
            f"{size}"
        )
    return (
        f"no setting meets the tolerance {tolerance:g}: the best run, with {best.words}, has an error of "
        f"{size} in {worst.name} and takes {_format_seconds(best)}"
    )


def _has_effect(runs: list, tolerance: float) -> bool:
    """Return whether a result of any run differs from that of the best run by more than the tolerance."""
    names = changed_measures(runs)
    for run in runs:
        for name in names:
            distance = run.distances.get(name, 0.0)
            if name in run.values and not run._allows(name, distance, tolerance):
                return True
    return False


def _format_seconds(run: Cost) -> str:
    """Format the CPU time of a run with two digits."""
    return f"{format_number(run.seconds, 2)} CPU s"


class WorstError(NamedTuple):
    """Measure of a run whose error is largest relative to its tolerance.

    fraction: error / error that a tolerance of 1 would allow, to be compared with the tolerance;
    name: of the measure, "" if no error is known.
    """

    fraction: float
    name: str


def worst_error(run: Cost, names: Sequence, tolerance: float) -> WorstError:
    """Find the measure whose error is largest relative to a tolerance.

    Parameters
    ----------
    run : Cost
    names : sequence of str
        Measures that are compared.
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


def worst_run_error(run: Cost) -> WorstError:
    """Return the worst error of a run relative to the tolerance of that run."""
    return worst_error(run, list(run.values), run.tolerance)


def measures_with_error(runs: list) -> list:
    """Return the measures whose error is stated by any run; all measures if no run states one."""
    names = list(runs[-1].values)
    return [name for name in names if any(name in run.errors for run in runs)] or names
