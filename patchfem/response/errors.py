"""Errors of the measures of a march from coarser runs of the same scene.

The step of a march meets reversals and sticks at irregular places. So its error falls like the square of the step on
the whole, but often not at every halving. Three runs with a step of h, 2h and 4h tell which it is. Where the changes of
a measure have one sign and a ratio between 2^1.7 and 2^2.3, they show their order p, and change/(2^p - 1) is the error
of Richardson (Phil. Trans. A 210, 307, 1911) but for a safety factor. Ratios between 2^1.3 and 2^3 show that the error
falls, of which no more than the second order is believed: the error at 2h is then a third of the earlier change, and a
quarter of that is left at h. Where changes turn their sign, grow, or fall by more, the error is of the size of the
changes. So the larger one counts, more of it where the later one is that small that it is so by chance, and a share of
what the main measures of the same run typically change by. That share is left out for a force, which its limit bounds,
and for energies over the whole run. Where the change of a main measure does not fall with the step, no other's order is
believed, and that largest change counts for the typical one. The factors are those that held on random scenes of all
laws (seeds below 200, 41000000- and 42000000- of tests/support/motion_scenes.py); the coverage on other seeds stands in
tests/README.md.
"""

from dataclasses import replace
from statistics import median
from typing import NamedTuple

import numpy as np

from ..core import Measure
from .rows import first_harmonic, floor_of, of_first, row_of

ORDERS = 2**1.7, 2**2.3  # ratios of two changes at halved steps that show second order
WIDER = 2**1.3, 2**3  # ratios that show an error which falls by a lower or a higher order
SURE = 2.2  # times the error that follows from the order: 95 % of these are below 1.5 to 2 times it
LOOSE = 1.1  # times the larger change: 95 % of the errors of irregular measures lie below 0.4 to 1.1 of it
GROWS = 1.5  # times that where the later change is the larger one, as nothing converges yet, or is small by chance
CHANCE = 16.0  # times the later change that the earlier one is there: more than the fourth order
# read at one instant, which runs share whose steps are halves: by chance they differ by nothing, and the earlier change
# is believed no more than the first order
AT_ONCE = ("friction_force_peak", "absolute_acceleration_peak", "secant_stiffness")
# of measures that hang on few steps, or are small differences
LOOSER = {"slip_amplitude": 1.4, "stick_fraction": 1.7, "slip_start_phase": 1.4, "drift_per_cycle": 2.0,
          "equivalent_damping": 1.3, "equivalent_stiffness": 1.2, "secant_stiffness": 1.3, "friction_force_peak": 1.7,
          "loop_area": 1.1, "energy_stored": 1.5}
SHARE, LEAST = 0.5, 0.2  # of the typical relative change, that of an irregular and of a regular measure at least
OF_CHANGE, OF_TYPICAL = 0.5, 0.3  # of runs that a tolerance tells apart
OF_FINER, OF_TYPICAL_FINER = 2.8, 0.4  # of runs that twice the harmonics tell apart: 99.4 % of 354 bars of 26 rigs
OF_MODES, OF_TYPICAL_MODES = 3.0, 0.5  # of runs with more than twice the modes of a reduced structure
# of runs whose cells are a quarter as many, and of measures that change less with them: of the first order, or peaks
OF_CELLS, OF_TYPICAL_CELLS = 0.2, 0.02
OF_CELL = {"stick_fraction": 0.4, "slip_start_phase": 0.4, "friction_force_peak": 0.5, "drift_per_cycle": 0.3}
OF_FLOOR = 0.1  # of the floor of a measure, and its square where steps meet a tolerance: nobody uses the digits below.
# Not of GAPS, which are errors themselves and are read by their size
ROUND = 1e-12  # of a value, the last digits of a long sum
NOTHING = 1e-6  # of the floor of a measure, below which it is round-off
FALLS = 0.5  # least order at which an error falls with the step
GAPS = ("energy_balance", "work_check")
LAST = 1e-13  # of the amplitude, the last digits of a mean over it
APART = ("friction_force_peak", "friction_work", "energy_stored", "energy_dissipated")  # not of the last cycles
GIVEN = "normal_load"  # no motion changes it
OF_MESH = 1.5  # times the change by a coarser mesh of pieces that slip part by part
OF_MOST = 0.5  # of the largest relative change of these
OF_STIFFNESS = ("relative_displacement_amplitude", "absolute_acceleration_peak", "friction_force_peak",
                "secant_stiffness")
