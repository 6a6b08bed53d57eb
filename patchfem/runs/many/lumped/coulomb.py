"""Coulomb friction on one mode under a sine: the events of all cases in one compiled call, `dynamics.one_mode`."""


import numpy as np

from ....compiled import load
from ....dynamics.one_mode import window_kernels as read
from ....dynamics.second_book import gap
from ....effects import has
from ....response.loops import interface_loops
from ....response.spectrum import distorted
from ...rig.engines import EXACT, engine_of
from .columns import ENDS, Runs
from .threads import in_threads

PHASES = 8  # of a cycle for which there is room, beside those of the first ones
KERNELS = "dynamics.one_mode.batch_kernels"
LONGEST = 4000  # cycles of a run whose phases are all held


def refuses(model) -> str:
    """Why the cases of this kind do not take a model; "" where they do."""
    f = model.friction
    if not has(f.law, "set-valued") or has(f.law, "averaged"):
        return "its law is not Coulomb's"
    if not 20 <= model.rig.cycles <= LONGEST:
        return "its cycles are too few or too many"
    if not f.static > 0:
        return "nothing rubs"
    return "" if engine_of(model) is EXACT else "its engine is not the exact one"


def row_of(model) -> tuple:
    """(w, decay, static, kinetic, B, om, share, z, v) as `batch_kernels.runs` takes them, then slide and output per
    coordinate, mass, stiffness K, load and the largest acceleration of the drive."""
    rig, modes = model.rig, model.rig.modes
    drive, mass, slide, base = rig.drive, modes.mass, float(modes.slide[0]), float(modes.base[0])
    output = float(modes.output[0])
    static, kinetic = (force * (abs(slide) / mass) for force in model.limits(model.point.load))
    z, v = (0.0, 0.0) if rig.start is None else (float(rig.start.z[0]), float(rig.start.v[0]))
    return (float(modes.omega[0]), float(modes.dampers[0, 0]) / 2, static, kinetic, -base * drive.acceleration,
            drive.omega, -1 / (base * output) if drive.moving else 0.0, z, v, slide, output, mass, rig.stiffness,
            model.point.load, abs(drive.acceleration))


def coarsened(model) -> int:
    """Nothing is made coarser in a first run."""
    return 0


def runs_of(models, cycles: int, window: int, say=None, pairs: int = 0) -> Runs:
    """Runs of models of this kind, all of `cycles` cycles from their starts; pairs: 0."""
    table, n = np.array([row_of(model) for model in models]), len(models)
    windows = min(ENDS, (cycles - 1) // window + 1)
    extremes, phasors, books = np.empty((n, cycles, 2)), np.empty((n, windows, 2)), np.empty((n, 10))
    numbers, ends, codes = np.full((n, read.NUMBERS), np.nan), np.full((n, 3), np.nan), np.zeros(n, np.int64)
    kernels, given = load(KERNELS, say), np.ascontiguousarray(table[:, :9])

    def go(part: slice) -> None:
        room = (np.zeros((PHASES * cycles + 256, 10)), np.zeros((read.TURNS, 4)), np.zeros(6), np.zeros((cycles, 2)),
                np.zeros(9), np.zeros((1, 6)))
        kernels.runs(given[part], (cycles, window), room,
                     tuple(one[part] for one in (extremes, phasors, books, numbers, ends)), codes[part])

    in_threads(go, n)
    output, mass = table[:, 10], table[:, 11]
    # where a rest at an extreme outlasts the window, round-off decides which of two like rests counts
    lost = (codes != 1) | (np.isnan(numbers[:, read.SECANT]) & (numbers[:, read.HIGH] > numbers[:, read.LOW]))
    begun = 0.5 * mass * (table[:, 8]**2 + table[:, 0]**2 * table[:, 7]**2)
    stored = 0.5 * mass * (ends[:, 1]**2 + table[:, 0]**2 * ends[:, 0]**2)
    book = dict(zip(("work_in", "viscous", "power", "friction"), mass * books[:, :4].T))
    book |= {"stored": stored - begun, "peak_stored": np.maximum(0.5 * mass * ends[:, 2], stored)}
    stuck = numbers[:, read.STUCK] >= window * 2 * np.pi / table[:, 5] * (1 - 1e-12)
    with np.errstate(all="ignore"):
        values = _values(table, numbers.T, book, window, stuck)
    reach = np.abs(table[:, 9]) * np.abs(numbers[:, [read.LOW, read.HIGH]]).max(axis=1)
    return Runs(cycles, window, values, book, np.sort(output[:, None, None] * extremes, axis=2),
                output[:, None] * (phasors[:, :, 0] + 1j * phasors[:, :, 1]),
                stuck, lost, {"drift_per_cycle": 1e-14 * reach}, EXACT.least, EXACT.closes)


def _values(table, x, book: dict, window: int, stuck) -> dict:
    """Measures (n,) by name from the numbers x (NUMBERS, n) of `window_kernels`, but amplitude and energy balance."""
    omega, slide, output, mass, stiffness, load_, level = table[:, 5], *table[:, 9:].T
    period, weight, lost = 2 * np.pi / omega, x[read.WEIGHT], book["friction"]
    mean = x[read.SUM] / (window * period)
    q = 2 * slide * (x[read.Z_COS] - mean * x[read.COS] - 1j * (x[read.Z_SIN] - mean * x[read.SIN])) / weight
    f = 2 * mass / slide * (x[read.F_COS] - 1j * x[read.F_SIN]) / weight
    work = mass * x[read.POWER] / window
    moves = x[read.HIGH] > x[read.LOW]
    first, third = (2 * np.abs(output) * np.hypot(x[cosine], x[sine]) / weight
                    for cosine, sine in ((read.A_COS, read.A_SIN), (read.A3_COS, read.A3_SIN)))
    angle = np.arctan2(x[read.START_SIN], x[read.START_COS]) / 2 % np.pi
    energy = book["power"] + book["peak_stored"]
    out = {
        "absolute_acceleration_peak": np.abs(output) * x[read.ACCELERATION],
        "friction_force_peak": x[read.FORCE] * mass / np.abs(slide),
        "absolute_acceleration_fundamental": first, "acceleration_distortion": distorted(first, third, level),
        "drift_per_cycle": slide * (x[read.LAST] - x[read.FIRST]) / (window - 1),
        "slip_amplitude": np.abs(slide) * (x[read.HIGH] - x[read.LOW]) / 2,
        "stick_fraction": np.where(stuck, 1.0, x[read.STUCK] / (window * period)),
        "slip_start_phase": np.where(x[read.STARTS] > 0, angle, np.nan),
        "normal_load": load_, "friction_work": lost, "energy_dissipated": lost, "energy_created": np.zeros(len(table)),
        "work_check": gap(mass * x[read.WORK], mass * x[read.POWER], mass * x[read.PASSED], energy),
        "secant_stiffness": np.where(moves, x[read.SECANT] * mass / slide**2, np.nan)}
    half = np.where(moves, np.abs(slide) * x[read.RANGE] / 2, 0.0)
    return out | interface_loops(half, q, f, work, stiffness)


NUMERICS = {"engine": "exact"}

