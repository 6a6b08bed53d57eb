"""Error of a scene against computing time, for several tolerances or for several values of one numerical setting.

Read `tolerance_curve` first: it runs the scene at each tolerance, and where a run misses its tolerance it tries the
setting that the run itself proposes. `curve` varies one setting alone.

Seconds are CPU seconds of this process and its children: other work on the machine does not change them.
"""

import os
import re
from dataclasses import dataclass, replace
from math import inf
from time import perf_counter, process_time
from typing import NamedTuple

from ..compiled import cache_folder
from ..core import NotConverged, PatchfemError, allowed_error
from ..formatting import format_number
from ..model.model import Model
from ..model.source import locate_errors
from ..runs.patch.ladder import solve_split
from ..runs.patch.measures import measures
from ..runs.plan import plan
from ..runs.run import run
from .numerical_settings import KNOBS, Setting, knobs_of, settings, with_setting, with_tolerance

__all__ = [
    "KNOBS",
    "TOLERANCE",
    "Cost",
    "cheapest",
    "curve",
    "knobs_of",
    "quickest",
    "sentence",
    "tolerance_curve",
    "turned_by",
]
TOLERANCE = "tolerance"  # name of the curve over tolerances, beside KNOBS
TIMINGS = 3  # of a short run; the shortest counts, because other work only adds to it
LONG = 0.3  # CPU seconds from which a run is timed once: timings of it differ by some percent
# CPU seconds for the settings that runs propose, so that `cost` takes some seconds
MAX_TRIAL_SECONDS = 10.0
# how a warning of a run ends: the tolerance, what to do, and of this the setting that can be tried here
_REMEDY = re.compile(r"; the tolerance is [^;]*; (.*)", re.DOTALL)
_PROPOSED = re.compile(r"set accuracy\.(steps_per_cycle|shear_modes|harmonics) = (\d+)")
APART = 1.5  # ratio of the seconds by the clock to those of the processor from which both are told
NOISE = 1.1  # ratio of seconds up to which two runs cost the same
JITTER = 2e-3  # CPU seconds by which timings of one short run differ
STUCK = 0.9  # ratio of the least error over the largest from which a knob does not help
UNTURNED = 1e-11  # relative change of a measure that a knob leaves as it is
ROUND = 1e-6  # of the floor of a measure, below which its change is one of round-off