MAIN = ("relative_displacement_amplitude", "absolute_acceleration_peak", "slip_amplitude", "loop_area", "friction_work")


class StepScales(NamedTuple):
    """What the errors of a time step are judged by.

    size [m]: as `floor_of` takes it; turn [m]: slide over which the law holds after a reversal, 0 for none; overshoots:
    names of the friction force peaks that no limit of their law holds.
    """

    size: float = np.inf
    turn: float = 0.0
    overshoots: frozenset = frozenset()


PLAIN = StepScales()  # of a motion of which nothing is known


def signed(fine: dict, coarse: dict) -> dict:
    """Difference fine - coarse by name of the measures that both runs have; that of a phase lies in +-pi/2."""
    out = {name: fine[name] - coarse[name] for name in fine.keys() & coarse.keys()}
    if "slip_start_phase" in out:
        out["slip_start_phase"] = (out["slip_start_phase"] + np.pi / 2) % np.pi - np.pi / 2
    return out


def change(fine: dict, coarse: dict) -> dict:
    """Size of the difference by name of the measures that both runs have; a phase is compared modulo pi."""
    return {name: abs(gap) for name, gap in signed(fine, coarse).items()}


def step_error(fine: dict, half: dict, quarter: dict, steps: int, scales: StepScales = PLAIN) -> dict:
    """Error of the time step by name from the measures of runs at `steps`, half and a quarter of them per cycle.

    By the order where the changes show it, else by their size and that of the main measures, as the head of the file
    says. What counts samples has at least their resolution, and as it can jump, no less than it changed. A slide of x
    from its turn takes the phase sqrt(2 x/A): where that is below a step no order is believed, and a stick may be there
    that no sample shows.
    """
    size, turn = scales.size, scales.turn
    last, before = signed(fine, half), signed(half, quarter)
    reach = fine.get("slip_amplitude", 0.0)
    stick = np.sqrt(2 * turn / reach) / np.pi if turn and reach > turn else 0.0  # of the cycle: that phase, twice
    sizes = {name: max(abs(gap), abs(before.get(name, 0.0)) / 4) for name, gap in last.items()}
    missed = 0 < stick < 2 / steps
    orderly = not missed and _orderly(fine, last, before)
    typical = typical_change(fine, sizes, median if orderly else max)
    out = {}
    for name, gap in last.items():
        earlier, value = before.get(name, 0.0), _size(fine, name)
        is_same = sizes[name] <= ROUND * value
        if is_same and name not in scales.overshoots:  # a limit or a given load: it does not hang on the step
            out[name] = sizes[name]
        else:
            kind, shown = of_first(name), _by_order(gap, earlier) if orderly else None
            is_apart = kind in APART and not is_same
            least = 0.0 if is_apart else (1.0 if missed else SHARE) * typical * value
            if shown is None:
                out[name] = _without_order(kind, gap, earlier, least, missed)
            else:
                out[name] = max(SURE * shown[0], LEAST * typical * value if shown[1] else LOOSE * least)
        if not is_same and name not in GAPS:
            out[name] = max(out[name], OF_FLOOR * float(floor_of(name, size)))
        out[name] = max(out[name], jump_of(name, gap)) + row_of(name).grain / steps
    if stick and "stick_fraction" in out and fine["stick_fraction"] < 2 / steps:
        out["stick_fraction"] = max(out["stick_fraction"], min(stick, 2 / steps))
    if "slip_start_phase" in out and "slip_start_phase" not in quarter:  # one change alone tells nothing; a stick of a
        # share s lasts pi s twice a cycle, and each of its ends moves by half of that
        out["slip_start_phase"] = max(out["slip_start_phase"], np.pi / 2 * out.get("stick_fraction", 0.0))
    if fine.get("open_fraction") == 0 and fine.get("normal_load_least", 0.0) > out.get("normal_load_least", np.inf):
        out["open_fraction"] = 0.0  # the load stays above 0 between the samples as well
    return out


