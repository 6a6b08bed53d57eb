"""Batch of lanes: lumped cases of one friction law marched side by side.

In: models of a group. Out: `CaseResults`. The errors come from a march with half the steps.

- Refinement: if an error of a case with a stretch law (tanh, Bouc-Wen, LuGre, bonds of constant
  length) misses the tolerance, a quarter of the steps is marched too, which shows how its
  errors fall. If errors still miss it, the case is marched with twice the steps, and its
  previous march serves the error.
- Settling: a case of the Iwan or the elastic-plastic law that has not settled marches on.
- Ringing in a permanent stick is computed in closed form for a single spring, else by a fit.
- Exact engine: a case goes to the exact batch `lumped`, or with a stretch law to a single run,
  if an error still misses its tolerance, if shorter sticks may ring, or if its motion grows.
- Check: a few cases are compared with the exact engine (with a stretch law twice, with its
  steps and with twice as many). If one differs, more are checked; if more than 3 in 100 differ,
  all cases of the batch are computed exactly, else those that differ.
"""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from time import perf_counter
from zlib import crc32

import numpy as np

from ....dynamics.lanes import reading
from ....dynamics.lanes import rows_kernels as at
from ....dynamics.lanes import run as march
from ....effects import is_bond_list, law_has_trait
from ....friction.laws.iwan import max_yield_displacement as largest_slide
from ....model.model import Model
from ....model.similar_models import SimilarModels, collect_columns, select_models
from ....response.errors import SUM_ROUND_OFF, coarser_errors, convergence_error, signed_change
from ....response.measures import energy_balance
from ....response.ringing import (
    MAX_DAMPING_RATIO,
    MIN_SINUSOID,
    SAMPLES_PER_PERIOD,
    measure_ringing,
)
from ....response.rows import larger_term
from ....response.settling import extrapolate_steady_amplitudes, window_amplitude_means
from ....scene.rules.accuracy import list_fixed_settings
from ....structure.drive_sizes import find_max_acceleration
from ...rig.motion_warnings import creeping_note
from ...rig.pieces import MAX_CHANGE_RATIO, measures_from_reading
from .. import one_by_one
from ..case_results import CaseResults
from . import lumped
from .columns import N_FINAL_WINDOWS, Runs, batch_answers
from .pieces import LONGEST, SHORTEST

AMPLITUDE = "relative_displacement_amplitude"
MIN_CASES = 64  # smallest number of cases of a study that lanes take
TIGHTEST = 1e-4  # smallest tolerance that lanes can meet
MAX_CASES_PER_CALL = 4096  # number of cases in one compiled call
# friction law in `dynamics.lanes` by the law of the scene
KINDS = {
    "coulomb": "rigid",
    "elastic-plastic": "yielding",
    "iwan": "masing",
    "tanh": "friction.laws.tanh_kernels",
    "bouc-wen": "friction.laws.bouc_wen_kernels",
    "lugre": "friction.laws.lugre_kernels",
    "nonlocal": "friction.laws.stretch_kernels",
}
MARCH_ON = "yielding", *march.MASING  # laws with which a motion is marched on until it is steady
# steps per cycle under a stretch law, and largest phase of its fastest rate in a step
SMOOTH, CALM = (
    (128, 256, 512, 1024, 2048),
    0.5,
)
# fraction of the relaxation rate of the speed in the layer of tanh, from which the errors need more
# steps
LAYER = 0.5
# rate of the force peak of LuGre over (acceleration / Stribeck speed), the inverse time of a
# reversal to pass this speed
PASSES = 0.75
# steps per cycle under a stretch law with which a ringing that is not found does not exist
RINGING = 512
# fastest rate over that of the drive, and the steps per cycle that it needs
RATES = (
    (5.0, 96),
    (10.0, 192),
    (20.0, 384),
)
# the same for a patch, represented by sliders
OF_TABLE = (
    (10.0, 96),
    (20.0, 192),
    (40.0, 384),
    (80.0, 768),
)
# factor on the error of the fit of a ringing, because the march causes similar errors in all of its
# samples
OF_FIT = 5.0
# smallest relative error, a hundredth of TIGHTEST: both marches may miss the same event
LEAST_ERROR = 1e-6
NO_LOOP = 1e-6  # relative to largest force times slide; a case with a smaller loop area sticks
# a case that has not settled marches for at most MORE times its cycles; largest remaining change
# over a tenth of these
MORE, SETTLED = (
    10,
    1e-5,
)
LATE = 100  # factor on SETTLED at the end of this march
# fractions of its cycles after which it is tested whether a case has settled
PACES = (
    0.25,
    0.25,
    0.5,
    *(MORE - 1) * (1.0,),
)
# Error of an extrapolated range over the error that the extrapolation states, and its minimum over
# the range: 1 of 571 was larger.
OF_STATED, OF_TAIL = 2.5, 7e-6
# In a check of the Iwan law: how often the cells of a single run are doubled, and the factor on its
# errors. 1 of 590 random cases differed by more than one error, by 1.9.
FINER_CELLS, SHORT = 2, 2.0
RING = "ring_frequency", "ring_damping"
# Largest relative change of each measure on a coarser mesh that is fine enough; the loop of a small
# slip may be completely uncertain.
WILD = ("relative_displacement_amplitude", 0.1), ("friction_force_peak", 0.1), ("loop_area", 10.0)
# fraction of a loop by which a loop that is forgotten for lack of memory may be larger
DROPPED_LOOP_RATIO = 1e-2
# One of this many cases is checked with the exact engine, and at least this many of a batch.
CHECKED, FEWEST = (
    200,
    2,
)
# If one differs, this many more are checked; from this fraction of differing cases, all are
# computed exactly.
IN_DOUBT, WRONG = (
    70,
    0.03,
)
# phase of the free vibration in a stick interval [rad], above which ringing is searched for
RINGS = 0.9 * 3 * np.pi


