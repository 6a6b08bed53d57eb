"""Method of bond summation for a rig, and length and cost of its bond list.

In: a Model and its Numerics. Out: the EngineChoice of the bond summation (`choose_bond_summation`),
and the predicted length and CPU time of a bond list.

A law without stiffness (the law as printed, or order 0) holds a block by a reversal in almost every
time step. Each reversal adds a strip to the list, so that the cost increases with the square of the
number of steps.
"""

from functools import lru_cache
from math import ceil, inf, pi, sqrt
from time import thread_time
from typing import NamedTuple

import numpy as np

from ...core import Missing
from ...effects import law_has_trait, needs_bond_list
from ...friction.bonds import engines
from ...friction.bonds.list_numbers import sum_form
from ...friction.bonds.list_rows_kernels import FORM_GROWING
from ...friction.bonds.parameters import MAX_LIST_SECONDS
from ...model.model import Model
from ...structure.drive_sizes import (
    find_drive_omega,
    find_max_acceleration,
)
from ..bench import engine as bench_engine
from .numerics import Numerics

# Ratio of the stroke that bond summation has to resolve to the first stroke of a released motion.
DECAYED_FRACTION = 1e-2
# Assumed ratio of the stroke of a block held by the printed law to the stroke of the drive
# (measured: 1e-2 to 1e-4).
STICKING_STROKE_RATIO = 1e-4
# CPU time per step and strip [s] of a bond list that grows in every step (measured: 8e-8 to 4e-6).
GROWING_STEP_SECONDS = 1e-6
# Smallest ratio of friction limit to drive force (D) at which a block counts as stuck. Above it 0.6
# or more strips remain per step, compared with 0.06 at D = 1.06 and 0.28 at D = 1.4.
MIN_STUCK_RATIO = 2.0
# Largest number of strips per step at which shorter steps are useful. With more strips the motion
# reverses every few steps, and shorter steps only lengthen the list.
MAX_STRIPS_PER_STEP = 0.1
# Largest number of strips, at about one per step, at which steps are halved again; each halving
# makes the run four times as expensive.
MIN_LONG_LIST = 500
# Ratio of the cost of a patch with shear compliance to that of a single list, due to its many lists
# and the additional Newton iterations.
SHEAR_COST_FACTOR = 256.0
MAX_BOND_PHASE = 2.0  # Largest phase [rad] per step of the vibration of the block on its bonds.


@lru_cache(maxsize=8)
def choose_bond_summation(model: Model, numerics: Numerics):
    """Choose the method of bond summation of a nonlocal law in a rig.

    A law that needs no bond list has the recursion, which is exact. Otherwise the method depends on
    the stroke, which is four times the amplitude that follows from the speed scale and the frequency
    of the drive, or from the stiffness of the bonds if they hold the block. If the motion decays
    (release, step), the stroke is reduced to DECAYED_FRACTION, because a list of all bonds would need
    too much memory. For a block held by the printed law it is reduced to STICKING_STROKE_RATIO.
    """
    if numerics.choice is not None:
        return numerics.choice
    requested = bench_engine.find_requested_engine(model)
    if requested in ("auto", "recursion") and not needs_bond_list(model.friction):
        return engines.RECURSION
    stretch = _estimate_held_displacement(model)
    return _choose_summation_for_engine(model, numerics, stretch, requested)


def has_bond_list(model: Model, numerics: Numerics) -> bool:
    """Return whether the friction force is summed over a bond list."""
    f = model.friction
    return (
        f is not None
        and law_has_trait(f.law, "bonds")
        and choose_bond_summation(model, numerics).engine != "recursion"
    )


def _choose_summation_for_engine(model: Model, numerics: Numerics, stretch: float, engine: str):
    """Choose the bond summation for the requested engine, which may be "auto".

    `stretch` is the displacement of a block held by its bonds, in bond lengths.
    """
    law = model.bonds
    accuracy = model.accuracy
    drive = model.rig.drive
    ratio = 1.0
    if is_stuck_by_printed_law(model):
        ratio = STICKING_STROKE_RATIO
    elif drive.kind == "free" or drive.waveform.is_step:
        ratio = DECAYED_FRACTION
    amplitude = model.speed_scale / find_drive_omega(drive.signal) / law.length
    stroke = max(4 * ratio * min(amplitude, stretch), 1e-9)
    tail = None if accuracy.tail is None else max(accuracy.tail, 1e-15)
    requested = engines.RequestedEngine(engine, tail, accuracy.merge)
    return engines.choose_engine(law, accuracy.tolerance, stroke, numerics.steps / 2, requested)