def jump_of(name: str, gap):
    """Least error [unit of the measure] from its change between two runs: of what can jump the whole change, else 0.

    A short stick comes or goes between two runs, and which of them is right is not known.
    """
    return np.abs(gap) * (row_of(name).grain > 0)


def _by_order(gap: float, earlier: float) -> tuple | None:
    """(error by the order that two changes show, whether that is the second); None where they show none."""
    ratio = earlier / gap if gap else 0.0
    if ORDERS[0] <= ratio <= ORDERS[1]:
        return abs(gap) / (ratio - 1), True
    if WIDER[0] <= ratio <= WIDER[1]:  # a twelfth: h^2 over the (4^2 - 2^2) h^2 of the earlier change
        return max(abs(gap) / (ratio - 1), abs(earlier) / 12), False
    return None


def _without_order(kind: str, gap: float, earlier: float, least: float, missed: bool) -> float:
    """Error of a measure of a kind whose two changes show no order, from the size of them and at least `least`."""
    chance = abs(earlier) > CHANCE * abs(gap)
    larger = max(abs(gap), abs(earlier) / (2 if chance and kind in AT_ONCE else 4))
    grows = GROWS if missed or chance or abs(earlier) < abs(gap) else 1.0
    return grows * LOOSE * LOOSER.get(kind, 1.0) * max(larger, least)


def _orderly(fine: dict, last: dict, before: dict) -> bool:
    """Whether the change of every main measure falls with the step: where one does not, or stands in coarser runs
    alone, no other's order is believed.

    last, before: changes at the last halving of the steps and at the one before, by name.
    """
    if any(name in before and name not in last for name in MAIN):
        return False
    seen = [name for name in MAIN if name in before and abs(last[name]) > ROUND * abs(fine[name])
            and abs(fine[name]) > floor_of(name)]
    return all(abs(before[name]) >= 2**FALLS * abs(last[name]) for name in seen)


def _size(values: dict, name: str) -> float:
    """What a share of a measure is a share of: its value, and of the stiffness that of the whole first harmonic."""
    return float(first_harmonic(values)) if name == "equivalent_stiffness" else abs(values[name])


def orders(fine: dict, half: dict, quarter: dict) -> dict:
    """Order [1] at which measures by name were seen to change with the step, 2 at most.

    From runs at some steps per cycle, half and a quarter of them. A measure whose change did not fall by the order
    FALLS, and one that not all runs have, is left out: more steps are not known to cure it.
    """
    last, before = change(fine, half), change(half, quarter)
    found = {name: float(np.log2(before[name] / last[name])) for name in last
             if last[name] > 0 and before.get(name, 0.0) > 0}
    return {name: min(order, 2.0) for name, order in found.items() if order >= FALLS}


