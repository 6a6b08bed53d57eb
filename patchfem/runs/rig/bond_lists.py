"""Sum over the bonds of a rig, and the cost of a list of them.

In: a Model and its Numerics. Out: the Choice of a method for the sum (`choose_bond_summation`), and the
predicted length and CPU seconds of a list. A law without stiffness, the printed one and that of
order 0, keeps a block from sliding by a reversal in almost every step. Each reversal adds a
strip to the list, so that its cost grows with the square of the steps.
"""

from functools import lru_cache
from math import ceil, inf, log2, pi, sqrt
from time import thread_time
from typing import NamedTuple

import numpy as np

from ...core import Missing
from ...effects import law_has_trait
from ...friction.bonds import engines
from ...friction.bonds.list_forms_kernels import FORM_REPORT_GROWING
from ...friction.bonds.list_numbers import sum_form
from ...friction.bonds.parameters import MAX_LIST_SECONDS
from ...model.model import Model
from ...structure.drive_sizes import (
    find_drive_omega,
    find_max_acceleration,
    find_max_frequency_ratio,
)
from ..bench import engine as bench_engine
from .numerics import Numerics

# fraction of the first stroke of a released motion that the sum over its bonds has to resolve
DECAYED_FRACTION = 1e-2
# assumed ratio of the stroke of a block that the printed law stops to that of the drive (measured: 1e-2
# to 1e-4)
STICKING_STROKE_RATIO = 1e-4
# CPU seconds per step and strip of a list of bonds that grows every step (measured: 8e-8 to 4e-6)
GROWING_STEP_SECONDS = 1e-6
# Ratio of friction limit to drive force (D) from which a block is stuck: then 0.6 and more strips are
# left per step, against 0.06 at D = 1.06 and 0.28 at D = 1.4.
MIN_STUCK_RATIO = 2.0
# Strips per step above which the motion reverses in every few steps, so that shorter steps would only
# make the list of bonds longer.
MAX_STRIPS_PER_STEP = 0.1
# Strips of a list of bonds with about one strip per step, above which steps are not halved again,
# because each halving costs four times as much.
MIN_LONG_LIST = 500
MIN_SLIP_LENGTHS = 1e-3  # slip in bond lengths, below which the motion of a block is elastic
MAX_HALVINGS = 2  # largest number of halvings of the step (0 to 3 were observed)
# ratio of the cost of a patch with shear compliance to that of one list: its lists, times the larger number of
# iterations of Newton's method
SHEAR_COST_FACTOR = 256.0
MAX_BOND_PHASE = 2.0  # largest phase [rad] in a step of the vibration of the block on its bonds


@lru_cache(maxsize=8)
def choose_bond_summation(model: Model, numerics: Numerics):
    """Choose the method that sums the forces of the bonds of a nonlocal law in a rig.

    The stroke is taken as four times the amplitude that follows from speed over frequency of the
    drive, or from the stiffness of the bonds if they stop the block. The stroke of a motion that
    is released, or excited once, decreases, and a list of all its bonds would need too much memory:
    it is taken as DECAYED_FRACTION of that of the start. That of a block that the printed law keeps
    from sliding is STICKING_STROKE_RATIO times that of the drive.
    """
    return numerics.choice or _choose_for_engine(
        model, numerics, _relative_stretch(model), bench_engine.find_requested_engine(model)
    )


def has_list(model: Model, numerics: Numerics) -> bool:
    """Return whether the forces of bonds are summed over a list of bonds."""
    f = model.friction
    return (
        f is not None
        and law_has_trait(f.law, "bonds")
        and choose_bond_summation(model, numerics).engine != "recursion"
    )