def _estimate_held_displacement(model: Model, min_ratio: float = MIN_STUCK_RATIO) -> float:
    """Return the displacement, in bond lengths, of a driven block that sticks on its bonds.

    The stiffness of the bonds is mu_s N/eps_0. The result is inf if the friction limit is below
    `min_ratio` times the holding force, or if the printed law gives the bonds no stiffness.
    """
    f = model.friction
    rig = model.rig
    if f.reading == "report" or rig.drive.kind == "free":
        return inf
    holding_force = compute_holding_force(rig)
    limit = f.static * model.nominal_load
    return holding_force / limit if limit >= min_ratio * holding_force else inf


def _find_bond_frequency(model: Model) -> float:
    """Return the angular frequency [rad/s] of a block on the stiffness of its bonds."""
    f = model.friction
    modes = model.rig.modes
    return sqrt(
        f.static * model.nominal_load / f.bond_length * float((modes.slide**2).sum()) / modes.mass
    )


def find_holding_ratio(model: Model, acceleration: float | None = None) -> float:
    """Return friction limit over holding force for bonds without stiffness; 0 for other bonds.

    The printed law reaches its limit at any stroke, and bonds of order 0 have the same force at any
    stretch. A released block is loaded by its spring alone. With a growing bond list it either
    vibrates on its bonds or reverses in almost every step, depending sensitively on the step size
    (the former at 232 steps per cycle, the latter at 230 and 234).

    `acceleration` is the acceleration of the drive [m s-2]; default: the largest one.
    """
    f = model.friction
    rig = model.rig
    if f is None or not law_has_trait(f.law, "bonds"):
        return 0.0
    is_released = rig.drive.kind == "free"
    is_printed_law = f.reading == "report"
    if not is_printed_law and (is_released or model.bonds.order != 0):
        return 0.0
    if is_released:
        if rig.start is None or sum_form(model.bonds) != FORM_GROWING:
            return 0.0
        slides = rig.modes.interfaces @ rig.start.z
        holding_force = _compute_constraint_force(rig, 0.0, np.zeros(rig.modes.omega.size), slides)
    else:
        holding_force = compute_holding_force(rig, acceleration)
    return f.static * model.nominal_load / holding_force if holding_force else inf


def find_min_list_growth_ratio(model: Model) -> float:
    """Return the smallest holding ratio at which a bond list grows in every step.

    It is 1 for a driven block if each step leaves a permanent strip, i.e. if the bonds grow or have
    order 0. Otherwise it is MIN_STUCK_RATIO.
    """
    leaves_strips = sum_form(model.bonds) == FORM_GROWING or model.friction.reading != "report"
    return 1.0 if leaves_strips and model.rig.drive.kind != "free" else MIN_STUCK_RATIO


def is_stuck_by_printed_law(model: Model) -> bool:
    """Return whether the friction law as printed in the report holds a driven block at rest.

    The block then reverses in almost every step, and each reversal adds a strip to its list.
    """
    return (
        model.rig.drive.kind != "free"
        and model.friction is not None
        and model.friction.reading == "report"
        and find_holding_ratio(model) >= MIN_STUCK_RATIO
    )


def is_stuck_after_release(model: Model) -> bool:
    """Return whether growing bonds of the law as published hold a block after its release."""
    return model.rig.drive.kind == "free" and find_holding_ratio(model) >= MIN_STUCK_RATIO


def is_stuck_without_stiffness(model: Model) -> bool:
    """Return whether bonds of order 0, which have no stiffness, hold the block."""
    return is_bond_list_growing(model) and model.friction.reading != "report"


