"""The exact engine of a rig: Coulomb friction from event to event, one mode under sines by its own fast engine."""

from dataclasses import replace
from time import perf_counter

import numpy as np

from ...core import BaseSine, Outcome, Start
from ...dynamics.events.histories import simulate
from ...dynamics.one_mode import sdof
from ...dynamics.second_book import gap, sampled_work
from ...effects import has
from ...response import run_events
from ...response.events import stuck_time
from ...response.levels import KEPT, Level
from ...response.measures import circular_mean, harmonic, swing, window_amplitudes, window_ends
from ...response.outcome import steady_of
from ...response.rows import measures_of
from ...response.spectrum import wave_measures
from ...structure.drive_sizes import largest, omega_of, sinusoidal, whole
from ..bench.averaged import limit_share
from .solution import Solution, borne, seen
from .strips import as_one, strip_loads


def run_exact(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """Solution of a Coulomb rig, or of a structure without friction.

    patch: the solved Patch, or None under [normal] or between masses.
    """
    rig, drive, modes = model.rig, model.rig.drive, model.rig.modes
    begin, forces = perf_counter(), forces_of(model, patch)
    if rig.levels:
        done, levels, probe = _levels(model, numerics, patch, forces, progress, say)
    else:
        done = _go(rig, drive, forces, numerics.cycles, numerics.window, rig.start, progress, say)
        levels, probe = (), None
        done = whole_cycles(_over_strips(done, patch) if rig.strips_slide_apart else done)
    values, stuck = _values(model, numerics, patch, drive, done)
    rubs = model.friction is not None
    rings, own = run_events.rings(done.window, modes, drive, done.log) if rubs else ({}, {})
    values |= rings
    own |= _of_means(done, modes, drive, rig.strips_slide_apart)
    outcome = done.outcome or (Outcome.STUCK if stuck else None)
    ends = window_ends(done.amplitudes, done.phasors, numerics.window)
    return Solution(values, done.response, done.window, window_amplitudes(done.amplitudes, numerics.window),
               steady_of(drive, *ends), outcome, [], done.ledger, perf_counter() - begin,
               levels=levels, probe=probe, log=done.log, own=own, extremes=done.amplitudes)


def forces_of(model, patch) -> tuple:
    """Static and kinetic friction [N] of every interface, (i,) each."""
    rig, share = model.rig, 1.0
    if rig.strips_slide_apart:
        return tuple(np.array(column) for column in zip(*(model.limits(n) for n in strip_loads(patch))))
    if model.friction is None:
        return (np.zeros(len(rig.modes.interfaces)),) * 2
    if rig.names:
        pairs = [one.limits(one.load) for one in rig.interfaces]
    else:
        if has(model.friction.law, "averaged"):
            share = limit_share(model, patch)
        static, kinetic = model.limits(borne(model, patch))
        pairs = [(static * share, kinetic if model.friction.kinetic is not None else static * share)]
    return tuple(np.array(column) for column in zip(*pairs))


def _over_strips(done, patch):
    """A run of strips as a run of the patch: loops from the samples of the window and from both sides of every
    event."""
    loads, offsets = strip_loads(patch), patch.strips.offsets
    window = as_one(done.window, loads, offsets)
    gaps = np.diff(window.time)
    weight = np.concatenate([[0.0], gaps / 2]) + np.concatenate([gaps / 2, [0.0]])
    held = ~window.extra["slide_rates"].any(axis=1)
    return replace(done, response=as_one(done.response, loads, offsets), window=window, stick=float(weight[held].sum()),
                   loop=(window.time, weight, window.slide, window.slide_rate, window.force))


def _go(rig, drive, forces, cycles: float, window: int, start, progress, say):
    modes, travel = rig.modes, rig.travel
    if modes.omega.size == 1 and len(modes.interfaces) == 1 and drive.segments:
        fast = cycles > sdof.COMPILED_FROM
        if fast:
            sdof.kernels(True, say)
        return sdof.simulate(modes, drive, float(forces[0][0]), float(forces[1][0]), cycles, window, travel, progress,
                             start, fast)

    return simulate(modes, drive, *forces, cycles, window, travel, progress, start)


def _values(model, numerics, patch, drive, done) -> tuple:
    """Measures of the window of an event-driven run, and whether nothing slipped.

    What the events tell comes before what the samples tell.
    """
    window, apart, known = done.window, model.rig.strips_slide_apart, {}
    extremes, ledger, loop = done.amplitudes[-min(numerics.window, len(done.amplitudes)):], None, None
    span = window.time[-1] - window.time[0]
    if done.acceleration is not None:
        known["absolute_acceleration_peak"] = done.acceleration
    if abs(done.cycles_done - round(done.cycles_done)) > 1e-9:  # the cycles are counted from the start
        known["relative_displacement_amplitude"] = swing(window)
    if done.waves is not None and sinusoidal(drive) and whole(span, drive):
        known |= wave_measures(*np.abs(done.waves), largest(drive))
    cycles, holds = span / drive.period, done.stick >= span * (1 - 1e-12)
    if done.means is not None and not apart and cycles >= 1.5:
        known["drift_per_cycle"] = (done.means[1] - done.means[0]) / (cycles - 1)
    if model.friction is not None:
        lost, starts = done.ledger["friction"], done.starts
        ledger = np.array([[lost], [0.0], [lost], [0.0]])
        known |= {"slip_amplitude": float(window.slip.max() - window.slip.min()) / 2,
                  "stick_fraction": 1.0 if holds else done.stick / span,
                  "slip_start_phase": circular_mean(starts) if starts.size and sinusoidal(drive) else None}
        loop = _loop(done, drive, span, apart)
        if not apart:  # the loop of strips is that of their samples
            known["work_check"] = _work_check(done)
    if model.friction is not None and not apart:
        known |= _of_others(window, done)
    values = measures_of(seen(model, patch, window, extremes, done.ledger, 400, drive=drive, loop=loop, ledger=ledger,
                              known=known, by="jumps", together=apart))
    if model.friction is None:
        return values, False
    others = any(run_events.moving(window, drive, done.log)[1:])
    return values, holds and not others


def _of_others(window, done) -> dict:
    """What the events tell of all interfaces: largest forces, and of those after the first the share of the time for
    which they stick."""
    out = {f"friction_force_peak{f'_{k + 1}' * (k > 0)}": float(f) for k, f in enumerate(done.force_peaks)}
    begin, end, events = window.time[0], window.time[-1], run_events.of_log(done.log)
    for k, slip in enumerate(run_events.slips_of(window)[0].T[1:], 2):
        held = stuck_time(events, k, begin, end, bool(np.ptp(slip)))
        out[f"stick_fraction_{k}"] = min(held / (end - begin), 1.0)
    return out


def _work_check(done) -> float:
    """Gap [1] of the friction work of the first interface in the window: by the trapezoidal rule on its samples, both
    sides of every jump among them, against the quadrature of the pieces between events."""
    window, (_, weight, _, rate, force) = done.window, done.loop
    power, energy = weight * force * rate, done.ledger["power"] + done.ledger["peak_stored"]
    sampled = sampled_work(window.slide, window.force).sum()
    return gap(float(sampled), float(power.sum()), float(np.abs(power).sum()), energy)


def _of_means(done, modes, drive, apart: bool) -> dict:
    """Error of the drift by its name, beside what all measures have: the round-off of its two means, which cancel.

    {} in a window below 1.5 cycles, which has ends alone. Where a run ends inside a cycle, and of strips, the means are
    those of cubics through 400 samples a cycle, which miss h^4/384 of the fourth derivative: seen against 8000 a cycle,
    2e-14 of the range, as the cycles miss nearly alike. What jumps excite in a mode r times as fast as the drive falls
    with 1/r^2, its fourth derivative grows with r^2.
    """
    window = done.window
    if window.time[-1] - window.time[0] < 1.5 * drive.period:
        return {}
    if done.means is not None and not apart:
        return {"drift_per_cycle": 1e-14 * float(np.abs(window.slide).max(initial=0.0))}
    faster = max(1.0, float(modes.omega.max()) / omega_of(drive))**2
    return {"drift_per_cycle": 1e-13 * faster * float(np.ptp(window.slide))}


def _loop(done, drive, span: float, apart: bool) -> tuple | None:
    """Loop of a run by its own quadrature: (first harmonics of slide and force, work per cycle [J]).

    None where the window holds no whole cycle. apart: loops of every strip, because a yaw works besides the mean slide.
    """
    if not whole(span, drive):
        return None
    time, weight, slide, rate, force = done.loop
    power = force * rate
    if apart:
        power = (done.window.extra["forces"] * done.window.extra["slide_rates"]).sum(axis=1)
    omega, work = omega_of(drive), float(weight @ power) * drive.period / span
    q, part = (harmonic(time, weight, column, omega) for column in (slide - weight @ slide / span, force))
    return q, part, work


def whole_cycles(done):
    """The run without the extremes and the phasor of a last cycle that is cut short."""
    count = int(done.cycles_done + 1e-9)
    if not count or count >= len(done.amplitudes):
        return done
    return replace(done, amplitudes=done.amplitudes[:count], phasors=done.phasors[:count])


def _levels(model, numerics, patch, forces, progress, say) -> tuple:
    """Run of all levels one after the other: (EventRun, its Levels, probe as `levels.onset` asks)."""
    rig = model.rig
    drive, cycles, states, parts, levels = rig.drive, rig.level_cycles, [rig.start], [], []

    def go(level, state, watch=None):
        sine = BaseSine(level, omega_of(drive), drive.moving)
        return _go(rig, sine, forces, cycles, numerics.window, state, watch, say), sine

    for k, level in enumerate(rig.levels):
        share = None if progress is None else (lambda part, k=k: progress((k + part) / len(rig.levels)))
        done, sine = go(level, states[-1], share)
        levels.append(_level(model, numerics, patch, level, sine, done))
        parts.append(done)
        states.append(Start(done.response.modal[-1], done.response.modal_rate[-1]))
        if done.outcome is not None:
            break

    def probe(number, level):
        return _level(model, numerics, patch, level, *go(level, states[number + 1])[::-1])

    return joined_runs(parts, cycles * drive.period), tuple(levels), probe


def _level(model, numerics, patch, level: float, drive, done) -> Level:
    """The Level of a run at one level [m s-2] of the drive."""
    values, stuck = _values(model, numerics, patch, drive, done)
    kept = {name: values[name] for name in KEPT if name in values}
    read = _of_means(done, model.rig.modes, drive, model.rig.strips_slide_apart)
    return Level(level, stuck, kept, {name: 1e-9 * abs(value) + read.get(name, 0.0) for name, value in kept.items()})


def joined_runs(parts, each: float):
    """Runs of `each` [s] one after the other as one EventRun or PieceRun; its window and loop are those of the last."""
    shift = [k * each for k in range(len(parts))]
    last, rows = parts[-1], [slice(None, -1)] * (len(parts) - 1) + [slice(None)]  # where one ends the next begins

    def column(of):
        return np.concatenate([of(p)[part] for p, part in zip(parts, rows)])

    columns = {name: column(lambda p, name=name: getattr(p.response, name))
               for name in type(last.response).__dataclass_fields__ if name not in ("time", "extra")}
    time = np.concatenate([_later(p.response.time, t)[part] for p, part, t in zip(parts, rows, shift)])
    extra = {name: column(lambda p, name=name: p.response.extra[name]) for name in last.response.extra
             if name != "ledger"}
    if "ledger" in last.response.extra:
        extra["ledger"] = column(lambda p: p.response.extra["ledger"].T).T
    response = replace(last.response, time=time, extra=extra, **columns)
    window = replace(last.window, time=_later(last.window.time, shift[-1]))
    ledger = {name: sum(p.ledger[name] for p in parts) for name in last.ledger}
    ledger["peak_stored"] = max(p.ledger["peak_stored"] for p in parts)
    return replace(last, response=response, window=window, ledger=ledger,
                   log=run_events.joined_logs([p.log for p in parts], shift),
                   amplitudes=np.concatenate([p.amplitudes for p in parts]),
                   phasors=np.concatenate([p.phasors for p in parts]), events=sum(p.events for p in parts))


def _later(time, shift: float):
    """Times moved by `shift` [s], the two sides of an event still apart."""
    moved = time + shift
    before = np.flatnonzero(moved[1:] <= moved[:-1])
    moved[before] = np.nextafter(moved[before], -np.inf)
    return moved
