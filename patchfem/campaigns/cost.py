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
from dataclasses import dataclass, replace
from math import inf
from time import perf_counter, process_time
from typing import NamedTuple

from ..compiled import cache_folder
from ..core import NotConverged, PatchfemError, compute_allowed_error
from ..formatting import format_number
from ..model.model import Model
from ..model.source import locate_errors
from ..runs.patch.ladder import solve_split
from ..runs.patch.measures import measures
from ..runs.plan import plan
from ..runs.run import run
from .numerical_settings import (
    NUMERICAL_SETTINGS,
    Setting,
    applicable_settings,
    list_settings,
    with_setting,
    with_tolerance,
)

__all__ = [
    "NUMERICAL_SETTINGS",
    "TOLERANCE",
    "Cost",
    "applicable_settings",
    "changed_measures",
    "cost_sentence",
    "fastest_by_measure",
    "fastest_run",
    "setting_curve",
    "tolerance_curve",
]
TOLERANCE = "tolerance"  # name of the curve over tolerances, which is accepted in addition to NUMERICAL_SETTINGS
# Timings of a short run; the shortest one counts, because other work on the machine only adds time.
TIMINGS = 3
# CPU seconds above which a run is timed only once, because its timings differ by a few percent
MIN_SECONDS_TIMED_ONCE = 0.3
# CPU seconds that runs with proposed settings may take in total, so that `cost` ends within seconds
MAX_TRIAL_SECONDS = 10.0
# A warning of a run ends with its tolerance and what to do; this second part may name a setting
# that can be tried here.
_REMEDY_TEXT = re.compile(r"; the tolerance is [^;]*; (.*)", re.DOTALL)
_PROPOSED_SETTING = re.compile(r"set accuracy\.(steps_per_cycle|shear_modes|harmonics) = (\d+)")
MIN_ELAPSED_RATIO = 1.5  # elapsed time / CPU time above which both times are reported
EQUAL_COST_RATIO = 1.1  # ratio of CPU seconds up to which two runs count as equally expensive
TIMING_SCATTER = 2e-3  # CPU seconds by which timings of the same short run differ
NO_EFFECT_RATIO = 0.9  # smallest / largest error above which a setting does not help
UNCHANGED_TOL = 1e-11  # relative change of a measure below which a setting does not affect it
ROUND_OFF_FRACTION = (
    1e-6  # fraction of the floor of a measure below which a change of it is round-off
)


