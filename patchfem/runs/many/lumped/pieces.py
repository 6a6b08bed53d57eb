"""Elastic-plastic elements, one or many, on one mode under a sine: all cases in one compiled call,
`dynamics.piecewise_one`."""

from math import ceil

import numpy as np

from ....compiled import load
from ....core import Start
from ....dynamics.piecewise import histories
from ....dynamics.piecewise.elements import paired
from ....dynamics.piecewise.plant import clock_of
from ....dynamics.piecewise_one import names_kernels as read
from ....dynamics.piecewise_one import room as made
from ....dynamics.second_book import gap
from ....effects import has
from ....friction.record import law_from
from ....response import run_events
from ....response.errors import cells_error
from ....response.loops import interface_loops
from ....response.measures import ROUND, energy_balance
from ....response.ringing import FAINT
from ....response.rows import stuck_share
from ....response.spectrum import distorted
from ...rig.engines import PIECES, engine_of
from ...rig.pieces.costs import REACH, pairs_of
from ...rig.pieces.run import group_of, settled_of
from .columns import ENDS, MAIN, Runs
from .threads import in_threads

KERNELS = "dynamics.piecewise_one.batch_kernels"
ROOM = 1.5  # times the pieces that a window may have
CYCLES = 3  # that hold every stick of a cycle whole
OMEGA = 5  # place of the angular frequency in a segment, as `drive_kernels` has it
SHORTEST, LONGEST = 20, 4000  # cycles of a run whose extremes are all held


def refuses(model) -> str:
    """Why the cases of this kind do not take a model; "" where they do."""
    if not has(model.friction.law, "cells") and model.friction.law != "elastic-plastic":
        return "its law is not made of elements"
    if not SHORTEST <= model.rig.cycles <= LONGEST:
        return "its cycles are too few or too many"
    return "" if engine_of(model) is PIECES else "its engine is not that of pieces"


def row_of(model, faces=None, load_: float = 0.0) -> tuple:
    """(rig (6,), start (5,), segment (10,), Elements, (stiffness K, load)) of a model: rig and start by the places of
    `names_kernels`, the drive as `drive_kernels` has it.

    faces: `rig.pieces.run.Interfaces` under load_ [N], None for those of the model's one point.
    """
    rig, modes = model.rig, model.rig.modes
    if faces is None:
        load_ = model.point.load
        element = law_from(model.friction, load_).element(load_)
        group, held = group_of(element), 1e-3 * element.length
    else:
        (group,), held = faces.groups, faces.held
    z, v = (0.0, 0.0) if rig.start is None else (float(rig.start.z[0]), float(rig.start.v[0]))
    numbers = (float(modes.omega[0])**2, float(modes.dampers[0, 0]), float(modes.interfaces[0, 0]),
               float(modes.base[0]), float(modes.output[0]), modes.mass)
    start = z, v, float(rig.drive.moving), model.accuracy.tolerance, held
    return numbers, start, clock_of(rig.drive, 1).segments[0], group, (rig.stiffness, load_)


def runs_of(models, cycles: int, window: int, say=None, pairs: int = 0) -> Runs:
    """Runs of models of this kind, all of `cycles` cycles from their starts; pairs: as `Numerics` has it."""
    rows = [row_of(model) for model in models]
    for _ in range(pairs):
        rows = _halved(rows)
    out = moved(rows, cycles, window, say, models=models)
    if has(models[0].friction.law, "cells"):
        return _with_cells(out, moved(_halved(rows), cycles, window, say, steady=False))
    return out


def _halved(rows: list) -> list:
    """Rows whose elements are each two of the given ones."""
    return [(*row[:3], paired(row[3]), row[4]) for row in rows]


def moved(rows: list, cycles: int, window: int, say=None, least: int = 0, steady: bool = True, models=None) -> Runs:
    """Runs of cases given as rows of `row_of`.

    least: cases of a thread, as `in_threads` has it; steady: whether the motion is sought that a case settles to, as a
    run for an error does not; models: of the cases, so that one of which samples have to tell what rings is not lost
    where nothing does.
    """
    rigs, starts, segments, others = (np.array([row[k] for row in rows]) for k in (0, 1, 2, 4))
    groups, kernels = [row[3] for row in rows], load(KERNELS, say)
    if not steady:
        starts[:, read.TOLERANCE] = np.inf
    yields = 2 * max(one.stiffness.size for one in groups)
    most = ceil(ROOM * window * (most_pieces(rigs, 2 * np.pi / segments[:, OMEGA], groups) + yields)) + 256
    found = _solved(kernels, (rigs, starts, segments), groups, (cycles, window), most, least)
    out = _read(found, others, cycles, window)
    rings = _may_ring(found, out.stuck)
    for case in np.flatnonzero(rings & ~out.lost & (found.numbers[:, read.ALIKE] == 1)).tolist():
        if out.values["stick_fraction"][case] == 1:  # a motion that repeats and holds for ever has nothing that decays
            rings[case] = False
        elif models is not None:
            rings[case] = _rings(models[case], groups[case], found.end_of(kernels, case, most))
    out.lost[rings] = True
    return out


