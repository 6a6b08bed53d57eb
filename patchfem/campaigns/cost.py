"""Numerical error against computing time, for several tolerances or values of a setting.

In: a model, and the setting that varies. Out: a list of `Cost`, one per run, and sentences about the
cheapest setting that meets a tolerance.

Read `compute_costs` first. Times are CPU seconds of this process and its child processes, which are hardly
affected by other programs.
"""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from time import perf_counter, process_time
from typing import NamedTuple

from .. import kernel_cache
from ..core import Measure, NotConverged, PatchfemError
from ..formatting import format_number
from ..model.model import Model
from ..model.source import locate_errors
from ..runs.patch import store
from ..runs.plan import plan
from ..runs.refine import is_main
from ..runs.run import run as run_plan
from .numerical_settings import (
    TOLERANCE_SETTING,
    Setting,
    choose_tolerances,
    find_applicable_settings,
    make_setting_values,
)

# Number of timings of a short run; the shortest one is used, because disturbances only add time.
N_TIMINGS = 3


class Judgement(StrEnum):
    """Whether the errors of a run are within its tolerance: all are, one exceeds it, or some errors are not known."""

    MEETS = "meets its tolerance"
    MISSES = "misses its tolerance"
    UNKNOWN = "has unknown errors"


@dataclass(frozen=True, eq=False, slots=True)
class Cost:
    """Run with a given value of a numerical setting: CPU time, measures and errors.

    Attributes
    ----------
    label : str
        Label of the setting.
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
    measures : dict of str to Measure
        Measures with a value.
    tolerance : float
        Tolerance of the run.
    remedies : tuple of str
        Advice for a run that misses its tolerance.
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
    measures: dict[str, Measure]
    tolerance: float = 0.0
    remedies: tuple[str, ...] = ()
    steps: int | None = None
    nodes: int | None = None

    def has_error(self, name: str) -> bool:
        """Return whether the measure `name` has an error estimate."""
        return name in self.measures and self.measures[name].error is not None


class SolvedSetting(NamedTuple):
    """Measures of a model with one numerical setting.

    - measures: measures by name.
    - remedies: advice where the tolerance is missed.
    - n_steps: time steps per cycle; None if the method takes no time steps.
    - n_nodes: nodes of the interface; None without a patch.
    """

    measures: dict[str, Measure]
    remedies: tuple[str, ...] = ()
    n_steps: int | None = None
    n_nodes: int | None = None


class Subject(NamedTuple):
    """What is computed with each setting: the run of a scene, or the backbone of a mode.

    - find_settings: function of a Model that lists the NUMERICAL_SETTINGS with an effect.
    - solve: function of a Model that returns its SolvedSetting.
    - tolerances: those of a series; () for those of a run of the model.
    - notes: sentences for the user on what is computed.
    """

    find_settings: Callable[[Model], list[str]]
    solve: Callable[[Model], SolvedSetting]
    tolerances: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()


def solve_run(model: Model) -> SolvedSetting:
    """Run a model; the pieces are condensed again instead of being loaded from the cache."""
    store.clear_cache()
    result = run_plan(plan(model))
    advice = [finding.advice for finding in result.findings if finding.advice is not None]
    return SolvedSetting(
        measures=result.measures,
        remedies=tuple(one.text for one in advice),
        n_steps=result.settings.steps_per_cycle,
        n_nodes=None if result.patch is None else int(result.patch.x.size),
    )


RUN = Subject(find_applicable_settings, solve_run)


def compute_costs(
    model: Model,
    over: str = "",
    say: Callable | None = None,
    subject: Subject = RUN,
    *,
    varies_all: bool = False,
) -> dict[str, list[Cost]]:
    """Run a model with several tolerances, and over its mesh or its steps.

    Parameters
    ----------
    model : Model
        Model of the scene with its own settings.
    over : str
        Only setting that varies, one of NUMERICAL_SETTINGS; "" for the tolerance and the first setting of the scene.
    say : callable, optional
        Called with a line of text for each run.
    subject : Subject
        What is computed with each setting.
    varies_all : bool
        Whether every setting of the scene varies besides the tolerance.

    Returns
    -------
    dict of str to list of Cost
        Runs by what varies, from coarse to fine.

    Raises
    ------
    PatchfemError, NotConverged
        If the scene does not have this setting; if fewer than three runs succeed, or none at any tolerance.
    """
    names = [over]
    if not over:
        with locate_errors(model.source):
            settings = subject.find_settings(model)
        names = [TOLERANCE_SETTING, *settings[: None if varies_all else 1]]
    curves = {}
    for name in names:
        curves[name] = _compute_setting_costs(model, name, say, subject, is_first=not curves)
    return curves


def _compute_setting_costs(
    model: Model, setting_name: str, say: Callable | None, subject: Subject, *, is_first: bool
) -> list[Cost]:
    """Run a model with several values of a numerical setting, from coarse to fine.

    Parameters
    ----------
    model : Model
        Model of the scene with its own settings.
    setting_name : str
        One of NUMERICAL_SETTINGS, or TOLERANCE_SETTING for several tolerances, which include that of the scene.
    say : callable or None
        Called with a line of text for each run.
    subject : Subject
        What is computed with each setting.
    is_first : bool
        Whether nothing was computed before, so that the first timing would contain imports.

    Returns
    -------
    list of Cost
        The automatic setting follows after the fixed values.

    Raises
    ------
    PatchfemError
        If the scene does not have this setting.
    NotConverged
        If fewer than three runs succeed, or none at any tolerance.
    """
    with locate_errors(model.source):
        possible = subject.find_settings(model)
        if setting_name not in (TOLERANCE_SETTING, *possible):
            raise PatchfemError(
                f"cost --over {setting_name}: the cost of this setting cannot be measured for this scene; "
                f"possible settings: {', '.join(possible) or 'none'}",
                "",
            )
        tolerances = subject.tolerances or choose_tolerances(model)
        settings = make_setting_values(model, setting_name, tolerances)
        # The first run includes imports and compilation, which the timings must not contain.
        if is_first:
            _run_setting(settings[0], None, subject)
        runs = _time_settings(settings, say, subject)
    # Smallest number of runs of a curve over a setting
    if not runs or (len(runs) < 3 and setting_name != TOLERANCE_SETTING):
        raise NotConverged(
            f"cost --over {setting_name}: runs with only {len(runs)} values of it succeeded, and three are needed; set it "
            "in the scene to a value with which the scene runs"
        )
    return runs


def _time_settings(settings: list[Setting], say: Callable | None, subject: Subject) -> list[Cost]:
    """Run and time a model with each of some settings; settings that fail are left out.

    `say`, if given, is called with a line of text that reports the progress, and `subject` says what is computed.
    """
    runs = []
    for setting in settings:
        # a short run is timed several times, and one that compiles once more
        timings = []
        result = None
        is_short = True
        while is_short and len(timings) < N_TIMINGS:
            compile_seconds = kernel_cache.COMPILE_SECONDS[0]
            begin = (_measure_cpu_time(), perf_counter())
            result = _run_setting(setting, say, subject)
            if result is None:
                break
            timings.append((_measure_cpu_time() - begin[0], perf_counter() - begin[1]))
            has_compiled = kernel_cache.COMPILE_SECONDS[0] > compile_seconds
            # Smallest CPU time [s] of a run that is timed only once; longer runs scatter by a few
            # percent.
            is_short = has_compiled or timings[-1][0] < 0.3

        if result is None:
            continue
        runs.append(_make_cost(setting, timings, result))
        if say is not None:
            say(f"{setting.words}: {runs[-1].seconds:.2f} CPU s")
    return runs


def _make_cost(setting: Setting, timings: list[tuple[float, float]], result: SolvedSetting) -> Cost:
    """Return the cost of a setting from the timings and the result of its run.

    A timing is a pair of CPU time and elapsed time [s]. The shortest counts.
    """
    seconds, wall_seconds = min(timings)
    return Cost(
        label=setting.label,
        value=setting.value,
        words=setting.words,
        seconds=seconds,
        wall_seconds=wall_seconds,
        timings=len(timings),
        measures={name: one for name, one in result.measures.items() if one.value is not None},
        tolerance=setting.model.accuracy.tolerance,
        remedies=result.remedies,
        steps=result.n_steps,
        nodes=result.n_nodes,
    )


def _measure_cpu_time() -> float:
    """Return the CPU time [s] of this process and its finished child processes."""
    children = os.times()
    return process_time() + children.children_user + children.children_system


def _run_setting(setting: Setting, say: Callable | None, subject: Subject) -> SolvedSetting | None:
    """Compute a Subject with one numerical setting; return None if it does not converge or runs out of memory.

    `say` is called with the reason of a failure.
    """
    try:
        return subject.solve(setting.model)
    except (NotConverged, MemoryError) as error:
        if say is not None:
            say(f"{setting.label}: left out ({error or 'out of memory'})")
        return None


class Accuracy(NamedTuple):
    """Largest error of a run, relative to the error that the tolerance allows.

    - fraction: error over the allowed error at a tolerance of 1, to be compared with the tolerance.
    - name: name of the measure with this error; "" if no error is known.
    - is_complete: whether the errors of all measures are known.
    """

    fraction: float
    name: str
    is_complete: bool

    def judge(self, tolerance: float) -> Judgement:
        """Judge whether the errors are within a tolerance.

        Returns
        -------
        Judgement
            MISSES if a known error exceeds the tolerance; MEETS if all errors are known and none does; UNKNOWN if no
            known error does, but some errors are not known.
        """
        if self.fraction > tolerance:
            return Judgement.MISSES
        return Judgement.MEETS if self.is_complete else Judgement.UNKNOWN


def rate_run(run: Cost, names: Sequence[str], tolerance: float) -> Accuracy:
    """Find the measure with the largest error relative to a tolerance.

    Parameters
    ----------
    run : Cost
        Run whose errors are compared.
    names : sequence of str
        Names of the measures that count.
    tolerance : float
        Largest error, relative to the value, beside which a floor counts.
    """
    known = [name for name in names if run.has_error(name)]
    ratios = [(tolerance * run.measures[name].error_ratio(tolerance), name) for name in known]
    worst = max((pair for pair in ratios if pair[0] > 0), default=(0.0, ""))
    return Accuracy(*worst, len(known) == len(names))


def find_measures_with_error(runs: list[Cost]) -> list[str]:
    """Return the measures with an error estimate in any run; all measures if there is none."""
    names = list(runs[-1].measures)
    return [name for name in names if any(run.has_error(name) for run in runs)] or names


def find_judged_measures(runs: list[Cost]) -> list[str]:
    """Return the main measures with an error estimate in any run; without such a measure, all with an estimate."""
    names = find_measures_with_error(runs)
    return list(filter(is_main, names)) or names


def find_coarsest_run(runs: list[Cost], tolerance: float) -> Cost | None:
    """Return the coarsest run within a tolerance; None if there is none.

    `runs` are sorted from coarse to fine. A coarse run that is accurate by chance is excluded: all finer values must be
    within the tolerance as well. The automatic setting, which is the last one, is judged independently of the others.
    """
    names = find_judged_measures(runs)
    coarsest = None
    for run in reversed(runs):
        if rate_run(run, names, tolerance).judge(tolerance) is Judgement.MEETS:
            coarsest = run
        elif run.value is not None:
            break
    return coarsest


def find_best_run(runs: list[Cost], tolerance: float) -> Cost:
    """Return the coarsest run within a tolerance, else that with the smallest errors, else the last one.

    Only a run without unknown errors can have the smallest ones.
    """
    names = find_judged_measures(runs)
    rated = [(rate_run(run, names, tolerance), run) for run in runs]
    known = [(accuracy, run) for accuracy, run in rated if accuracy.is_complete]
    _, best = min(known, key=lambda pair: pair[0], default=rated[-1])
    return find_coarsest_run(runs, tolerance) or best


def describe_best_setting(runs: list[Cost], tolerance: float) -> str:
    """Describe the coarsest setting that meets a tolerance, or the worst measure of the best run if none meets it."""
    names = find_judged_measures(runs)
    best = find_best_run(runs, tolerance)
    worst = rate_run(best, names, tolerance)
    seconds = format_number(best.seconds, 2)
    if find_coarsest_run(runs, tolerance) is not None:
        judged = (
            "main measure" if any(map(is_main, names)) else "measure that has an error estimate"
        )
        return f"{best.words}: {seconds} CPU s per run, with every {judged} within the tolerance {tolerance:g}"
    if not worst.is_complete:
        return (
            f"no setting is known to meet the tolerance {tolerance:g}: no run has an error estimate of every measure; "
            "compare the values of the finest runs"
        )
    return (
        f"no setting is known to meet the tolerance {tolerance:g}: the best run, with {best.words}, has a relative error of "
        f"{format_number(worst.fraction, 2)} in {worst.name} and takes {seconds} CPU s"
    )