def refuses(model: Model) -> str:
    """Return why lanes do not take a model; "" if they do."""
    return no_lanes(model) or (
        ""
        if steps_per_cycle([model])[0]
        else "its free vibration is too fast for the time steps of its drive"
    )


def no_lanes(model: Model) -> str:
    """Return why lanes take no model with the options of this one, whatever its numbers, or ""."""
    if why := lumped.not_one_point(model):
        return why
    if not SHORTEST <= model.rig.drive.cycles <= LONGEST or not model.friction.static > 0:
        return "its cycles are too few or too many, or it has no friction"
    if model.friction.law not in KINDS:
        return "its law cannot be computed for many cases at once"
    return _why_more_states(model.friction) or asks_more(model)


def asks_more(model: Model) -> str:
    """Return why the requested accuracy of a model exceeds that of lanes; "" if it does not."""
    if (
        model.accuracy.method != "auto"
        or list_fixed_settings(model.accuracy)
        or model.accuracy.tolerance < TIGHTEST
    ):
        return "the case asks for another method, or for an accuracy beyond that of a batch"
    return ""


def _why_more_states(friction) -> str:
    """Return why a stretch law has states besides its stretch; "" if it has none."""
    grows = law_has_trait(friction.law, "bonds") and (
        is_bond_list(friction) or friction.slip_growth is not None
    )
    return "its bonds grow, or are computed as a list of bonds" if grows else ""


def _creates(model: Model):
    """Return whether a stretch law may create energy, or its bonds differ in their stretch."""
    f = model.friction
    if law_has_trait(f.law, "bonds"):
        return np.not_equal(f.breakaway or 0.0, 0.0) | np.not_equal(f.initial_bonds, 1.0)
    if f.law == "lugre":  # from this damping on, its power may be negative
        return np.greater(f.micro_damping * model.rig.speed_scale, 4 * law_numbers(model)[1])
    return np.less(f.shape, 0.5) if f.law == "bouc-wen" else False


def law_numbers(model: Model) -> tuple:
    """Return the numbers of a stretch law for its `rate_equation`, and its length [m].

    The length is 0 for a law without one.
    """
    f = model.friction
    load = model.point.load
    limit = model.friction_limits(model.point.load)[0]
    if f.law == "tanh":
        return limit, 1 / f.reference_speed, 0.0
    if law_has_trait(f.law, "bonds"):
        return limit / f.bond_length, f.bond_length, f.bond_length
    if f.law == "bouc-wen":
        return limit, limit / f.stiffness, f.exponent, f.shape, limit / f.stiffness
    kinetic = f.static if f.kinetic is None else f.kinetic
    return (
        f.stiffness,
        kinetic * load,
        limit,
        f.stribeck_speed,
        f.micro_damping,
        f.viscous,
        limit / f.stiffness,
    )


def steps_per_cycle(models: Sequence[Model]) -> np.ndarray:
    """Return the steps per cycle (n,) of models of one law; 0 if there would be too many."""
    smooth = march.has_one_stretch(KINDS[models[0].friction.law])
    ends = [(CALM * steps / (2 * np.pi), steps) for steps in SMOOTH] if smooth else RATES
    return steps_at_rate(collect_columns(models, _rate)[0], ends)


def steps_at_rate(rate, ends) -> np.ndarray:
    """Return the steps per cycle (n,) for ratios (n,) of the fastest rate to that of the drive.

    ends: sequence of (largest rate, steps).
    """
    return np.append([steps for _, steps in ends], 0)[
        np.searchsorted([end for end, _ in ends], rate)
    ]


def fastest_rate(model: Model, stiffness):
    """Return the fastest rate of a model with a contact stiffness [N/m], over that of its drive."""
    modes = model.rig.modes
    return (
        np.sqrt(modes.omega[0] ** 2 + stiffness * modes.slide[0] ** 2 / modes.mass)
        + modes.damping_matrix[0, 0]
    ) / model.rig.drive.signal.omega


def _rate(model: Model) -> tuple:
    """Return the fastest rate of a model over that of its drive; inf if lanes cannot follow it."""
    modes = model.rig.modes
    omega = model.rig.drive.signal.omega
    damper = model.rig.modes.damping_matrix[0, 0]
    scale = modes.slide[0] ** 2 / modes.mass
    stiff = _contact(model)[0] * scale
    if not march.has_one_stretch(KINDS[model.friction.law]):
        return (fastest_rate(model, _contact(model)[0]),)
    rate = damper
    if model.friction.law == "tanh":
        rate = (
            model.friction_limits(model.point.load)[0] / model.friction.reference_speed * scale
            + damper
        )
        rate = np.where(rate > CALM * SMOOTH[-1] / (2 * np.pi) * omega, np.inf, LAYER * rate)
    # its force peak during a reversal lasts as long as the speed is below the Stribeck speed
    if model.friction.law == "lugre":
        turns = np.abs(modes.slide[0] * modes.base[0]) * find_max_acceleration(
            model.rig.drive.signal
        )
        rate = np.maximum(damper, PASSES * turns / model.friction.stribeck_speed)
    return (
        np.where(
            _creates(model), np.inf, np.maximum(rate, np.sqrt(modes.omega[0] ** 2 + stiff)) / omega
        ),
    )


