"""Smooth laws without states of their own on one mode under a sine: motions side by side, `dynamics.smooth.many`."""

import numpy as np

from ....compiled import kernels, load
from ....dynamics.second_book import gap
from ....dynamics.smooth import run as hub
from ....dynamics.smooth.many import together
from ....dynamics.smooth.waves import fits, wave_of
from ....effects import has
from ....response.errors import tolerance_error
from ....response.loops import interface_loops
from ....response.measures import ROUND, energy_balance
from ....response.ringing import LEAST_SAMPLES
from ....response.run_events import rings
from ....response.spectrum import distorted
from ...rig.engines import COARSER, SMOOTH, engine_of
from ...rig.numerics import local_of
from ...rig.smooth.choice import element_of
from ...rig.smooth.solve import CLEAR, LOCATED, SAFE
from .columns import Runs
from .threads import in_threads

KERNELS = "dynamics.smooth.reading_kernels"
read = kernels(KERNELS)  # its places of numbers, without the compiler that it brings
LONGEST = 4000  # cycles of a run whose extremes are all held
TOGETHER = 64  # motions whose samples are held at once
NUMERICS = {"engine": "smooth"}


def refuses(model) -> str:
    """Why the cases of this kind do not take a model; "" where they do."""
    if not 20 <= model.rig.cycles <= LONGEST:
        return "its cycles are too few or too many"
    if model.grooves is not None or not model.friction.static > 0 or engine_of(model) is not SMOOTH:
        return "its engine is not the smooth one"
    element = element_of(model)
    fit = fits(model.rig.modes, element, wave_of(model.rig.drive))
    return "" if fit else "its motion does not stand beside others"


def coarsened(model) -> int:
    """Nothing is made coarser in a first run."""
    return 0


def runs_of(models, cycles: int, window: int, say=None, pairs: int = 0) -> Runs:
    """Runs of models of this kind, all of `cycles` cycles from their starts."""
    hub.loops_of(element_of(models[0]).kernels, say)
    parts = {}

    def go(part: slice) -> None:
        for first in range(part.start, part.stop, TOGETHER):
            parts[first] = _solved(models[first:min(first + TOGETHER, part.stop)], cycles, window)

    in_threads(go, len(models))
    solved = [parts[first] for first in sorted(parts)]
    values, errors = ({name: np.concatenate([one[k].get(name, np.full(len(one[5]), np.nan)) for one in solved])
                       for name in dict.fromkeys(name for one in solved for name in one[k])} for k in (0, 1))
    book = {name: np.concatenate([one[2][name] for one in solved]) for name in solved[0][2]}
    extremes, phasors, lost = (np.concatenate([one[k] for one in solved]) for k in (3, 4, 5))
    return Runs(cycles, window, values, book, extremes, phasors, np.zeros(len(models), bool), lost, errors,
                SMOOTH.least, np.inf, chosen=sum((one[6] for one in solved), ()))


def _solved(models, cycles: int, window: int) -> tuple:
    """(values, errors, book, extremes, phasors, lost, chosen) of some models, as Runs has them."""
    n, local = len(models), np.array([local_of(model.accuracy.tolerance) for model in models])
    cases = [(model.rig.modes, model.rig.drive, element_of(model), model.rig.start) for model in models]
    done = together(cases, cycles, window, [local, COARSER * local])
    count, turned = done.lost.size, done.kept.turns
    period, numbers = np.tile([model.rig.drive.period for model in models], 2), np.zeros((count, read.NUMBERS))
    load(KERNELS).read(done.kept.samples, turned, done.kept.tally[:, hub.TURNS].copy(), period, window,
                       done.kept.tally[:, hub.STORED].copy(),
                       np.zeros((done.kept.samples.shape[1] + turned.shape[1], 10)), numbers)
    tally, y = done.kept.tally, done.moving.y
    book = {"work_in": y[:, -3] + done.begun, "viscous": y[:, -2], "power": tally[:, hub.POWER] + done.begun,
            "friction": tally[:, hub.LOST], "peak_stored": tally[:, hub.STORED], "stored": done.stored}
    with np.errstate(all="ignore"):
        values, own, stuck = _values(models, done, numbers, book)
    lost = (done.lost | stuck).reshape(2, n).any(axis=0)
    ringing = _ringing(models, cases, done, numbers)
    found, errors = {name: value[:n].copy() for name, value in values.items()}, {}
    for name in sorted({name for one in ringing for name in one[0]}):
        found[name] = np.array([one[0].get(name, np.nan) for one in ringing[:n]])
    for case in np.flatnonzero(~lost).tolist():
        fine, coarse = ({name: value[k] for name, value in values.items() if not np.isnan(value[k])} | ringing[k][0]
                        for k in (case, n + case))
        coming = tolerance_error(fine, coarse, models[case].rig.displacement)
        for name, value in fine.items():
            left = (own[name][case] if name in own else 0.0) + ringing[case][1].get(name, 0.0)
            errors.setdefault(name, np.zeros(n))[case] = coming.get(name, abs(value)) + left
    extremes = done.kept.cycles[:n, :2].transpose(0, 2, 1)
    pick = np.arange(cycles - 1, -1, -window)[::-1]
    phasors = (done.kept.cycles[:n, 2] + 1j * done.kept.cycles[:n, 3])[:, pick]
    steps = tally[:n, hub.DONE]
    chosen = tuple({"step_tolerance": float(one), "steps": int(count)} for one, count in zip(local, steps))
    return found, errors, {name: one[:n] for name, one in book.items()}, extremes, phasors, lost, chosen