def _choose_for_engine(model: Model, numerics: Numerics, stretch: float, engine: str):
    """Choose the bond summation for the requested engine, which may be "auto".

    stretch: bond lengths by which a block moves on its bonds.
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


def _relative_stretch(model: Model, least: float = MIN_STUCK_RATIO) -> float:
    """Return the displacement of a stuck, driven block relative to the bond length.

    The stiffness is mu_s N/eps_0. The result is inf if the bonds do not stop the block, i.e. if their
    limit is below `least` times the required force, or if the printed law gives them no stiffness.
    """
    f = model.friction
    rig = model.rig
    if f.reading == "report" or rig.drive.kind == "free":
        return inf
    needed = compute_holding_force(rig)
    limit = f.static * model.nominal_load
    return needed / limit if limit >= least * needed else inf


def count_step_halvings(model: Model) -> int:
    """Return how often the automatic time step is halved for a block that sticks on its bonds.

    A stuck block vibrates on its bonds faster than its modes and its drive. The steps are halved until
    a period of this vibration has as many steps as one of the modes or the drive, MAX_HALVINGS times at most. If the
    slip, half the square of the stretch, is below MIN_SLIP_LENGTHS bond lengths, the motion is elastic and no
    halving is needed.
    """
    rig = model.rig
    f = model.friction
    if f is None or not law_has_trait(f.law, "bonds") or model.accuracy.steps_per_cycle is not None:
        return 0
    stretch = _relative_stretch(model)
    if stretch == inf or stretch**2 / 2 < MIN_SLIP_LENGTHS:
        return 0
    quickest = max(
        find_max_frequency_ratio(rig.drive.signal) / rig.drive.signal.period,
        float(rig.structure.frequencies.max()),
    )
    doublings = ceil(log2(_bond_omega(model) / (2 * pi * quickest)))
    return min(max(0, doublings), MAX_HALVINGS)


def _bond_omega(model: Model) -> float:
    """Return the angular frequency [rad/s] of a block on the stiffness of its bonds."""
    f = model.friction
    modes = model.rig.modes
    return sqrt(
        f.static * model.nominal_load / f.bond_length * float((modes.slide**2).sum()) / modes.mass
    )


def stuck_force_ratio(model: Model, push: float | None = None) -> float:
    """Return the ratio of limit to holding force at which bonds without stiffness stick.

    It is 0 for other bonds. The printed law reaches its limit at any stroke, so that its stiffness
    mu_s N/stroke is unbounded; bonds of order 0 have the same force at any stretch. A released
    block with a list of growing bonds is loaded by its spring alone: it then either vibrates on its
    bonds or reverses in almost every step, and the length of the step decides by chance (232 steps
    per cycle: the former; 230 and 234: the latter).

    push: acceleration of the drive [m s-2]; None: the largest one.
    """
    f = model.friction
    rig = model.rig
    if f is None or not law_has_trait(f.law, "bonds"):
        return 0.0
    released = rig.drive.kind == "free"
    printed = f.reading == "report"
    if not printed and (released or model.bonds.order != 0):
        return 0.0
    if released:
        if rig.start is None or sum_form(model.bonds) != FORM_REPORT_GROWING:
            return 0.0
        slides = rig.modes.interfaces @ rig.start.z
        needed = _force_for_prescribed_slides(rig, 0.0, np.zeros(rig.modes.omega.size), slides)
    else:
        needed = compute_holding_force(rig, push)
    return f.static * model.nominal_load / needed if needed else inf


def min_growing_force_ratio(model: Model) -> float:
    """Return the ratio of limit to holding force above which a bond list grows in every step.

    It is 1 for a driven block if each step leaves a strip that no path erases, i.e. for bonds that
    grow or that have no stiffness by their order; else MIN_STUCK_RATIO.
    """
    leaves = sum_form(model.bonds) == FORM_REPORT_GROWING or model.friction.reading != "report"
    return 1.0 if leaves and model.rig.drive.kind != "free" else MIN_STUCK_RATIO


def is_stuck_by_printed_law(model: Model) -> bool:
    """Return whether the printed law prevents a driven block from sliding.

    The block then reverses in almost every step, and each reversal adds a strip to its list.
    """
    return (
        model.rig.drive.kind != "free"
        and model.friction is not None
        and model.friction.reading == "report"
        and stuck_force_ratio(model) >= MIN_STUCK_RATIO
    )


def is_stuck_after_release(model: Model) -> bool:
    """Return whether growing bonds of the printed law stop a released block from the start."""
    return model.rig.drive.kind == "free" and stuck_force_ratio(model) >= MIN_STUCK_RATIO


def is_stuck_without_stiffness(model: Model) -> bool:
    """Return whether bonds of order 0, which have no stiffness, stop the block."""
    return is_list_growing(model) and model.friction.reading != "report"


def is_list_growing(model: Model) -> bool:
    """Return whether the bond list gains an entry in almost every time step.

    It does if, at some time of the run, the friction of a law without stiffness at rest (see `stuck_force_ratio`) holds the
    sliding block. Pieces with shear compliance have a
    stiffness, and the lists of their points are merged.
    """
    if model.partial_slip:
        return False
    most = stuck_force_ratio(model, find_min_drive(model.rig))
    return most > 0 and most >= min_growing_force_ratio(model)


def find_min_drive(rig) -> float:
    """Return the amplitude [m s-2] of the lowest level of a drive.

    For a drive in levels it is the smaller of the lowest level and half the first one, where the
    bisection of the onset starts. Without levels it is the largest acceleration of the drive.
    """
    levels = rig.drive.levels.amplitudes
    return min(levels[0] / 2, *levels) if levels else find_max_acceleration(rig.drive.signal)


def compute_holding_force(rig, push: float | None = None) -> float:
    """Return the peak force [N] on the first interface that keeps all interfaces at rest.

    For a single mode it is mass times acceleration times base/slide at any frequency; several modes
    continue to vibrate with stuck interfaces and add their inertia. It is inf if no force can do
    this: for an interface that no mode moves, or at an undamped resonance.

    push: acceleration of the drive [m s-2]; None: the largest one.
    """
    modes = rig.modes
    size = find_max_acceleration(rig.drive.signal) if push is None else push
    return _force_for_prescribed_slides(
        rig, find_drive_omega(rig.drive.signal), modes.base * size, np.zeros(len(modes.interfaces))
    )


def _force_for_prescribed_slides(rig, omega: float, push, slides) -> float:
    """Return the force amplitude [N] on the first interface if all slides are prescribed.

    Parameters
    ----------
    rig : Rig
    omega : float
        Angular frequency [rad/s] of the harmonic motion exp(i omega t).
    push : (n,)
        Modal accelerations [m s-2].
    slides : (i,)
        Prescribed slides [m].

    Returns
    -------
    float
        inf if no forces can do it.
    """
    modes = rig.modes
    n = rig.modes.omega.size
    faces = modes.interfaces
    moves = np.diag(modes.omega**2 - omega**2) + 1j * omega * modes.damping_matrix
    whole = np.block([[moves, faces.T / modes.mass], [faces, np.zeros((len(faces), len(faces)))]])
    try:
        return float(abs(np.linalg.solve(whole, np.append(push, slides))[n]))
    except np.linalg.LinAlgError:
        return inf


def is_list_too_long(model: Model, numerics: Numerics, book: dict) -> bool:
    """Return whether the bond list is too long to halve the time step once more.

    It is too long if it grows by a strip in every few steps. Bonds that grow leave a strip in each
    step of any stroke; for these the block has to be held.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    book : dict
        Counters of the run, with "strips".
    """
    strips = book.get("strips", 0.0)
    if strips <= MIN_LONG_LIST or model.bonds.reading != "report":
        return False
    if sum_form(model.bonds) == FORM_REPORT_GROWING:
        return is_list_growing(model)
    return strips > MAX_STRIPS_PER_STEP * numerics.cycles * numerics.steps


def has_doubling_failed(book: dict, errors: list) -> bool:
    """Return whether doubling the steps twice has not reduced the error of a bond list.

    The list of a released block that reverses in almost every step is different for any step
    (errors of 71, 509, 139, 39 and 97 times the tolerance were observed), and the next doublings
    cost four and eight times as much.

    Parameters
    ----------
    book : dict
        Counters of the run, with "strips".
    errors : list
        Errors of the displacement [m], one per doubling.
    """
    return book.get("strips", 0.0) > 0 and len(errors) > 2 and errors[-1] >= errors[-3]


class ListCost(NamedTuple):
    """Predicted length of a bond list and CPU time [s] of a run with it."""

    strips: float
    seconds: float


def estimate_list_cost(model: Model, numerics: Numerics) -> ListCost:
    """Predict the length of a bond list and the CPU time [s] of a run with it.

    A list that grows with every step is expected to contain all strips; its seconds are known
    within a factor of about 12, because the increments that a step tries depend on the motion.
    `ListGuard` stops a run that takes too long.
    """
    steps = numerics.cycles * numerics.steps
    if is_list_growing(model):
        return ListCost(steps, GROWING_STEP_SECONDS * steps**2 / 2)
    choice = choose_bond_summation(model, numerics)
    if choice.engine != "recursion" and numerics.choice is None:
        choice = _choose_for_engine(model, numerics, _relative_stretch(model, 1.0), choice.engine)
    max_strips = 8 * steps
    if choice.tail:
        max_strips = 2 * steps * max(1.0, choice.strips)
    strips = min(choice.strips, max_strips)
    n_lists = SHEAR_COST_FACTOR if model.partial_slip else 1.0
    fraction = strips / choice.strips if choice.strips else 1.0
    return ListCost(strips, n_lists * steps * choice.seconds * fraction)


class ListGuard:
    """Progress callback that stops a march whose bond list takes too much CPU time.

    A list grows or keeps its length. Therefore all steps together take at least the time of the
    completed steps divided by their fraction.
    """

    def __init__(self, progress=None):
        self.progress = progress
        # CPU seconds and completed fraction at the first call, so that compiling does not count
        self.start = None

    def __call__(self, fraction: float) -> None:
        """Report the completed fraction of steps, and stop a march that takes too long.

        Raises
        ------
        Missing
            If all steps would take more than MAX_LIST_SECONDS CPU seconds.
        """
        now = thread_time()
        if self.start is None:
            self.start = now, fraction
        spent = now - self.start[0]
        done = fraction - self.start[1]
        if done > 0 and spent > MAX_LIST_SECONDS / 60 and spent > MAX_LIST_SECONDS * done:
            raise Missing(_long_list_message(spent / done), "")
        if self.progress is not None:
            self.progress(fraction)


def _long_list_message(seconds: float, entries: float | None = None) -> str:
    """Return the error message on a run whose bond list takes too much CPU time."""
    length = "" if entries is None else f" (about {entries:.0f} entries)"
    return (
        f"the sum over the list of bonds{length} would need a computing time of about {seconds:.0f} s, more than "
        f"the limit of {MAX_LIST_SECONDS:.0f} s; lower drive.cycles or accuracy.steps_per_cycle, raise accuracy.tail or "
        'accuracy.merge, or use reading = "stretch" with order = 1'
    )


def refuse_unresolved_bond_vibration(model: Model, numerics: Numerics) -> None:
    """Raise Missing if the time step does not resolve the vibration of the block on its bonds.

    The step is too long if sqrt(k_t/m) dt > MAX_BOND_PHASE. The computed motion would be meaningless then,
    and every step would leave permanent bonds: the list would grow, and the run time with its
    square.
    """
    drive = model.rig.drive.signal
    pace = _bond_omega(model)
    swing = pace * drive.period / numerics.steps
    if swing > MAX_BOND_PHASE:
        wanted = ceil(pace * drive.period)
        raise Missing(
            f"a time step of {drive.period / numerics.steps:.2g} s is too long for the vibration of the "
            f"block on its bonds, at {pace / (2 * pi):.3g} Hz; set accuracy.steps_per_cycle = {wanted}, "
            'raise structure.moving_mass or friction.bond_length, or use reading = "stretch" with '
            "order = 1",
            "",
        )


def refuse_long_list(model: Model, numerics: Numerics) -> None:
    """Raise Missing if the sum over a bond list would take too much CPU time.

    The CPU time of a growing list is uncertain: its run is stopped only when it turns out too long.
    """
    if not has_list(model, numerics):
        return
    if not model.partial_slip:
        refuse_unresolved_bond_vibration(model, numerics)
    entries, seconds = estimate_list_cost(model, numerics)
    if seconds > MAX_LIST_SECONDS and not is_list_growing(model):
        raise Missing(_long_list_message(seconds, entries), "")
