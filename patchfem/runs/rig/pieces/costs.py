"""What a run from yield to yield costs beside a march, before anything runs.

Measured on one core: a piece of one mode takes 0.25 us, and 3 ns more for each element; a step of the march 0.43 us and
0.9 ns per element, and a cycle of it 0.3 ms besides. What an element rings on costs pieces only while it holds: all the
time where the friction limit exceeds the push of the drive, hardly any where it is half of it.
"""

from functools import lru_cache
from math import inf, log2, pi, sqrt

import numpy as np

from ....core import Missing
from ....effects import has
from ....friction.bonds.parameters import LONGEST
from ....friction.record import law_from
from ....model.model import Model
from ....structure.drive_sizes import fastest, largest
from ...effort import steps_per_cycle

# seconds of a piece of the motion, of each further mode in it, of each element
PIECE, PIECE_MODE, PIECE_ELEMENT = 2.5e-7, 1.5e-7, 3e-9
MOST_PIECE = 1e-6  # of one at most
HELD = 6  # power of the limit over the push that gives the share of the time in which an element holds (measured .01)
CYCLE, STEP, STEP_ELEMENT = 3e-4, 4.3e-7, 9e-10  # seconds of a cycle of the march, of a step, of each element in it
MOST_PAIRS, AT = 4, 1e-3  # 49 of 769 cells at this tolerance and above: 2e-4 of the motion behind a joint that slips
REACH = 2.0  # of `dynamics.events.series_kernels`


def pairs_of(model: Model) -> int:
    """How often each two cells of a density count as one at first: what cells leave open falls with their square, and
    where the error of a run shows too much it is made again with more (`Numerics.finer`)."""
    laws = [one.numbers.law for one in model.rig.interfaces]
    if model.soft or not all(has(law, "cells") for law in laws):
        return 0
    return int(min(max(MOST_PAIRS + log2(model.accuracy.tolerance / AT) / 2, 0), MOST_PAIRS))


@lru_cache(8)
def sizes(model: Model) -> tuple:
    """(elements, stiffness [N/m] of those of the stiffest interface) that the interfaces of a rig have, estimated."""
    count, stiff = 0, 0.0
    for one in model.rig.interfaces:
        load = model.nominal_load if one.load is None else one.load
        if has(one.numbers.law, "set-valued"):
            most, mine = inf, 1
        else:
            element = law_from(one.numbers, load).element(load)
            mine = int(element.numbers[1]) >> pairs_of(model)
            most = float(element.numbers[2:2 + int(element.numbers[1])].sum())
        if model.soft:
            from ....model.patch import CHOSEN_POINTS, block_shear

            patch = model.patch
            most = 1 / (1 / most + 1 / block_shear(patch))
            mine = CHOSEN_POINTS if patch.chosen else round(patch.length / patch.size) + 1
        count, stiff = count + mine, max(stiff, most)
    return count, stiff


def pieces(model: Model) -> float:
    """Pieces of the motion per cycle of the drive at most: of its fastest rate while all holds, and of every yield."""
    return sum(_ringing_and_yields(model))


def _ringing_and_yields(model: Model) -> tuple:
    """Pieces per cycle of a motion whose elements hold all the time, and those of every yield and row."""
    modes, drive = model.rig.modes, model.rig.drive
    count, stiff = sizes(model)
    reach = float((np.asarray(modes.interfaces)**2).sum(axis=1).max(initial=0.0)) / modes.mass
    dampers = modes.dampers
    damping = float(np.linalg.norm(dampers, 2)) if dampers.size > 1 else abs(float(dampers[0, 0]))
    rate = damping / 2 + sqrt(damping**2 / 4 + float(modes.omega.max())**2 + stiff * reach)
    rows = 0 if drive.segments else len(drive.breaks) / model.rig.cycles
    return max(rate * drive.period, 2 * pi * fastest(drive)) / REACH, 2 * count * fastest(drive) + 2 + rows


def seconds_of_pieces(model: Model) -> float:
    """Seconds of a run from yield to yield at most, by which its engine is chosen: all holds all the time."""
    each = MOST_PIECE + PIECE_MODE * (model.rig.modes.omega.size - 1)
    return each * pieces(model) * model.rig.cycles


def expected_seconds(model: Model) -> float:
    """Seconds of a run from yield to yield as a plan counts them: what rings while an element holds is passed in the
    share of the time in which it does."""
    rig = model.rig
    limit = sum(one.numbers.static * (model.nominal_load if one.load is None else one.load) for one in rig.interfaces)
    push = rig.force or rig.mass * largest(rig.drive)
    ringing, yields = _ringing_and_yields(model)
    each = PIECE + PIECE_MODE * (rig.modes.omega.size - 1) + PIECE_ELEMENT * sizes(model)[0]
    return each * (ringing * (min(1.0, limit / push)**HELD if push else 1.0) + yields) * rig.cycles


def seconds_of_steps(model: Model) -> float:
    """Estimated seconds of a march with the coarser runs of its error, which has none of the exactness."""
    count, many = sizes(model)[0], len(model.rig.interfaces)
    each = CYCLE + steps_per_cycle(model) * many * (STEP + STEP_ELEMENT * count)
    return 1.75 * model.rig.cycles * each


def refuse_endless(model: Model) -> None:
    """Raise Missing when a run from yield to yield would take longer than LONGEST seconds."""
    seconds = seconds_of_pieces(model)
    if seconds > LONGEST:
        raise Missing(f"the exact motion (about {pieces(model):.2g} pieces per cycle, of its yields and of the fastest "
                      f"ringing) would take about {seconds:.0f} s, more than {LONGEST:.0f} s; lower drive.cycles or "
                      "the stiffness, or use accuracy.method = \"march\"", "")


def words(model: Model, engine: str) -> list:
    """The sentence of a plan on which engine takes the elements, and why."""
    count, exact, march = sizes(model)[0], expected_seconds(model), seconds_of_steps(model)
    return [f"{count} element{'s' * (count > 1)} by engine {engine}: about {exact:.2g} s from yield to yield, exact, "
            f"about {march:.2g} s by steps at this tolerance"]