def is_bond_list_growing(model: Model) -> bool:
    """Return whether the bond list gets a new entry in almost every time step.

    This is the case if a law without stiffness holds the block at some time of the run (see
    `find_holding_ratio`). Pieces with shear compliance have a stiffness, and their lists are merged.
    """
    if model.partial_slip:
        return False
    holding_ratio = find_holding_ratio(model, find_min_drive_acceleration(model.rig))
    return holding_ratio > 0 and holding_ratio >= find_min_list_growth_ratio(model)


def find_min_drive_acceleration(rig) -> float:
    """Return the smallest acceleration amplitude [m s-2] of a run.

    For a drive in levels it is the lowest level, or half the first one, where the bisection of the
    onset starts. Otherwise it is the largest acceleration of the drive.
    """
    levels = rig.drive.levels.amplitudes
    return min(levels[0] / 2, *levels) if levels else find_max_acceleration(rig.drive.signal)


def compute_holding_force(rig, acceleration: float | None = None) -> float:
    """Return the peak force [N] on the first interface that holds all interfaces at rest.

    For a single mode it is mass times acceleration times the ratio of base to slide participation,
    at any frequency. Several modes continue to vibrate while the interfaces stick, and add inertia
    forces. The force is inf if no mode moves an interface, or at an undamped resonance.

    `acceleration` is that of the drive [m s-2]; default: the largest one.
    """
    modes = rig.modes
    size = find_max_acceleration(rig.drive.signal) if acceleration is None else acceleration
    return _compute_constraint_force(
        rig, find_drive_omega(rig.drive.signal), modes.base * size, np.zeros(len(modes.interfaces))
    )


def _compute_constraint_force(rig, omega: float, accelerations, slides) -> float:
    """Return the force amplitude [N] on the first interface at prescribed relative displacements.

    Parameters
    ----------
    rig : Rig
    omega : float
        Angular frequency [rad/s] of the harmonic motion exp(i omega t).
    accelerations : (n,)
        Modal accelerations [m s-2].
    slides : (i,)
        Prescribed relative displacements [m].

    Returns
    -------
    float
        Force [N]; inf if no force can enforce the displacements.
    """
    modes = rig.modes
    n = rig.modes.omega.size
    interfaces = modes.interfaces
    moves = np.diag(modes.omega**2 - omega**2) + 1j * omega * modes.damping_matrix
    whole = np.block(
        [
            [moves, interfaces.T / modes.mass],
            [interfaces, np.zeros((len(interfaces), len(interfaces)))],
        ]
    )
    try:
        return float(abs(np.linalg.solve(whole, np.append(accelerations, slides))[n]))
    except np.linalg.LinAlgError:
        return inf


def is_bond_list_too_long(model: Model, numerics: Numerics, counters: dict) -> bool:
    """Return whether the bond list is too long to halve the time step once more.

    This is the case if it gets a strip every few steps. Bonds that grow leave a strip in each step
    of any motion; for these, the block must be held as well.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    counters : dict
        Counters of the run, including "strips".
    """
    strips = counters.get("strips", 0.0)
    if strips <= MIN_LONG_LIST or model.bonds.reading != "report":
        return False
    if sum_form(model.bonds) == FORM_GROWING:
        return is_bond_list_growing(model)
    return strips > MAX_STRIPS_PER_STEP * numerics.cycles * numerics.steps


def has_doubling_failed(counters: dict, errors: list) -> bool:
    """Return whether two doublings of the steps have not reduced the error of a bond list.

    The list of a released block that reverses in almost every step depends on the step size: errors
    of 71, 509, 139, 39 and 97 times the tolerance were observed in successive doublings. Further
    doublings would cost four and eight times as much.

    Parameters
    ----------
    counters : dict
        Counters of the run, including "strips".
    errors : list
        Error of the displacement [m] after each doubling.
    """
    return counters.get("strips", 0.0) > 0 and len(errors) > 2 and errors[-1] >= errors[-3]


class ListCost(NamedTuple):
    """Predicted length of a bond list and CPU time [s] of its run."""

    strips: float
    seconds: float