def _contact(model: Model) -> tuple:
    """Return stiffness in stick [N/m], length [m] and other numbers of a contact (see `Cases`)."""
    friction = model.friction
    static = model.friction_limits(model.point.load)[0]
    if friction.law == "iwan":
        chi = friction.chi
        share = 1 / (1 + friction.beta)
        # fraction of the friction that slips before the last slider does
        slips = share * (chi + 1) / (chi + 2 - share)
        half = np.minimum(1.0, (0.5 / slips) ** (1 / (chi + 2)))
        return (
            friction.stiffness,
            largest_slide(static, friction.stiffness, chi, friction.beta),
            chi + 1,
            share,
            half,
        )
    if march.has_one_stretch(KINDS[friction.law]):
        *numbers, length = law_numbers(model)
        return 0.0 if friction.law == "tanh" else static / length, length, *numbers
    return (
        (static / friction.bond_length, friction.bond_length)
        if friction.law == "elastic-plastic"
        else (0.0, 0.0)
    )


def group(model: Model) -> tuple:
    """Return a key that is equal for models of one compiled call."""
    return int(model.rig.drive.cycles), model.friction.law


def parts(models: Sequence) -> dict[tuple, list]:
    """Return the indices of the models that lanes take, by group."""
    places: dict = {}
    if isinstance(models, SimilarModels):
        places |= {} if no_lanes(models.first) else {group(models.first): range(len(models))}
    else:
        for case, model in enumerate(models):
            if isinstance(model, Model) and not no_lanes(model):
                places.setdefault(group(model), []).append(case)
    steps = {key: steps_per_cycle(select_models(models, cases)) for key, cases in places.items()}
    return {
        key: np.array(cases)[steps[key] > 0].tolist()
        for key, cases in places.items()
        if steps[key].any()
    }


def solve(models: Sequence[Model], say=None) -> CaseResults:
    """Return the case results of models of one group."""
    found = CaseResults.blank(len(models))
    for first in range(0, len(models), MAX_CASES_PER_CALL):
        part = select_models(models, range(first, min(first + MAX_CASES_PER_CALL, len(models))))
        found.place(range(first, first + len(part)), _solve_cases(part, say))
    return found


def _solve_cases(models: Sequence[Model], say) -> CaseResults:
    """Return the case results of models by `solve_and_check`, with the notes of law 'tanh'."""
    law = models[0].friction.law

    def exact(places, check: bool) -> CaseResults:
        """Return the results of some cases by the exact engine."""
        return run_exact_cases(
            select_models(models, places), say, FINER_CELLS if law == "iwan" and check else 0
        )

    found, others, _ = solve_and_check(
        models, (*make_cases(models), None), steps_per_cycle(models), exact
    )
    if law == "tanh":
        speeds = collect_columns(models, lambda model: (model.friction.reference_speed,))[0]
        first = models[0].friction
        notes = {
            one: creeping_note(first.model_copy(update={"reference_speed": one}))
            for one in {*speeds.tolist()}
        }
        found.notes |= {case: [*notes[speeds[case]]] for case in np.flatnonzero(~others).tolist()}
    return found


def solve_and_check(models: Sequence[Model], cases: tuple, steps, exactly: Callable) -> tuple:
    """Return the results of models by lanes, of which a few are checked with the exact engine.

    If these differ, cases of a stretch law are marched with twice the steps, and more cases are
    checked; if more than a few still differ, all cases are computed exactly.

    Parameters
    ----------
    models : sequence of Model
    cases : tuple
        From `make_cases`, and the same on a coarser mesh or None.
    steps : (n,)
        Steps per cycle.
    exactly : callable
        Function (indices, is_check) that returns the exact results of some cases.

    Returns
    -------
    tuple
        CaseResults; which (n,) were not computed by lanes; largest output (n,) [m].
    """
    begin = perf_counter()
    law = lane_kind(models[0])
    found, exact, steps, reach = _side_by_side(models, cases, steps)
    found.seconds[:] = (perf_counter() - begin) / len(models)
    marks = np.column_stack(cases[0])
    looked = select_checked_cases(marks, ~exact)
    ones = exactly(looked, True) if looked else None
    times = SHORT if law == "masing" else 1.0
    again = np.flatnonzero(~exact & (2 * steps <= SMOOTH[-1]))
    wrong = find_differences(found, ones, looked, exact, times)
    if wrong and again.size and march.has_one_stretch(law):
        finer, exact[again], *_ = _side_by_side(
            select_models(models, again), _select(cases, again), 2 * steps[again]
        )
        lumped.take_out(found, again)
        found.place(again, finer)
        wrong = find_differences(found, ones, looked, exact, times)
    if wrong:  # more checks show whether these differences are exceptions
        free = ~exact
        free[looked] = False
        more = select_checked_cases(marks, free, IN_DOUBT)
        others = find_differences(found, exactly(more, True) if more else None, more, exact, times)
        looked = [*looked, *more]
        wrong = wrong | others
    whole = len(wrong) > WRONG * len(looked)
    exact[list(wrong)] = True
    exact |= whole
    if (places := np.flatnonzero(exact)).size:
        lumped.take_out(found, places)
        found.place(places, exactly(places.tolist(), False))
    for case in places.tolist() if whole else wrong:
        of = next(iter(wrong.values())) if whole else wrong[case]
        found.notes[case] = [
            *found.notes.get(case, ()),
            (
                f"in {len(looked)} cases the fast engine was checked against the exact engine and differed from it in "
                f"{len(wrong)}, in {of} {'for example' if whole else 'of this case'}, so "
                f"{'all cases were' if whole else 'this case was'} computed by the exact engine"
            ),
        ]
    return found, exact, reach