@dataclass(frozen=True, eq=False, slots=True)
class Cost:
    """One run of a cost curve.

    label: of the setting, or of all settings that gave this run, bit for bit; value: of the knob in SI, None where the
    scene's tolerance chose; words: the setting in a sentence; CPU seconds of the whole run with its error estimates,
    the least of so many timings, and those by the clock in the same timing. By measure: values; errors, as the run
    states them, in the unit of the value; floors of these; distances to the run `best`, which has none itself.
    tolerance: what the run was asked for; remedies: what its warnings propose where it misses the tolerance; steps: of
    a cycle, None if it has none.
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
        """Whether every stated error is within the tolerance that the run was asked for."""
        return all(
            error <= allowed_error(self.tolerance, self.values[name], self.floors[name])
            for name, error in self.errors.items()
        )

    def off(self, name: str) -> float | None:
        """Error of a measure: the larger of what the run states and its distance to the best; None without either."""
        known = [part[name] for part in (self.errors, self.distances) if name in part]
        return max(known, default=None)

    def waited(self) -> bool:
        """Whether the clock ran so much longer than the processor that both are told."""
        return self.wall_seconds > APART * self.seconds

    def same_as(self, other) -> bool:
        """Whether two settings of numbers gave the same run, bit for bit."""
        return None not in (self.value, other.value) and (self.values, self.errors) == (
            other.values,
            other.errors,
        )

    def within(self, name: str, tolerance: float) -> bool:
        """Whether the error of a measure is at most tolerance * |value| + floor."""
        off = self.off(name)
        return off is not None and off <= allowed_error(
            tolerance, self.values[name], self.floors[name]
        )


def tolerance_curve(model: Model, say=None) -> list:
    """Run a model at several tolerances, that of its scene among them.

    Parameters
    ----------
    model : Model
    say : callable, optional
        Takes a line of text per run.

    Returns
    -------
    list of Cost
        From the widest to the tightest tolerance. Behind a run that misses its tolerance stand the runs with the
        settings that were tried next, which have the same `tolerance`.
    """
    with locate_errors(model.source):
        wanted = with_tolerance(model)
        # imports and compiling stay out of the times
        _tried(wanted[0], "first run, not timed", None)
        runs, spent = [], 0.0
        for setting in wanted:
            one = _timed(setting, True, say)
            while one is not None:
                if runs and one.same_as(runs[-1]):  # the faster timing holds for both
                    quick = min(runs[-1], one, key=lambda each: each.seconds)
                    runs[-1], one = (
                        replace(each, seconds=quick.seconds, wall_seconds=quick.wall_seconds)
                        for each in (runs[-1], one)
                    )
                runs.append(one)
                setting = (
                    None
                    if one.meets_tolerance()
                    else _proposed(setting, one, MAX_TRIAL_SECONDS - spent)
                )
                if setting is None:
                    break
                one = _timed(setting, True, say)
                spent += one.seconds if one is not None else 0.0
    if not runs:
        raise NotConverged("cost: no run of this scene succeeded", "")
    return runs


def _proposed(setting: Setting, one: Cost, seconds: float) -> Setting | None:
    """Return the setting that the warnings of a run propose; None if there is none that takes at most `seconds`."""
    for remedy in one.remedies:
        if found := _PROPOSED.match(remedy):
            key, count = found[1], int(found[2])
            before = (
                getattr(setting.model.accuracy, key)
                or (one.steps if key == "steps_per_cycle" else 1)
                or 1
            )
            # the time of a run grows about as its steps, modes or harmonics
            if before < count and one.seconds * count / before <= seconds:
                label = f"{one.tolerance:g}, {count} {key.replace('_', ' ')}"
                return Setting(
                    label,
                    one.tolerance,
                    f"tolerance {label}",
                    with_setting(setting.model, key, count),
                )
    return None


def curve(model: Model, knob: str, say=None) -> list:
    """Cost of every value of a knob, coarse to fine; knob: of KNOBS, or TOLERANCE.

    What its tolerance chooses stands behind the values that a scene pins. PatchfemError for a knob that this scene does
    not have.
    """
    if knob == TOLERANCE:
        return tolerance_curve(model, say)
    with locate_errors(model.source):
        mine = knobs_of(model)
        if knob not in mine:
            raise PatchfemError(
                f"cost --over {knob}: the cost of this setting cannot be measured for this scene; "
                f"possible settings: {', '.join(mine) or 'none'}",
                "",
            )
        wanted = settings(model, knob)
        # imports and compiling stay out of the times
        _tried(wanted[0], "first run, not timed", None)
        runs, done = [], 0
        for one in wanted:
            found = _timed(one, one is not wanted[-1], say, runs[-1:])
            if found is not None:
                done += 1
                runs[-1:] = (
                    [_one_run(runs[-1], found)]
                    if runs and found.same_as(runs[-1])
                    else [*runs[-1:], found]
                )
        if done < 3:
            raise PatchfemError(
                f"cost --over {knob}: runs with fewer than three values of this setting succeeded",
                "",
            )
    best = _best(runs)
    return [one if one is best else replace(one, distances=_distances(one, best)) for one in runs]


def _best(runs: list) -> Cost:
    """The finest run; of it and of what the tolerance chooses the one that states most of the smaller errors."""
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


def _distances(one: Cost, best: Cost) -> dict:
    return {
        name: abs(value - best.values[name])
        for name, value in one.values.items()
        if name in best.values
    }


def _one_run(first: Cost, second: Cost) -> Cost:
    """Two settings that gave the same run as one, named by both; in a sentence by the one of the scene, which has no
    number."""
    quick = min(first, second, key=lambda one: one.seconds)
    return replace(
        first,
        label=f"{first.label}, {second.label.removeprefix('tolerance ')}",
        words=min(first.words, second.words, key=len),
        seconds=quick.seconds,
        wall_seconds=quick.wall_seconds,
        timings=first.timings + second.timings,
    )


def _timed(setting: Setting, coarse: bool, say, before=()) -> Cost | None:
    """A setting run TIMINGS times, or once where that is long and nothing was compiled, or where it is the run `before`
    over again; None where it cannot be run.

    coarse: a mesh of a file may be split once more for its estimate.
    """
    timings, one = [], None
    while one is None or (
        len(timings) < TIMINGS and not any(one.same_as(other) for other in before)
    ):
        kept, begin = _compiled(), (_cpu(), perf_counter())
        found = _tried(setting, setting.label, say, coarse)
        if found is None:
            return None
        timings.append((_cpu() - begin[0], perf_counter() - begin[1]))
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
            tuple(remedy[1] for text in warnings if (remedy := _REMEDY.search(text))),
            steps,
        )
        if one.seconds >= LONG and _compiled() == kept:
            break
    again = "".join(
        f", the same run as with {other.words}" for other in before if one.same_as(other)
    )
    if say is not None:
        say(
            f"{one.words}: {one.seconds:.2f} CPU s"
            + f" ({one.wall_seconds:.2f} s elapsed)" * one.waited()
            + (again or ", timed once" * (one.timings == 1))
        )
    return one


def _cpu() -> float:
    """CPU seconds of this process, all its threads, and of its children that have ended."""
    children = os.times()
    return process_time() + children.children_user + children.children_system


def _compiled() -> int:
    """How many functions have their machine code kept: a run that adds one has compiled it."""
    try:
        return len(os.listdir(cache_folder() / "code"))
    except OSError:
        return 0


def _tried(setting: Setting, label: str, say, coarse: bool = True) -> tuple | None:
    """(Measures, warnings, steps per cycle) of a setting, condensed anew; None if it does not converge or memory ends."""
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


def turned_by(runs: list) -> list:
    """Names of the measures that the knob changes at all, beyond 1e-11 of their value and the round-off of their floor,
    in the order of the runs."""
    return [
        name
        for name in runs[0].values
        if any(
            one.distances.get(name, 0.0)
            > max(UNTURNED * abs(one.values[name]), ROUND * one.floors[name])
            for one in runs
            if name in one.values
        )
    ]


def cheapest(runs: list, tolerance: float) -> dict:
    """Label of the quickest run within the tolerance, by measure; None where no run is.

    A coarse run that is right by chance does not count: no finer run may leave the tolerance again.
    """
    out = {}
    for name in turned_by(runs):
        good = _confirmed(runs, lambda one, name=name: one.within(name, tolerance))
        out[name] = min(good, key=lambda one: one.seconds).label if good else None
    return out


def _confirmed(runs: list, good) -> list:
    """Runs for which good(run) holds and holds for every finer one that has an error; what the tolerance chooses
    stands by itself."""
    chain, alone, out = (
        [one for one in runs if one.value is not None],
        [one for one in runs if one.value is None],
        [],
    )
    for one in reversed(chain):
        # a best run that only the others are measured against
        if not one.errors and not one.distances:
            continue
        if not good(one):
            break
        out.append(one)
    return out + [one for one in alone if good(one)]


def quickest(runs: list, tolerance: float) -> Cost | None:
    """The run with least CPU seconds that has all measures within a tolerance, of those that cost the same the one
    with the smallest setting; None where no run has."""
    names = stated_names(runs)
    good = _confirmed(
        runs, lambda one: all(one.within(name, tolerance) for name in names if name in one.values)
    )
    least = min((one.seconds for one in good), default=inf)
    return next(
        (one for one in runs if one in good and one.seconds <= NOISE * least + JITTER), None
    )


def sentence(runs: list, tolerance: float) -> str:
    """Say which setting meets a tolerance in the least time, or which measure misses it in the best run."""
    names = stated_names(runs)
    if one := quickest(runs, tolerance):
        return (
            f"{one.words}: {_seconds(one)} per run, with every measure within the tolerance {tolerance:g}"
            + _effect(runs, tolerance)
        )
    known = [one for one in runs if one.errors or one.distances]
    worst, least = min(
        ((worst_error(one, names, tolerance), one) for one in known), key=lambda found: found[0]
    )
    share = format_number(worst.share, 2)
    if worst.share >= STUCK * max(
        worst_error(one, [worst.name], tolerance).share for one in known if worst.name in one.values
    ):
        return (
            f"no setting meets the tolerance {tolerance:g}: with every setting the error of {worst.name} is "
            f"{share}"
        )
    return (
        f"no setting meets the tolerance {tolerance:g}: the best run, with {least.words}, has an error of "
        f"{share} in {worst.name} and takes {_seconds(least)}"
    )


def _effect(runs: list, tolerance: float) -> str:
    """That a setting changes nothing, or nothing that counts, as words behind the sentence on its errors; "" where it
    does."""
    turned = turned_by(runs)
    if len(runs) < 2 or any(
        one.distances.get(name, 0.0)
        > allowed_error(tolerance, abs(one.values[name]), one.floors[name])
        for one in runs
        for name in turned
        if name in one.values
    ):
        return ""
    return "; the other settings change no result" + (
        " by more than the tolerance" if turned else " of this scene"
    )


def _seconds(one: Cost) -> str:
    """Format CPU seconds with two digits."""
    return f"{format_number(one.seconds, 2)} CPU s"


class WorstError(NamedTuple):
    """The measure of a run that is farthest from a tolerance.

    share: its error over what a tolerance of 1 would allow, to be compared with the tolerance; name: of the measure, ""
    if no error is known.
    """

    share: float
    name: str


def worst_error(one: Cost, names: list, tolerance: float) -> WorstError:
    """Find the measure, of `names`, that is farthest from a tolerance in a run."""
    sizes = {
        name: abs(one.values[name]) + one.floors[name] / tolerance
        for name in names
        if one.off(name)
    }
    return max(
        (WorstError(one.off(name) / size if size else inf, name) for name, size in sizes.items()),
        default=WorstError(0.0, ""),
    )


def worst_of_run(one: Cost) -> WorstError:
    """`worst_error` of all measures of a run for the tolerance that it was asked for."""
    return worst_error(one, list(one.values), one.tolerance)


def stated_names(runs: list) -> list:
    """Measures whose error any run states, or all where none does."""
    return [name for name in runs[-1].values if any(name in one.errors for one in runs)] or list(
        runs[-1].values
    )