def most_pieces(rigs, periods, groups: list) -> float:
    """Largest number of pieces in a cycle of n cases of periods (n,) [s]: `costs.pieces` of numbers that are there
    already."""
    stiff, damping = np.array([one.stiffness.sum() for one in groups]), rigs[:, read.DAMPING]
    square = rigs[:, read.SQUARE] + stiff * rigs[:, read.FACE]**2 / rigs[:, read.MASS]
    turned = (damping / 2 + np.sqrt(damping**2 / 4 + square)) * periods
    turned = np.maximum(turned, 2 * np.pi)
    return float((turned / REACH + 2 * np.array([one.stiffness.size for one in groups]) + 2).max())


def tables_of(groups) -> tuple:
    """(counts (n,), sorts (n, 4, t + 1)) of the elements of n cases, t of the longest list: of each what `table_of` has
    as count, and as reach, stiff, limit and twice."""
    counts = np.array([one.stiffness.size for one in groups], np.int64)
    wide = int(counts.max(initial=0))
    there = np.arange(wide) < counts[:, None]
    k, y = np.zeros((2, len(groups), wide))
    k[there], y[there] = (np.concatenate(part) for part in zip(*((one.stiffness, one.yield_slide) for one in groups)))
    sorts = np.zeros((len(groups), 4, wide + 1))
    sorts[:, 0] = np.inf
    sorts[:, 0, :wide][there] = y[there]
    for column, part in zip((1, 2, 3), (k, k * y, k * y * y)):
        sorts[:, column, 1:] = np.cumsum(part, axis=1)
    return counts, sorts