def _side_by_side(models: Sequence[Model], cases: tuple, steps) -> tuple:
    """March models side by side, and refine the steps until their errors meet the tolerance.

    All cases with the same steps march together, including those whose errors need these steps. If
    the difference from half the steps is too large with a stretch law, a quarter of them shows how
    the errors fall. The difference from a coarser mesh is computed with the fewest steps. More are
    used if this difference exceeds the limits in WILD, or if the case sticks, because what then
    remains of the third harmonic depends on both.

    Parameters
    ----------
    models : sequence of Model
    cases : tuple
        See `solve_and_check`.
    steps : (n,)
        First number of steps per cycle.

    Returns
    -------
    tuple
        CaseResults; which (n,) must be run otherwise; steps per cycle (n,); largest output (n,)
        [m].
    """
    found = CaseResults.blank(len(models))
    exact = np.zeros(len(models), bool)
    steps = steps.copy()
    reach = np.zeros(len(models))
    law = lane_kind(models[0])
    cycles = group(models[0])[0]
    meshed = {}
    fewest = steps // 2
    known = {}
    flows = march.has_one_stretch(law)
    now = int(fewest.min())
    smooth = flows or law in march.MASING
    finest = (SMOOTH if smooth else RATES[-1])[-1]

    def tell_mesh(places, fine: dict) -> None:
        """Store the errors of some cases due to the mesh."""
        rough = _march_and_measure(law, *_select(cases[2], places), cycles, now)[0]
        for name, error in _mesh_errors(fine, rough).items():
            meshed.setdefault(name, np.zeros(len(models)))[places] = error

    def measured(places, count: int) -> tuple:
        """March some cases, and store their measures under their number of steps."""
        seen = _march_and_measure(law, *_select(cases[:2], places), cycles, count)
        for name, column in seen[0].items():
            known.setdefault(count, {}).setdefault(name, np.full(len(models), np.nan))[places] = (
                column
            )
        return seen

    def tell(places, seen: tuple, *shares: int) -> np.ndarray:
        """Store the results of some cases; return which have too large errors."""
        fewer = [_select(known[now // share], places) for share in shares]
        some_cases = *_select(cases[:2], places), _select(meshed, places)
        answers, exact[places], wide = _march_cases(
            select_models(models, places), some_cases, now, seen, fewer
        )
        lumped.take_out(found, places)  # the results with fewer steps are replaced
        found.place(places, answers)
        return wide

    while (steps >= now).any():
        here = np.flatnonzero((fewest <= now) & (steps >= now))
        ready = np.flatnonzero(steps[here] == now)
        if here.size:
            seen = measured(here, now)
            places = here[ready]
            tells = fewest[here] == now
            if meshed and ready.size:
                own = _select(seen[0], ready)
                tells[ready] |= _needs_finer_mesh(own, _select(meshed, places)) | ~_loops(own)
            if cases[2] is not None and tells.any():
                tell_mesh(here[tells], _select(seen[0], tells))
        if ready.size:
            reach[places] = np.abs(seen[3][ready]).max(axis=(1, 2))
            wide = tell(places, _select(seen, ready), 2)
            if flows and wide.any():
                if (lack := places[wide & (2 * fewest[places] == now)]).size:
                    measured(lack, now // 4)
                wide[wide] = tell(places[wide], _select(seen, ready[wide]), 2, 4)
            more = wide & (2 * now <= finest) & (smooth | ~exact[places])
            steps[places[more]] = 2 * now
            exact[places[wide]] = ~more[wide]
        now *= 2
    return found, exact, steps, reach


def _needs_finer_mesh(values: dict, meshed: dict) -> np.ndarray:
    """Return which cases (n,) a coarser mesh changes by more than the limits in WILD.

    values, meshed: measures, and their errors due to the mesh, (n,) by name.
    """
    return np.any(
        [~(meshed[name] <= share * np.abs(values[name])) for name, share in WILD if name in meshed],
        axis=0,
    )


def _select(found, places):
    """Return the rows of some cases from arrays in a dict or a tuple; other entries are common."""
    if isinstance(found, dict):
        return {name: _select(one, places) for name, one in found.items()}
    if isinstance(found, tuple):
        parts = [_select(one, places) for one in found]
        return type(found)(*parts) if hasattr(found, "_fields") else tuple(parts)
    return found[places] if np.ndim(found) else found


def _march_cases(
    models: Sequence[Model], cases: tuple, steps: int, seen: tuple, coarser: list
) -> tuple:
    """Return the results of models from a march with `steps` per cycle.

    Also returns which cases (n,) must be run otherwise, and which need more steps. The parameters
    are those of `collect_runs`.
    """
    window = count_evaluated_cycles(group(models[0])[0])
    wide_of = partial(has_large_error, models, meshed=cases[2])
    runs, exact, lost = collect_runs(models, cases, steps, seen, coarser)
    found, alone, _ = batch_answers(
        models, runs, {"engine": "exact", "window_cycles": window}, wide_of
    )
    chosen = {"engine": "lanes", "steps_per_cycle": steps, "window_cycles": window}
    found.numerics.update(dict.fromkeys(range(len(models)), chosen))
    return found, exact | (found.outcome == "grows"), wide_of(found) | lost | alone


def run_exact_cases(models: Sequence[Model], say, finer: int = 0) -> CaseResults:
    """Return the case results of models of a group by the exact batch, or else by single runs.

    Parameters
    ----------
    models : sequence of Model
    say : callable or None
        Callback for a line of text.
    finer : int
        How often the cells of a density are doubled.
    """
    models = list(models)
    found = CaseResults.blank(len(models))
    fit = np.array([not lumped.refuses(model) for model in models])
    for cases, solves in (
        (np.flatnonzero(fit), partial(lumped.solve, finer=finer)),
        (np.flatnonzero(~fit), one_by_one.solve),
    ):
        if cases.size:
            found.place(cases, solves([models[case] for case in cases], say))
    return found


def has_large_error(models, found: CaseResults, meshed: dict | None = None) -> np.ndarray:
    """Return whether an error of a case exceeds its tolerance, (n,).

    The tolerance applies to a measure or to the larger terms of which it is the difference. The
    errors due to the mesh are not counted, because no other engine reduces them.

    Parameters
    ----------
    models : sequence of Model
    found : CaseResults
    meshed : dict, optional
        Errors due to the mesh, (n,) by name.
    """
    tolerance = collect_columns(models, lambda model: (model.accuracy.tolerance,))[0]
    out = np.zeros(len(models), bool)
    for name, values in found.values.items():
        if name in RING:  # the fit of a single run is no more accurate
            continue
        if name.endswith("_steady") and lane_kind(models[0]) not in MARCH_ON:
            # an extrapolation has the same error with finer steps, and with the exact engine
            continue
        of_mesh = (meshed or {}).get(name.removesuffix("_steady"), 0.0)
        floors = np.fmax(found.floors[name], tolerance * larger_term(name, found.values))
        # it is the loop area over an energy, and not more accurate than this area
        if name == "equivalent_damping" and "loop_area" in found.values:
            floors = np.fmax(
                floors, found.floors["loop_area"] * _damping_per_loop_area(found.values)
            )
        out |= found.errors[name] - of_mesh > tolerance * np.abs(values) + floors
    return out


def select_checked_cases(marks, free, least: int = FEWEST) -> list:
    """Return the indices of the cases that the exact engine checks.

    They are chosen by a hash of each case, so that the choice does not depend on other cases.

    Parameters
    ----------
    marks : (n, k)
        Numbers that identify each case.
    free : (n,) of bool
        Cases that may be checked.
    least : int
        Smallest number of cases, if there are so many.
    """
    hashes = np.array([crc32(row.tobytes()) for row in marks])
    order = [case for case in np.argsort(hashes, kind="stable").tolist() if free[case]]
    few = sum(hashes[case] < 2**32 // CHECKED for case in order)
    return order[: max(few, least)]


def find_differences(
    found: CaseResults, ones: CaseResults | None, looked: list, exact, times: float = 1.0
) -> dict[int, str]:
    """Return the first measure of each case that differs from its exact result, by case.

    It differs by more than the sum of both errors and the floor.

    Parameters
    ----------
    found : CaseResults
    ones : CaseResults or None
        Exact results of some cases.
    looked : list
        Indices of these cases.
    exact : (n,) of bool
        Cases that lanes did not compute.
    times : float
        Factor on the exact errors.
    """
    wrong: dict[int, str] = {}
    for place, case in enumerate(looked):
        for name, column in found.values.items() if not exact[case] else ():
            if not (name in ones.values and ones.has(name, place)):
                continue
            apart = abs(column[case] - ones.values[name][place])
            if name == "slip_start_phase":
                apart = min(apart, np.pi - apart)
            bars = np.nan_to_num(found.errors[name][case]) + times * np.nan_to_num(
                ones.errors[name][place]
            )
            if apart > bars + found.floors[name][case]:
                wrong.setdefault(case, name)
    return wrong


def collect_runs(models, cases: tuple, steps: int, seen: tuple, coarser: list) -> tuple:
    """Return the Runs of models of a group from their march.

    Parameters
    ----------
    models : sequence of Model
    cases : tuple
        From `make_cases`, and the errors due to the mesh.
    steps : int
        Steps per cycle.
    seen : tuple
        From `_march_and_measure` with these steps.
    coarser : list of dict
        Measures with half, and perhaps a quarter, of the steps.

    Returns
    -------
    tuple
        Runs; which cases (n,) must be run otherwise; which (n,) need more steps.
    """
    law, cycles, (cases, c, meshed), (values, book, found, extremes, rise) = (
        lane_kind(models[0]),
        group(models[0])[0],
        cases,
        seen,
    )
    window = count_evaluated_cycles(cycles)
    errors = step_errors(values, coarser)
    errors |= {
        name: errors[name] + error for name, error in (meshed or {}).items() if name in errors
    }
    slips = found.reading("MAX_SLIP") - found.reading("MIN_SLIP")
    stuck = slips / 2 <= np.maximum(
        c["held"], SUM_ROUND_OFF * np.abs(found.history[:, :, :2]).max(axis=(1, 2))
    )
    stuck &= (cases.spring > 0) | (law == "rigid")
    exact = np.any(
        [np.isnan(values[name]) != np.isnan(coarser[0][name]) for name in values], axis=0
    )
    rings, told, untold, faint = _rings(law, cases, c, found, (stuck, window, steps))
    errors = errors | told
    exact = exact | untold
    steady = None
    if law in MARCH_ON:
        steady, open_ones = _march_until_settled(
            law, cases, found, steps, window_amplitude_means(extremes, window)[0], ~stuck
        )
        steady = tuple(np.abs(c["ratio"]) * one for one in steady)
        exact = exact | open_ones
    if law in march.MASING:
        exact |= march.law_state(law, found.motion, "MAX_DROPPED_GAP") > DROPPED_LOOP_RATIO
    phasors = (found.history[:, :, 2:] @ [1, 1j]) * c["ratio"][:, None]
    ends = np.arange(cycles - 1, -1, -window)[::-1][-N_FINAL_WINDOWS:]
    nowhere = np.zeros(len(models), bool)  # lost cases are returned separately
    (tolerance,) = collect_columns(models, lambda model: (model.accuracy.tolerance,))
    runs = Runs(
        cycles,
        window,
        values | rings,
        book,
        extremes,
        phasors[:, ends],
        stuck,
        nowhere,
        errors,
        LEAST_ERROR,
        np.inf,
        stuck & (rise > tolerance * values["friction_force_peak"]),
        steady,
        again=False,
    )
    ended = np.isfinite(found.motion[:, at.SLIDE] + coarser[0]["friction_work"])
    return runs, exact, faint | ~ended


def may_ring(cases, found) -> np.ndarray:
    """Return whether a stick interval of the last cycles is long enough for ringing, (n,)."""
    own = np.sqrt(np.maximum(cases.stiffness + cases.spring - cases.damping**2 / 4, 0.0))
    return found.reading("LONGEST_STICK") * own >= RINGS


def may_contain_transient(cases, found) -> np.ndarray:
    """Return whether a transient or ringing may remain at the end of a run, (n,).

    What remains is at most the change between the last two cycles over the fraction that the damper
    removes in one cycle.
    """
    last = found.history[:, -2:, :2]
    change = np.abs(last[:, 1] - last[:, 0]).max(axis=1) / np.maximum(
        -np.expm1(-np.pi * cases.damping), 1e-300
    )
    gain = np.abs(cases.output_gain) * (cases.stiffness + cases.spring) * change
    return gain > MIN_SINUSOID / 3 * found.reading("MAX_ACCELERATION")


def _rings(law: str, cases, c: dict, found, read: tuple) -> tuple:
    """Return the ringing by name, its errors, and which cases need another run.

    The ringing is computed if the interface sticks all the time: in closed form for a spring, else
    by the fit of a single run.

    Parameters
    ----------
    law : str
    cases : Cases
    c : dict
        Other numbers from `make_cases`.
    found : Marched
    read : tuple
        Which cases (n,) stick, evaluated cycles of a motion that is not periodic, steps per cycle.

    Returns
    -------
    tuple
        ring_frequency [Hz] and ring_damping [1] by name, their errors, which cases (n,) need a
        single run, and which need more steps.
    """
    (stuck, window, steps), n, faint = (
        read,
        len(found.n_before),
        np.zeros(len(found.n_before), bool),
    )
    out = tuple({name: np.full(n, np.nan) for name in RING} for _ in range(2))
    if law == "rigid":  # a rigid interface with one mode does not move while it sticks
        return *out, faint, faint
    rings = may_ring(cases, found)
    marched = found.n_before >= found.history.shape[1] - window
    held = found.reading("STICK_ANGLE") > 2 * np.pi * (found.n_observed - 1e-6)
    if law == "yielding":
        _ring_on_springs(cases, c, found, held & rings & marched, out)
        return *out, rings & ~held, faint
    # a periodic motion does not ring, but a transient may remain if the interface always sticks
    may = (
        (rings & marched & (march.law_state(law, found.motion, "EVER_SLIPPED") > 0))
        | (may_contain_transient(cases, found) & stuck)
        if law in march.MASING
        else may_contain_transient(cases, found) & (stuck | rings)
    )
    untold = may & ~held
    told = may & held
    strides = steps / (
        SAMPLES_PER_PERIOD * np.sqrt(np.maximum(cases.stiffness + cases.spring, 1.0))
    )
    # the stride of a case does not depend on other cases
    strides = 2 ** np.log2(np.maximum(strides, 1.0)).astype(int)
    where = np.flatnonzero(told)
    every = (
        march.output_accelerations(
            law, _select(cases, where), found.observed_start[where], window, steps
        )
        if where.size
        else ()
    )
    for case, signal in zip(where.tolist(), every):
        omega = float(c["omega"][case])
        signal = signal[:: strides[case]]
        time = np.linspace(0, 2 * np.pi * window / omega, len(signal))
        values, apart = measure_ringing(time, signal, [(0.0, time[-1])], omega)
        # with so few steps, a ringing may be missed
        faint[case] = not values and march.has_one_stretch(law) and steps < RINGING
        for name, value in values.items():
            out[0][name][case] = value
            out[1][name][case] = OF_FIT * apart[name]
    return *out, untold, faint


def _ring_on_springs(cases, c: dict, found, held, out: tuple) -> None:
    """Compute the ringing of cases (n,) `held` that a spring holds in all evaluated cycles.

    It is known in closed form, with the criteria of `response.ringing`; `out` is filled: values and
    errors by name.
    """
    beta = cases.stiffness + cases.spring
    half = cases.damping / 2
    angle = 2 * np.pi * found.n_observed
    own = np.sqrt(np.maximum(beta - half**2, 0.0))
    far = beta - 1
    whole = far**2 + cases.damping**2
    begun = found.observed_start
    place = found.observed_start[:, at.MEMORY]
    with np.errstate(
        all="ignore"
    ):  # the motion without that of the sine and without the stretch of the spring
        z = begun[:, at.SLIDE] - cases.spring * place / beta + cases.drive * cases.damping / whole
        other = (begun[:, at.SPEED] - cases.drive * far / whole + half * z) / own
        damping = half / np.sqrt(beta)
        forced = (angle > 3 * np.pi) & (damping < 1e-3) & (np.abs(own - np.round(own)) < 1e-2)
        size = np.abs(cases.output_gain) * beta * np.hypot(z, other)
        told = (
            held
            & (angle * own >= 3 * np.pi)
            & (damping < MAX_DAMPING_RATIO)
            & ~forced
            & (whole > 1e-18 * beta**2)
            & (size > MIN_SINUSOID * found.reading("MAX_ACCELERATION"))
        )
    for name, value in zip(RING, (own * c["omega"] / (2 * np.pi), damping)):
        out[0][name][told] = value[told]
        out[1][name][told] = 0.0


def _march_until_settled(law: str, cases, found, steps: int, amplitudes, free) -> tuple:
    """March cases on until they settle, and return their amplitudes.

    They march on by a fraction of their cycles at first, later by all of these, each until it
    settles, so that those that settle soon cost little.

    Parameters
    ----------
    law : str
    cases : Cases
    found : Marched
    steps : int
        Steps per cycle.
    amplitudes : (n, w)
        Output per window [m].
    free : (n,) of bool
        Cases that may march on.

    Returns
    -------
    tuple
        Half the range of the slide of the steady motion and its error, (n,) each [m], NaN if not
        needed; which cases (n,) do not settle within MORE times their cycles, even by
        extrapolation.
    """
    out = np.full((2, len(free)), np.nan)
    part = found.history.shape[1]
    if amplitudes.shape[1] > 2:
        free = free & (
            np.ptp(amplitudes[:, -3:], axis=1) > MAX_CHANGE_RATIO * TIGHTEST * amplitudes[:, -1]
        )
    lost = free.copy()
    where = np.flatnonzero(free)
    motion = found.motion[free]
    history = found.history[where]
    for share in PACES:
        if not where.size:
            break
        here = _select(cases, where)
        before = motion
        more, motion = march.continue_march(law, here, before, max(1, int(share * part)), steps)
        history = np.concatenate([history, more], axis=1)
        late = history.shape[1] > MORE * part
        least = _bound_free_motion(here, before, motion, more.shape[1])
        value, error = _steady_half_range(history, part, least, (LATE if late else 1) * SETTLED)
        near = (LATE if late else 2) * SETTLED
        ranges = np.ptp(history[:, -part:, :2], axis=2) / 2
        known = error < near * ranges[:, -1]
        if law == "yielding":
            known &= _slips_until_steady(ranges, cases.yield_length[where], value, error)
        out[:, where[known]] = (value[known], error[known])
        lost[where[known]] = False
        where = where[~known]
        motion = motion[~known]
        history = history[~known]
    return tuple(out), lost


def _slips_until_steady(ranges, length, value, error) -> np.ndarray:
    """Return whether a motion slips in all cycles up to its steady state, or in none, (n,).

    If the slip ceases before the steady state, the free motion decays differently from then on.

    Parameters
    ----------
    ranges : (n, c)
        Half the range of the slide in the last cycles [m].
    length : (n,)
        Stretch above which it slips [m].
    value, error : (n,)
        Half the range in the steady state and its error [m].
    """
    least = np.minimum(ranges.min(axis=1), value - error)
    most = np.maximum(ranges.max(axis=1), value + error)
    return (least > length) | (most < length)


def _bound_free_motion(cases, before, motion, cycles: int) -> np.ndarray:
    """Return an upper bound of the remaining free motion (n,) [m].

    It follows from the change in `cycles` cycles, and from the smallest decay by the damper in
    them: with a slow beat, the extremes hardly change while it is largest.
    """
    own = np.sqrt(cases.stiffness + cases.spring)
    half = cases.damping / 2
    step = np.hypot(
        motion[:, at.SLIDE] - before[:, at.SLIDE], (motion[:, at.SPEED] - before[:, at.SPEED]) / own
    )
    goes = -np.expm1(
        -2 * np.pi * cycles * (half - np.sqrt(np.maximum(half**2 - cases.stiffness, 0.0)))
    )
    return step * (1 - goes) / np.maximum(goes, 1e-300)


def _steady_half_range(history, part: int, least, near: float) -> tuple:
    """Return half the range of the slide in the steady state and its error, (n,) each [m].

    It is the last range if it hardly changes in `part` cycles, not more than in those before, and
    if the remaining free motion is below the fraction `near` of it; else an extrapolation of
    windows, at last of windows of `part` cycles.

    Parameters
    ----------
    history : (n, c, 4)
        Cycles of the cases.
    part : int
        Cycles of the first march.
    least : (n,)
        Upper bound of the remaining free motion [m].
    near : float
        Largest relative change.

    Returns
    -------
    tuple
        NaN if it is not known.
    """
    ranges = np.ptp(history[:, :, :2], axis=2) / 2
    count = history.shape[1]
    last = ranges[:, -1]
    left = 2 * np.ptp(ranges[:, -part:], axis=1)
    before = 2 * np.ptp(ranges[:, -2 * part : -part], axis=1) if count >= 2 * part else np.inf
    closes = (np.maximum(left, least) < near * last) & (left <= np.maximum(before, 1e-9 * last))
    ends = np.arange(
        count - 1, 0, -(part if count > MORE * part else count_evaluated_cycles(part))
    )[::-1]
    with np.errstate(all="ignore"):
        value, error = extrapolate_steady_amplitudes(
            ranges[:, ends], history[:, ends, 2:] @ [1, 1j]
        )
    tail = np.maximum(OF_STATED * error, OF_TAIL * value)
    return np.where(closes, last, value), np.where(
        closes, np.maximum(left, least) + 1e-9 * last, tail
    )


def make_cases(models, contacts=None) -> tuple:
    """Return the Cases of models, and further numbers (n,) by name in SI units.

    contacts: numbers (m, n) of the contacts as from `_contact_numbers`; None: those of single points.
    """
    own, damping, slide, share, output, mass, drive, w, moving, z, v, stiffness, size = (
        collect_columns(models, _rig_numbers)
    )
    static, kinetic, load, spring, length, *numbers = (
        collect_columns(models, _contact_numbers) if contacts is None else contacts
    )
    law = lane_kind(models[0])
    scale = slide**2 / (mass * w**2)
    numbers = np.array(numbers).T
    numbers = (
        numbers * march.number_scales(law, scale, w)
        if march.has_one_stretch(law)
        else numbers.reshape(len(w), -1)
    )
    cases = march.Cases(
        damping / w,
        (own / w) ** 2,
        -slide * share * drive / w**2,
        scale * kinetic,
        scale * static,
        scale * spring,
        length,
        output / slide * w**2,
        drive * moving,
        slide * z,
        slide * v / w,
        numbers,
    )
    return cases, {
        "omega": w,
        "energy": mass * (w / slide) ** 2,
        "ratio": output / slide,
        "held": 1e-3 * np.divide(static, spring, out=0 * w, where=spring > 0),
        "stiffness": stiffness,
        "load": load,
        "size": size,
    }


def _rig_numbers(model: Model) -> tuple:
    """Return the numbers of a model, except its contact, for `make_cases`."""
    modes = model.rig.modes
    drive = model.rig.drive.signal
    start = model.rig.start
    return (
        modes.omega[0],
        modes.damping_matrix[0, 0],
        modes.slide[0],
        modes.base[0],
        modes.output[0],
        modes.mass,
        drive.acceleration,
        drive.omega,
        drive.moving,
        *((0.0, 0.0) if start is None else (start.z[0], start.v[0])),
        model.rig.first_mode.stiffness,
        find_max_acceleration(drive),
    )


def _contact_numbers(model: Model) -> tuple:
    """Return the numbers of the contact of a model for `make_cases`.

    They are static and kinetic friction [N], load [N], and those of `_contact`.
    """
    static, kinetic = model.friction_limits(model.point.load)
    kinetic = (
        kinetic if lane_kind(model) == "rigid" and model.friction.kinetic is not None else static
    )
    return static, kinetic, model.point.load, *_contact(model)


def lane_kind(model: Model) -> str:
    """Return the law of a model in `dynamics.lanes`; for a patch, the table of its elements."""
    return KINDS[model.friction.law] if model.patch is None else "table"


def _mesh_errors(fine: dict, rough: dict) -> dict:
    """Return the errors (n,) by name due to a mesh, estimated from a coarser one.

    The error of a measure that the coarser mesh does not have is its absolute value.
    """
    with np.errstate(all="ignore"):
        return {
            name: np.where(np.isnan(error), np.abs(fine[name]), error)
            for name, error in coarser_errors(fine, rough).items()
        }


def count_evaluated_cycles(cycles: int) -> int:
    """Return the number of last cycles that are evaluated."""
    return min(10, cycles // 10)


def _march_and_measure(law: str, cases, c: dict, cycles: int, steps: int) -> tuple:
    """March cases, and evaluate the last cycles.

    Returns the measures by name, energies [J], Marched, extremes of the output (n, c, 2) [m], and
    the increase of the friction force [N].
    """
    found = march.march(law, cases, cycles, count_evaluated_cycles(cycles), steps)
    window = count_evaluated_cycles(cycles)
    extremes = found.history[:, :, :2] * c["ratio"][:, None, None]
    extremes[c["ratio"] < 0] = extremes[c["ratio"] < 0, :, ::-1]
    book = reading.run_energies(law, cases, found, c["energy"])
    seen = reading.reading_of_runs(
        law, cases, found, c["energy"], c["omega"], extremes[:, -window:]
    )
    with np.errstate(all="ignore"):
        values = measures_from_reading(seen, book, True, True, c["stiffness"], c["size"])
    values |= {
        "normal_load": c["load"],
        "friction_work": book["friction"],
        "energy_dissipated": book.pop("lost"),
        "energy_created": np.zeros(len(c["load"])),
        "energy_balance": energy_balance(book),
    }
    return values, book, found, extremes, seen.rise


def step_errors(values: dict, coarser: list) -> dict:
    """Return the error (n,) of each measure from its values at half and a quarter of the steps.

    Parameters
    ----------
    values : dict
        Measures by name, (n,) each.
    coarser : list of dict
        The same at half the steps and, if it is known, at a quarter of them.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # a march with half the steps may diverge
        changes = [signed_change(fine, coarse) for fine, coarse in pairwise([values, *coarser])]
        return {
            name: np.nan_to_num(convergence_error(*(gaps[name] for gaps in changes)), posinf=np.inf)
            for name in values
        }


def _loops(values: dict) -> np.ndarray:
    """Return whether the friction loop of a case is larger than round-off, (n,)."""
    return np.abs(values["loop_area"]) > NO_LOOP * values["friction_force_peak"] * np.abs(
        values[AMPLITUDE]
    )


def _damping_per_loop_area(values: dict) -> np.ndarray:
    """Return equivalent_damping over loop_area (n,) [1/J]; 0 without a loop."""
    loop = values["loop_area"]
    return np.divide(
        np.abs(values["equivalent_damping"]), np.abs(loop), out=0 * loop, where=loop != 0
    )