def tolerance_error(fine: dict, coarse: dict, moved: float = np.inf) -> dict:
    """Error by name of a run whose steps meet a tolerance, from one whose steps may err 30 times as much.

    A thirtieth of the change on the mean. One change can be small by chance, and one run can err by ten times as much
    as its tolerance says, as errors of either sign add up; so a fraction of the typical relative change of the main
    measures counts besides. A third of these factors held for 98.4 % of the values of 40 random scenes of four laws,
    all of a scene in 82 %, at a median of four to twelve times the error of most measures. moved [m]: size of
    `floor_of`.
    """
    gaps = change(fine, coarse)
    # what has come to rest has lost its digits, and tells nothing of what is still large
    typical = typical_change(fine, {name: gap for name, gap in gaps.items() if abs(fine[name]) > floor_of(name, moved)})
    size = abs(fine.get("relative_displacement_amplitude", 0.0))
    least = {name: OF_TYPICAL * typical * (size if name == "drift_per_cycle" else abs(fine[name])) for name in gaps}
    least |= {name: 0.0 for name in gaps if of_first(name) == GIVEN}
    return {name: max(OF_CHANGE * gap, jump_of(name, gap), least[name],
                      0.0 if name in GAPS else OF_FLOOR**2 * float(floor_of(name, moved)))
            for name, gap in gaps.items()}


def finer_error(values: dict, finer: dict) -> dict:
    """Error by name of a motion that is a series of harmonics, from one of twice as many on twice the samples.

    What a series leaves out falls when its harmonics are doubled, by 2 for sure and mostly by 4 and more, so the change
    is most of the error. One change can be small by chance, so a share of what the main measures typically change by
    counts besides, but for what a limit holds.
    """
    gaps = change(values, finer)
    typical = typical_change(values, gaps)
    return {name: OF_FINER * gap + (OF_TYPICAL_FINER * typical * abs(values[name]) if gap > ROUND * abs(values[name])
                                    else 0.0) for name, gap in gaps.items()}


def modes_error(values: dict, more: dict) -> dict:
    """Error by name of a motion of a reduced structure, from one with more than twice as many of its modes.

    The change is most of the error on the mean, but friction that sticks and slips answers what is left out unevenly.
    One change can be small by chance, so a share of what the main measures typically change by counts besides, but for
    what a limit holds. Of 20 random chains under five laws, none of them used before, 98.8 % of 257 bars held the
    value of the whole chain, at a median of three times the error; the three that missed it are of Coulomb's law and
    fixed-interface modes (`tests/support/reduced_bars.py`).
    """
    gaps = change(values, more)
    typical = typical_change(values, gaps)
    return {name: max(OF_MODES * gap, OF_TYPICAL_MODES * typical * abs(values[name]))
            if gap > ROUND * abs(values[name]) else gap for name, gap in gaps.items()}


def cells_error(fine: dict, *coarse: dict) -> dict:
    """Error by name of a run whose law is a density cut into cells, from runs in which each four are one, in turn from
    the first, second, third and fourth on (`dynamics.events.elements.merged`).

    The force of a density in cells is exact where a cell ends and errs most in its middle, by its square. So the change
    at coarser cells is some 15 times the error on the mean, but nothing where the motion turns in a part of a cell that
    both follow alike: half of all places under pairs, a quarter under fours, none under fours from several places on.
    The largest of the changes counts, times OF_CELLS, and a share of what the main measures of the run typically change
    by. Of 590 random rigs with 48, 192 and 768 cells 99.7, 99.98 and 99.98 % of the bars held what the closed form of
    the law gives, all of 98.6 to 99.8 % of the rigs; by pairs it was 96.8, 98.7 and 99.8 %, all of 79, 89 and 98 %.
    """
    changes = [change(fine, one) for one in coarse]
    gaps = {name: max(one[name] for one in changes) for name in fine if all(name in one for one in changes)}
    typical, out = typical_change(fine, gaps), {}
    for name, gap in gaps.items():
        kind, size = of_first(name), abs(fine[name])
        held = kind == GIVEN or (kind == APART[0] and gap <= ROUND * size)  # a force that its limit bounds
        out[name] = OF_CELL.get(kind, OF_CELLS) * gap if held else \
            max(OF_CELL.get(kind, OF_CELLS) * gap, OF_TYPICAL_CELLS * typical * size)
    return out