@dataclass(frozen=True, eq=False, slots=True)
class Cost:
    """One run of a cost curve.

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
        """Return whether every stated error is within the tolerance that was set for the run."""
        return all(
            error <= compute_allowed_error(self.tolerance, self.values[name], self.floors[name])
            for name, error in self.errors.items()
        )

    def known_error(self, name: str) -> float | None:
        """Return the error of a measure; None if it is not known.

        It is the larger of the error that the run states and its distance to the best run.
        """
        known = [part[name] for part in (self.errors, self.distances) if name in part]
        return max(known, default=None)

    def has_waited(self) -> bool:
        """Return whether the elapsed time exceeds the CPU time so much that both are reported."""
        return self.wall_seconds > MIN_ELAPSED_RATIO * self.seconds

    def is_same_run(self, other) -> bool:
        """Return whether two settings that are numbers gave the same run bit for bit."""
        return None not in (self.value, other.value) and (self.values, self.errors) == (
            other.values,
            other.errors,
        )

    def is_within(self, name: str, tolerance: float) -> bool:
        """Return whether the error of a measure is at most tolerance * |value| + floor."""
        off = self.known_error(name)
        return off is not None and off <= compute_allowed_error(
            tolerance, self.values[name], self.floors[name]
        )


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
        wanted = with_tolerance(model)
        # The first run includes imports and compilation, which the timings must not contain.
        _run_setting(wanted[0], "first run, not timed", None)
        runs = []
        spent = 0.0
        for setting in wanted:
            one = _time_setting(setting, True, say)
            while one is not None:
                # The runs are identical, so the faster timing holds for both.
                if runs and one.is_same_run(runs[-1]):
                    quick = min(runs[-1], one, key=lambda each: each.seconds)
                    runs[-1], one = (
                        replace(each, seconds=quick.seconds, wall_seconds=quick.wall_seconds)
                        for each in (runs[-1], one)
                    )
                runs.append(one)
                setting = (
                    None
                    if one.meets_tolerance()
                    else _proposed_setting(setting, one, MAX_TRIAL_SECONDS - spent)
                )
                if setting is None:
                    break
                one = _time_setting(setting, True, say)
                spent += one.seconds if one is not None else 0.0
    if not runs:
        raise NotConverged("cost: no run of this scene succeeded", "")
    return runs


def _proposed_setting(setting: Setting, one: Cost, seconds: float) -> Setting | None:
    """Return the setting that the warnings of a run propose, or None.

    None if no warning proposes a setting that is larger than the present one, or if the run with it
    would take longer than `seconds`.

    Parameters
    ----------
    setting : Setting
        Setting of the run.
    one : Cost
        The run.
    seconds : float
        CPU seconds that the next run may take.
    """
    for remedy in one.remedies:
        if found := _PROPOSED_SETTING.match(remedy):
            key = found[1]
            count = int(found[2])
            before = (
                getattr(setting.model.accuracy, key)
                or (one.steps if key == "steps_per_cycle" else 1)
                or 1
            )
            # The time of a run grows about in proportion to its steps, modes or harmonics.
            if before < count and one.seconds * count / before <= seconds:
                label = f"{one.tolerance:g}, {count} {key.replace('_', ' ')}"
                return Setting(
                    label,
                    one.tolerance,
                    f"tolerance {label}",
                    with_setting(setting.model, key, count),
                )
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
        mine = applicable_settings(model)
        if knob not in mine:
            raise PatchfemError(
                f"cost --over {knob}: the cost of this setting cannot be measured for this scene; "
                f"possible settings: {', '.join(mine) or 'none'}",
                "",
            )
        wanted = list_settings(model, knob)
        # The first run includes imports and compilation, which the timings must not contain.
        _run_setting(wanted[0], "first run, not timed", None)
        runs = []
        done = 0
        for one in wanted:
            found = _time_setting(one, one is not wanted[-1], say, runs[-1:])
            if found is not None:
                done += 1
                runs[-1:] = (
                    [_merge_identical_runs(runs[-1], found)]
                    if runs and found.is_same_run(runs[-1])
                    else [*runs[-1:], found]
                )
        if done < 3:
            raise PatchfemError(
                f"cost --over {knob}: runs with fewer than three values of this setting succeeded",
                "",
            )
    best = _best_run(runs)
    return [
        one if one is best else replace(one, distances=_distances_to_best(one, best))
        for one in runs
    ]


def _best_run(runs: list) -> Cost:
    """Return the run that serves as reference: the finest value, or what the tolerance chooses.

    Of these two it is the run whose stated errors are the smaller ones for most measures.
    """
    *_, last = runs
    if last.value is not None:
        return last
    fine = runs[-2]
    shared = last.errors.keys() & fine.errors.keys()
    return (
        last
        if 2 * sum(last.errors[name] <= fine.errors[name] for name in shared) >= len(shared)
        else fine
    )


def _distances_to_best(one: Cost, best: Cost) -> dict:
    """Return the distances of the values of a run from those of the best run, by measure."""
    return {
        name: abs(value - best.values[name])
        for name, value in one.values.items()
        if name in best.values
    }


def _merge_identical_runs(first: Cost, second: Cost) -> Cost:
    """Merge two settings that gave the same run into one run with both labels.

    In a sentence it is named by the shorter text, which is that of the setting without a number,
    chosen by the scene.
    """
    quick = min(first, second, key=lambda one: one.seconds)
    return replace(
        first,
        label=f"{first.label}, {second.label.removeprefix('tolerance ')}",
        words=min(first.words, second.words, key=len),
        seconds=quick.seconds,
        wall_seconds=quick.wall_seconds,
        timings=first.timings + second.timings,
    )


def _time_setting(setting: Setting, coarse: bool, say, before=()) -> Cost | None:
    """Run a setting several times and return its cost; None if it cannot be run.

    It is timed TIMINGS times, or once if the run is long and nothing was compiled, or if it repeats
    a run in `before`.

    Parameters
    ----------
    setting : Setting
    coarse : bool
        Whether the mesh of a file may be split once more for its error estimate.
    say : callable or None
        Takes a line of text.
    before : sequence of Cost
        Runs with which this one may be identical.
    """
    timings = []
    one = None
    while one is None or (
        len(timings) < TIMINGS and not any(one.is_same_run(other) for other in before)
    ):
        kept = _count_compiled()
        begin = (_measure_cpu(), perf_counter())
        found = _run_setting(setting, setting.label, say, coarse)
        if found is None:
            return None
        timings.append((_measure_cpu() - begin[0], perf_counter() - begin[1]))
        measured, warnings, steps = found
        known = {name: m for name, m in measured.items() if m.value is not None}
        one = Cost(
            setting.label,
            setting.value,
            setting.words,
            *min(timings),
            len(timings),
            {name: m.value for name, m in known.items()},
            {name: m.error for name, m in known.items() if m.error is not None},
            {name: m.floor for name, m in known.items()},
            {},
            setting.model.accuracy.tolerance,
            tuple(remedy[1] for text in warnings if (remedy := _REMEDY_TEXT.search(text))),
            steps,
        )
        if one.seconds >= MIN_SECONDS_TIMED_ONCE and _count_compiled() == kept:
            break
    again = "".join(
        f", the same run as with {other.words}" for other in before if one.is_same_run(other)
    )
    if say is not None:
        say(
            f"{one.words}: {one.seconds:.2f} CPU s"
            + f" ({one.wall_seconds:.2f} s elapsed)" * one.has_waited()
            + (again or ", timed once" * (one.timings == 1))
        )
    return one


def _measure_cpu() -> float:
    """Return the CPU seconds of all threads of this process and of its children that have ended."""
    children = os.times()
    return process_time() + children.children_user + children.children_system


def _count_compiled() -> int:
    """Return the number of functions whose machine code is cached.

    A run that increases this number has compiled a function.
    """
    try:
        return len(os.listdir(cache_folder() / "code"))
    except OSError:
        return 0


def _run_setting(setting: Setting, label: str, say, coarse: bool = True) -> tuple | None:
    """Return (measures, warnings, steps per cycle) of a setting; None if the run fails.

    The pieces are condensed again. The run fails if it does not converge or needs more memory
    than there is.
    """
    try:
        if setting.level:
            fine, *more = solve_split(setting.model.patch, setting.level, coarse)
            return measures(fine, *more), (), None
        done = run(plan(setting.model), fresh=True)
        return (
            done.measures,
            done.warnings,
            done.extra.get("steps_per_cycle") or done.extra.get("steps"),
        )
    except (NotConverged, MemoryError) as error:
        if say is not None:
            say(f"{label}: left out ({error or 'out of memory'})")
        return None


def changed_measures(runs: list) -> list:
    """Return the names of the measures that the setting changes, in the order of the runs.

    A measure counts as changed if it differs by more than UNCHANGED_TOL times its value and by more than
    the round-off of its floor.
    """
    return [
        name
        for name in runs[0].values
        if any(
            one.distances.get(name, 0.0)
            > max(UNCHANGED_TOL * abs(one.values[name]), ROUND_OFF_FRACTION * one.floors[name])
            for one in runs
            if name in one.values
        )
    ]


def fastest_by_measure(runs: list, tolerance: float) -> dict:
    """Return, by measure, the label of the fastest run within the tolerance, or None.

    A coarse run that is accurate by chance does not count: no finer run may exceed the tolerance
    again.
    """
    out = {}
    for name in changed_measures(runs):
        good = _select_confirmed_runs(runs, lambda one, name=name: one.is_within(name, tolerance))
        out[name] = min(good, key=lambda one: one.seconds).label if good else None
    return out


def _select_confirmed_runs(runs: list, good) -> list:
    """Return the runs that fulfil a condition, as do all finer runs whose error is known.

    What the tolerance chooses is judged on its own.
    """
    chain = [one for one in runs if one.value is not None]
    alone = [one for one in runs if one.value is None]
    out = []
    for one in reversed(chain):
        # The best run has no error if it only serves as the reference of the others.
        if not one.errors and not one.distances:
            continue
        if not good(one):
            break
        out.append(one)
    return out + [one for one in alone if good(one)]


def fastest_run(runs: list, tolerance: float) -> Cost | None:
    """Return the run with the fewest CPU seconds that has all measures within a tolerance.

    Of runs that are equally expensive it is the one that comes first, with the coarsest setting.
    None if there is no such run.
    """
    names = measures_with_error(runs)
    good = _select_confirmed_runs(
        runs,
        lambda one: all(one.is_within(name, tolerance) for name in names if name in one.values),
    )
    least = min((one.seconds for one in good), default=inf)
    return next(
        (
            one
            for one in runs
            if one in good and one.seconds <= EQUAL_COST_RATIO * least + TIMING_SCATTER
        ),
        None,
    )


def cost_sentence(runs: list, tolerance: float) -> str:
    """Return which setting meets a tolerance in the least time, or which measure misses it."""
    names = measures_with_error(runs)
    if one := fastest_run(runs, tolerance):
        return (
            f"{one.words}: {_format_seconds(one)} per run, with every measure within the tolerance {tolerance:g}"
            + _effect_sentence(runs, tolerance)
        )
    known = [one for one in runs if one.errors or one.distances]
    worst, least = min(
        ((worst_error(one, names, tolerance), one) for one in known), key=lambda found: found[0]
    )
    share = format_number(worst.share, 2)
    if worst.share >= NO_EFFECT_RATIO * max(
        worst_error(one, [worst.name], tolerance).share for one in known if worst.name in one.values
    ):
        return (
            f"no setting meets the tolerance {tolerance:g}: with every setting the error of {worst.name} is "
            f"{share}"
        )
    return (
        f"no setting meets the tolerance {tolerance:g}: the best run, with {least.words}, has an error of "
        f"{share} in {worst.name} and takes {_format_seconds(least)}"
    )


def _effect_sentence(runs: list, tolerance: float) -> str:
    """Return a clause about settings that change nothing relevant; "" if they change something."""
    turned = changed_measures(runs)
    if len(runs) < 2 or any(
        one.distances.get(name, 0.0)
        > compute_allowed_error(tolerance, abs(one.values[name]), one.floors[name])
        for one in runs
        for name in turned
        if name in one.values
    ):
        return ""
    return "; the other settings change no result" + (
        " by more than the tolerance" if turned else " of this scene"
    )


def _format_seconds(one: Cost) -> str:
    """Format CPU seconds with two digits."""
    return f"{format_number(one.seconds, 2)} CPU s"


class WorstError(NamedTuple):
    """The measure of a run whose error is largest compared with its tolerance.

    share: error / error that a tolerance of 1 would allow, to be compared with the tolerance; name:
    of the measure, "" if no error is known.
    """

    share: float
    name: str


def worst_error(one: Cost, names: list, tolerance: float) -> WorstError:
    """Find the measure, of `names`, whose error in a run is largest compared with a tolerance."""
    sizes = {
        name: abs(one.values[name]) + one.floors[name] / tolerance
        for name in names
        if one.known_error(name)
    }
    return max(
        (
            WorstError(one.known_error(name) / size if size else inf, name)
            for name, size in sizes.items()
        ),
        default=WorstError(0.0, ""),
    )


def worst_of_run(one: Cost) -> WorstError:
    """Return `worst_error` of all measures of a run for the tolerance that was set for it."""
    return worst_error(one, list(one.values), one.tolerance)


def measures_with_error(runs: list) -> list:
    """Return the measures whose error is stated by any run; all measures if no run states one."""
    return [name for name in runs[-1].values if any(name in one.errors for one in runs)] or list(
        runs[-1].values
    )