def _values(models, done, x, book: dict) -> tuple:
    """Measures (m,) by name of m motions, the first half of them the runs themselves; what their samples leave open,
    by name; (m,) whether one must be run by itself as it sticks.

    x (m, NUMBERS): of `reading_kernels`.
    """
    fine = hub.fine_of(done.kept.tally, done.begin, done.end)
    period, stiffness, normal, held, level, base = (np.tile(one, 2) for one in zip(*map(_numbers, models)))
    span = done.end[:, 0] - done.begin[:, 0]
    noise = ROUND * x[:, read.LARGEST]
    stuck = (x[:, read.SLIPPED] / 2 <= np.maximum(held, noise)) | (2 * fine["slip"] <= CLEAR * noise)
    moves = x[:, read.RANGE] > 0
    work = fine["work"] * period / span
    energy = book["power"] + book["peak_stored"]
    out = {"relative_displacement_amplitude": fine["swing"], "absolute_acceleration_peak": fine["acceleration"],
           "friction_force_peak": fine["force"], "energy_balance": energy_balance(book),
           "absolute_acceleration_fundamental": np.abs(fine["first"] + base),
           "acceleration_distortion": distorted(np.abs(fine["first"] + base), np.abs(fine["third"]), level),
           "drift_per_cycle": fine["drift"], "slip_amplitude": fine["slip"],
           "stick_fraction": np.minimum(fine["held"] / span, 1.0), "slip_start_phase": fine["start"],
           "normal_load": normal, "secant_stiffness": np.where(moves, x[:, read.SECANT], np.nan),
           "friction_work": x[:, read.FRICTION], "energy_dissipated": x[:, read.DISSIPATED],
           "energy_created": x[:, read.CREATED],
           "work_check": gap(x[:, read.SAMPLED], x[:, read.BOOKED], x[:, read.PASSED], energy)}
    loops, half = (interface_loops(x[:, k] / 2, fine["slide"], fine["pull"], work, stiffness) for k in (
        read.RANGE, read.RANGE_HALF))
    open_ = {"secant_stiffness": SAFE * np.abs(x[:, read.SECANT] - x[:, read.SECANT_HALF]),
             "equivalent_damping": SAFE * np.abs(loops["equivalent_damping"] - half["equivalent_damping"]),
             "stick_fraction": np.full(len(x), LOCATED), "slip_start_phase": np.full(len(x), LOCATED)}
    return out | loops, open_, stuck


def _numbers(model) -> tuple:
    """Period [s], stiffness K [N/m] and load [N] of a model, slip below which it sticks [m], acceleration of its
    drive [m s-2] and what of it the base moves by itself, as a Fourier coefficient."""
    drive, creeps = model.rig.drive, has(model.friction.law, "creeps")
    last = drive.segments[-1]
    base = -1j * last.amplitude * np.exp(1j * (last.phase - last.omega * last.start)) if drive.moving else 0j
    return (drive.period, model.rig.stiffness, model.point.load,
            0.0 if creeps else 1e-3 * element_of(model).length, abs(last.amplitude), base)


def _ringing(models, cases, done, numbers) -> list:
    """(measures of what rings in a stick, their errors) of every motion; most rest too shortly for any, and a law that
    creeps never holds."""
    out = []
    for k in range(len(numbers)):
        model, (modes, drive, element, _) = models[k % len(models)], cases[k % len(models)]
        creeps = has(model.friction.law, "creeps")
        if creeps or done.lost[k] or numbers[k, read.REST] + 3 < LEAST_SAMPLES:
            out.append(({}, {}))
            continue
        window = hub.response_of(modes, drive, done.kept.samples[k], float(done.kept.tally[k, hub.STORED]))
        out.append(rings(window, modes, drive, None, 1e-3 * element.length))
    return out