def pieces_error(fine: dict, coarse: dict) -> dict:
    """Error by name of the mesh of pieces that slip part by part, from a run on a coarser one, or (n,) of many.

    The change, times OF_MESH. A peak of a start that rings, and an amplitude, can agree by chance on both meshes; so of
    those of OF_STIFFNESS, of any interface, each errs by at least OF_MOST of the share that the most changed of them
    does, but for one that a limit holds.
    """
    gaps = {name: gap if name in GAPS else OF_MESH * gap for name, gap in change(fine, coarse).items()}
    size, least = {name: np.abs(fine[name]) for name in gaps if of_first(name) in OF_STIFFNESS}, 0.0
    for name, whole in size.items():
        least = np.fmax(least, OF_MOST * np.divide(gaps[name], whole, out=np.zeros(np.shape(whole)), where=whole > 0))
    return {name: np.where(gap > ROUND * size[name], np.fmax(gap, least * size[name]), gap)[()] if name in size else gap
            for name, gap in gaps.items()}


def typical_change(fine: dict, sizes: dict, of=median) -> float:
    """Median relative change [1] of the main measures of a run, 0 where none changes; of: what is taken of these.

    A value below its floor, such as the work of an interface that holds, changes by its own size with every step and
    says nothing of the others; so it counts only where all are below, and then down to NOTHING of the floor.
    """
    changed = [name for name in MAIN if sizes.get(name) and fine[name]]
    for share in (1.0, NOTHING):
        told = [sizes[name] / abs(fine[name]) for name in changed if abs(fine[name]) > share * floor_of(name)]
        if told:
            return of(told)
    return 0.0


def with_errors(values: dict, *errors: dict, least: float = 0.0, size: float = np.inf) -> dict:
    """Measures by name whose error is the sum of the given errors, plus `least` of the value.

    A measure that a coarser run does not have is as uncertain as it is large. size [m]: as `floor_of` takes it.
    """
    out, amplitude = {}, values.get("relative_displacement_amplitude", 0.0)
    for name, value in values.items():
        error = total_error(name, value, [part.get(name, abs(value)) for part in errors], least, amplitude)
        out[name] = Measure(float(value), row_of(name).unit, float(error), float(floor_of(name, size)))
    return out


def unseen(found: dict, cycles: float) -> dict:
    """Measures by name behind a patch that slips part by part: a mesh shows no slip of less than an element, so a slip
    of 0 is known to the floor only, and with it work of 0 of so many cycles, 4 F u of a loop of force F and slip u."""
    out = dict(found)

    def shown(name: str) -> bool:
        one = found[name]
        return one.value is None or one.error is None or max(abs(one.value), one.error) > NOTHING * row_of(name).floor

    for name, slip in found.items():
        if of_first(name) != "slip_amplitude" or shown(name):
            continue
        number, least = name[len("slip_amplitude"):], max(slip.error, row_of(name).floor)
        force = found.get(f"friction_force_peak{number}")
        works = {f"loop_area{number}": 1.0} | ({} if number else {"energy_dissipated": cycles})
        errors = {name: least} | {one: 4 * abs(force.value) * least * times for one, times in works.items() if force}
        for one, error in errors.items():
            if one in found and not shown(one):
                out[one] = replace(found[one], error=max(found[one].error, error), floor=max(found[one].floor, error))
    return out


def total_error(name: str, value, parts, least: float, size):
    """Error of a measure of one run, or (n,) of many, from its `parts` of as many and `least` of the value.

    size [m]: amplitude of the output.
    """
    error = sum(parts) + np.abs(value) * least
    if name == "slip_start_phase":  # a phase modulo pi cannot be farther off
        return np.minimum(error, np.pi / 2)
    if name in GAPS:  # 0 but for what is missing, which is an error itself
        return np.maximum(error, np.abs(value))
    if name == "drift_per_cycle":  # a difference of means
        return error + max(LAST, least) * np.abs(size)
    return error
