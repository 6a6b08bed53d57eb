"""The coupled run of a scene: patch or point, law and modes, by the exact engine or the march, with its errors."""

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from ...core import ModalBasis, Outcome, Response
from ...effects import has
from ...model.accuracy import Settings
from ...model.interfaces import yaws
from ...model.structure import mode_stiffness, start_of
from ...response.measures import (
    energy_balance,
    harmonic,
    interface_loop,
    ledger_measures,
    run_measures,
    slip_measures,
    step_harmonic,
    window_amplitudes,
    window_ends,
)
from ...response.outcome import steady_of
from ...structure.drive_sizes import omega_of, peak_speed, sinusoidal, whole


@dataclass(frozen=True, eq=False, slots=True)
class Raw:
    """One run before its errors are known: values by measure name, histories, amplitudes per window, (steady amplitude,
    error) or (None, None), snapshots; levels: of a run in levels, slips: as `rig_levels.onset` asks;
    log: events of the exact engine; notes: warnings of the method; held: slip [m] below which a cycle sticks; own: what
    the run itself leaves open of its measures."""

    values: dict
    response: Response
    window: Response
    amplitudes: np.ndarray
    steady: tuple
    outcome: Outcome | None
    snapshots: list
    book: dict
    seconds: float
    model: object = None
    prepare: dict | None = None
    message: str = ""
    levels: tuple = ()
    slips: object = None
    log: object = None
    notes: tuple = ()
    held: float = 0.0
    own: dict | None = None


def sampled(values: dict) -> dict:
    """Errors of measures of strips that are read off 400 samples a cycle, by the trapezoidal rule."""
    loops = ("loop_area", "equivalent_stiffness", "equivalent_damping", "slip_amplitude", "friction_force_peak")
    return {name: 1e-4 * abs(value) if name in loops else 0.005 if name in ("stick_fraction", "slip_start_phase")
            else 1e-9 * abs(value) for name, value in values.items()}


def _ledger(ledger) -> dict:
    """Measures of the ledger but for what is stored, which depends on the instant at which the run ends."""
    return {name: value for name, value in ledger_measures(ledger).items() if name != "energy_stored"}


def run_march(scene, settings: Settings, modes, drive, patch, frames: int = 0, say=None, progress=None) -> Raw:
    """One march at settings.steps per cycle."""
    from ...dynamics.march import march as hub
    from ...dynamics.march.march import Mark
    from ...response import run_events
    from . import levels as rig_levels
    from .interface import model_of
    from .strips import joined, other_measures

    travel, marks, start = scene.structure.travel or np.inf, rig_levels.ends(scene), start_of(scene, modes)
    begin = perf_counter()
    model = model_of(scene, settings, patch, modes, drive, start)
    reduced = perf_counter() - begin
    hub.warm_up(modes, drive, model, say)
    loaded = perf_counter() - begin - reduced
    begin = perf_counter()
    frames = 0 if yaws(scene) else frames  # strips have no common field of shear
    done = hub.march(modes, drive, model, settings.cycles, settings.steps, settings.window, travel, frames, say,
                     progress, start, marks)
    seconds = perf_counter() - begin
    done = joined(done, patch) if yaws(scene) else done
    last = min(settings.window, len(done.amplitudes))
    values = run_measures(done.window, done.amplitudes, done.ledger, drive, last)
    held, rubbing = 0.0, None
    if scene.friction is None:
        values.pop("friction_force_peak")
    else:
        held = 1e-15 * peak_speed(drive) * drive.period if model.set_valued else 1e-3 * model.length
        creeps = has(scene.friction.law, "creeps")  # it never holds, nor sticks
        held *= not creeps

        def rubbing(part):
            others = {} if yaws(scene) else other_measures(part.window, drive, settings.steps)
            found = _rubbing(scene, settings, modes, drive, patch, part) | others
            rigid = model.set_valued and found["slip_amplitude"] < held  # what moves is round-off
            return {name: v for name, v in found.items() if not (rigid and name.startswith("equivalent_"))}

        whole_run = Mark(done.window, done.step_force, done.window_work, done.amplitudes, done.ledger)
        values |= rubbing(whole_run) | _ledger(done.response.extra["ledger"])
    rings, own, stuck = {}, {}, False
    if scene.friction is not None:
        rings, own = run_events.rings(done.window, modes, drive, None, held)
        stuck = run_events.all_stick(done.window, held) and not creeps
        if stuck and model.set_valued:  # what moves in round-off does not slide
            values["stick_fraction"] = 1.0
            for name in ("slip_start_phase", "equivalent_stiffness", "equivalent_damping"):
                values.pop(name, None)
            moving = modes.mass * peak_speed(drive, start)**2  # its energies are round-off of such a one
            values["energy_balance"] = energy_balance(done.ledger | {"power": done.ledger["power"] + moving})
    values |= rings
    if scene.friction is not None and "normal_load" in done.window.extra:
        load = done.window.extra["normal_load"]
        values |= {"normal_load_least": float(load.min()), "normal_load_peak": float(load.max()),
                   "open_fraction": float(np.mean(load <= 0))}
    levels, slips = (), None
    if marks:
        levels = rig_levels.rows(scene, done.marks, drive, held, rubbing)

        def slips(number, level):
            other = rig_levels.drive_with(drive, number + 1, level)
            run = done.marks[number].after.fork(other) if number >= 0 else hub.fresh(
                modes, other, model, settings.steps, travel, start)
            return run.slip_amplitude(round(marks[0]), settings.window) >= held
    outcome = done.outcome or (Outcome.STUCK if stuck else None)
    ends = window_ends(done.amplitudes, done.phasors, settings.window)
    return Raw(values, done.response, done.window, window_amplitudes(done.amplitudes, settings.window),
               steady_of(drive, *ends), outcome, done.snapshots, done.ledger, seconds, model,
               {"reduce": reduced, "load": loaded}, done.message, levels, slips, held=held, own=own)


def _rubbing(scene, settings: Settings, modes: ModalBasis, drive, patch, part) -> dict:
    """Measures of the interface in a Mark of a march."""
    w, omega = part.window, omega_of(drive)
    values = slip_measures(w, drive, settings.steps)
    if not sinusoidal(drive):
        values.pop("slip_start_phase", None)
    values["normal_load"] = patch.pressure.load if patch is not None else scene.normal.load
    weight = np.full(w.time.size, 1.0)
    weight[[0, -1]] = 0.5
    span = w.time[-1] - w.time[0]
    work = part.work  # of all strips; of interfaces only the first, the others have their own
    if len(scene.structure.interface) > 1:
        work = float(part.step_force @ np.diff(w.slide))
    work *= drive.period / span if span > 0 else 0.0
    q = harmonic(w.time, weight, w.slide - w.slide.mean(), omega)
    if whole(span, drive):
        values |= interface_loop(w.slide, q, step_harmonic(w.time, part.step_force, omega), work,
                                 mode_stiffness(scene))
    return values


def created_warning(scene, book: dict, cycles: float) -> list:
    """A sentence for the energy that the printed law made in steps where it gave back more than it had stored."""
    if scene.friction is None or scene.friction.reading != "report":
        return []
    made, work = book.get("created", 0.0), book.get("dissipated", 0.0)
    if made <= 1e-9 * work or made <= 0:
        return []
    return [f"the printed law created {made / cycles:.3g} J per cycle, {100 * made / max(work, 1e-300):.3g} % of what "
            "it dissipated; reading = \"stretch\" creates none"]