def estimate_bond_list_cost(model: Model, numerics: Numerics) -> ListCost:
    """Predict the length of a bond list and the CPU time [s] of its run.

    A list that grows in every step contains all strips. Its CPU time is known within a factor of
    about 12, because the number of iterations per step depends on the motion. `BondListGuard` stops a
    run that takes too long. After a release the list grows only until the oldest bonds are dropped.
    """
    steps = numerics.cycles * numerics.steps
    if is_bond_list_growing(model) and model.rig.drive.kind != "free":
        return ListCost(steps, GROWING_STEP_SECONDS * steps**2 / 2)
    choice = choose_bond_summation(model, numerics)
    if choice.engine != "recursion" and numerics.choice is None:
        choice = _choose_summation_for_engine(
            model, numerics, _estimate_held_displacement(model, 1.0), choice.engine
        )
    max_strips = 8 * steps
    if choice.tail:
        max_strips = 2 * steps * max(1.0, choice.strips)
    strips = min(choice.strips, max_strips)
    n_lists = SHEAR_COST_FACTOR if model.partial_slip else 1.0
    fraction = strips / choice.strips if choice.strips else 1.0
    return ListCost(strips, n_lists * steps * choice.seconds * fraction)


class BondListGuard:
    """Progress callback that stops a time integration whose bond list takes too much CPU time.

    The cost per step does not decrease, because a list never becomes shorter. Therefore the whole
    run takes at least the elapsed time divided by the completed fraction.
    """

    def __init__(self, progress=None):
        self.progress = progress
        # CPU time [s] and completed fraction at the first call, so that compilation does not count.
        self.start = None

    def __call__(self, fraction: float) -> None:
        """Report the completed fraction of the steps, and stop an integration that takes too long.

        Raises
        ------
        Missing
            If the whole run would take more than MAX_LIST_SECONDS of CPU time.
        """
        now = thread_time()
        if self.start is None:
            self.start = now, fraction
        spent = now - self.start[0]
        done = fraction - self.start[1]
        if done > 0 and spent > MAX_LIST_SECONDS / 60 and spent > MAX_LIST_SECONDS * done:
            raise Missing(_describe_long_list(spent / done), "")
        if self.progress is not None:
            self.progress(fraction)


def _describe_long_list(seconds: float, entries: float | None = None) -> str:
    """Return the error message on a bond list that takes too much CPU time."""
    length = "" if entries is None else f" (about {entries:.0f} entries)"
    return (
        f"the sum over the list of bonds{length} would need a computing time of about {seconds:.0f} s, more than "
        f"the limit of {MAX_LIST_SECONDS:.0f} s; lower drive.cycles or accuracy.steps_per_cycle, raise accuracy.tail or "
        'accuracy.merge, or use reading = "stretch" with order = 1'
    )


def refuse_unresolved_bond_vibration(model: Model, numerics: Numerics) -> None:
    """Raise Missing if the time step does not resolve the vibration of the block on its bonds.

    The condition is sqrt(k_t/m) dt <= MAX_BOND_PHASE. With a longer step the motion would be
    meaningless, and every step would leave permanent bonds, so that the CPU time would increase
    with the square of the number of steps.
    """
    drive = model.rig.drive.signal
    omega = _find_bond_frequency(model)
    phase = omega * drive.period / numerics.steps
    if phase > MAX_BOND_PHASE:
        wanted = ceil(omega * drive.period)
        raise Missing(
            f"a time step of {drive.period / numerics.steps:.2g} s is too long for the vibration of the "
            f"block on its bonds, at {omega / (2 * pi):.3g} Hz; set accuracy.steps_per_cycle = {wanted}, "
            'raise structure.moving_mass or friction.bond_length, or use reading = "stretch" with '
            "order = 1",
            "",
        )


def refuse_long_bond_list(model: Model, numerics: Numerics) -> None:
    """Raise Missing if the sum over a bond list would take too much CPU time.

    The CPU time of a growing list is uncertain; its run is stopped only when it takes too long.
    """
    if not has_bond_list(model, numerics):
        return
    if not model.partial_slip:
        refuse_unresolved_bond_vibration(model, numerics)
    entries, seconds = estimate_bond_list_cost(model, numerics)
    if seconds > MAX_LIST_SECONDS and not is_bond_list_growing(model):
        raise Missing(_describe_long_list(seconds, entries), "")