class _Found:
    """What the compiled call gave of n cases, arrays by the names that it has for them."""

    def __init__(self, given, counts, sorts, cycles: int, window: int):
        n, windows = len(counts), min(ENDS, (cycles - 1) // window + 1)
        self.rigs, self.starts, self.segments, self.counts, self.sorts = *given, counts, sorts
        self.extremes, self.phasors = np.empty((n, cycles, 2)), np.empty((n, windows, 2))
        self.ledgers, self.numbers = np.empty((n, 8)), np.full((n, read.NUMBERS), np.nan)
        self.ends, self.steady = np.full((n, 5), np.nan), np.full((n, 3), np.nan)
        self.slopes, self.codes = np.zeros((n, read.MOST, read.MOST)), np.zeros(n, np.int64)
        self.shape, self.wanted = (cycles, window), np.zeros(cycles)
        self.wanted[cycles - 1 - window * np.arange(windows)] = 1.0

    def run(self, kernels, part: slice, most: int) -> tuple:
        """The compiled call for some cases, with at most so many rows in a window: what it worked in."""
        given = self.rigs, self.starts, self.segments, self.counts, self.sorts
        answers = self.extremes, self.phasors, self.ledgers, self.numbers, self.ends, self.steady, self.slopes
        work = made.work_of(self.sorts.shape[2] - 1, self.shape[0], self.wanted, most)
        kernels.runs(tuple(one[part] for one in given), self.shape, work, tuple(one[part] for one in answers),
                     self.codes[part])
        return work

    def end_of(self, kernels, case: int, most: int) -> tuple:
        """(Start, memory) at the end of a case, which is run once more for it."""
        _, motion, memory, *_ = self.run(kernels, slice(case, case + 1), most)
        return Start(*motion.copy()), memory


def _solved(kernels, given, groups: list, shape: tuple, most: int, least: int = 0) -> _Found:
    """The compiled call for elements of every case."""
    found = _Found(given, *tables_of(groups), *shape)
    in_threads(lambda part: found.run(kernels, part, most), len(groups), least)
    return found


def _may_ring(found: _Found, stuck) -> np.ndarray:
    """Whether the samples of a run behind many elements have to tell what rings, (n,)."""
    turns = found.numbers[:, read.SWING] >= made.RINGS
    return (found.counts > 1) & turns & ((found.ledgers[:, 7] > 0) | stuck)


def _rings(model, group, end: tuple) -> bool:
    """Whether a run that repeats rings in the sticks of one more cycle of it. end: (Start, memory) of it."""
    modes, drive = model.rig.modes, model.rig.drive
    done = histories.simulate(modes, drive, (group,), CYCLES, CYCLES, start=end[0], memory=end[1])
    return run_events.rings(done.window, modes, drive, done.log, repeats=True) != ({}, {})


def _read(found: _Found, others, cycles: int, window: int) -> Runs:
    """Measures of the runs."""
    x, ends, ledger = found.numbers.T, found.ends.T, found.ledgers.T
    book = dict(zip(("work_in", "viscous", "power"), ledger)) | {"friction": ledger[4]}
    book |= {"stored": ends[read.STORED] - ends[read.BEGUN], "peak_stored": np.maximum(ledger[5], ends[read.BEGUN])}
    period = 2 * np.pi / found.segments[:, OMEGA]
    with np.errstate(all="ignore"):
        values = _values(found, x, book, others, period, window)
        half = (x[read.SLIP_HIGH] - x[read.SLIP_LOW]) / 2
        stuck = half <= np.maximum(found.starts[:, read.HELD], ROUND * x[read.REACH])
        pulls = np.abs(x[[read.F_FIRST, read.F_LAST]]) / period
        loads = stuck & (pulls[1] - pulls[0] > found.starts[:, read.TOLERANCE] * x[read.FORCE])
    settles = (found.codes == read.STEADY) & ~stuck
    steady = np.full((2, len(stuck)), np.nan)
    if settles.any():
        slopes = np.linalg.eigvals(found.slopes[settles])
        steady[:, settles] = settled_of(*found.steady[settles][:, [read.AMOUNT, read.RESIDUAL]].T, slopes)
    lost = (found.codes == read.LOST) | ((found.codes == read.UNKNOWN) & ~stuck) | (x[read.EDGE] > 0)
    errors = {name: np.zeros(len(stuck)) for name in values}
    return Runs(cycles, window, values, book, found.extremes, found.phasors @ [1, 1j], stuck, lost, errors,
                PIECES.least, PIECES.closes, loads, tuple(steady))


def _values(found: _Found, x, book: dict, others, period, window: int) -> dict:
    """Measures (n,) by name from the numbers x (NUMBERS, n), but amplitude and energy balance."""
    span, (stiffness, load_) = window * period, others.T
    q = 2 / span * (x[read.Q_COS] - 1j * x[read.Q_SIN])
    f = 2 / span * (x[read.F_COS] - 1j * x[read.F_SIN])
    first, third = (2 / span * np.hypot(x[a], x[b]) for a, b in ((read.A_COS, read.A_SIN), (read.A3_COS, read.A3_SIN)))
    angle = np.arctan2(x[read.START_SIN], x[read.START_COS]) / 2 % np.pi
    energy, moves = book["power"] + book["peak_stored"], x[read.HIGH] > x[read.LOW]
    rung, own, damping = made.ring_of(found.rigs, found.sorts[:, 1].max(axis=1), x[read.RING])
    rings = (rung > FAINT * x[read.ACCELERATION]) & (found.counts == 1)
    out = {
        "absolute_acceleration_peak": x[read.ACCELERATION], "friction_force_peak": x[read.FORCE],
        "absolute_acceleration_fundamental": first, "acceleration_distortion": distorted(first, third, 0.0),
        "drift_per_cycle": (x[read.LAST] - x[read.FIRST]) / period / (window - 1),
        "slip_amplitude": (x[read.SLIP_HIGH] - x[read.SLIP_LOW]) / 2,
        "stick_fraction": stuck_share(x[read.STUCK], span),
        "slip_start_phase": np.where(x[read.STARTS] > 0, angle, np.nan), "normal_load": load_,
        "friction_work": found.ledgers[:, 3], "energy_dissipated": found.ends[:, read.EVER],
        "energy_created": np.zeros(len(x[0])),
        "work_check": gap(x[read.TURNED], x[read.WORK], x[read.PASSED], energy),
        "secant_stiffness": np.where(moves, x[read.SECANT], np.nan),
        "ring_frequency": np.where(rings, own / (2 * np.pi), np.nan), "ring_damping": np.where(rings, damping, np.nan)}
    return out | interface_loops(np.where(moves, x[read.RANGE] / 2, 0.0), q, f, x[read.WORK] / window, stiffness)


def _with_cells(fine: Runs, coarse: Runs) -> Runs:
    """Runs with the errors that runs of half as many elements tell."""
    whole = [one.values | {MAIN: one.amplitudes, "energy_balance": energy_balance(one.book)} for one in (fine, coarse)]
    for case in range(len(fine.stuck)):
        a, b = ({name: float(part[case]) for name, part in one.items() if not np.isnan(part[case])} for one in whole)
        told = cells_error(a, b)
        for name, value in a.items():
            fine.errors.setdefault(name, np.zeros(len(fine.stuck)))[case] = told.get(name, abs(value))
    return fine


NUMERICS = {"engine": "piecewise"}


def coarsened(model) -> int:
    """How often each two elements count as one in a first run."""
    return pairs_of(model)
