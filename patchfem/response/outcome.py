"""How a coupled run ended: outcome and steady estimate, by what its drive lets settle."""

from dataclasses import replace

from ..core import Measure, Outcome
from ..structure.drive_sizes import sinusoidal
from .measures import classify, steady_amplitude


def settle(raw, measures: dict, tolerance: float, drive, level_cycles: float = 0.0) -> tuple:
    """Outcome of a run, and its measures with the steady estimate where there is one.

    Under a sine, and under levels in their last one, the amplitudes of successive windows decide (`classify`). A
    release or a step is steady once it is at rest: its amplitude below the tolerance of the largest; else the same
    amplitudes decide, but a release never grows. A sweep or a recorded signal changes to the end: unless it leaves the
    interface stuck it is transient, without a steady estimate. level_cycles: of each level, 0 without levels.
    """
    if raw.outcome is not None:
        return raw.outcome, measures
    if not drive.segments:
        return Outcome.TRANSIENT, measures
    amplitudes, last = raw.amplitudes, drive.segments[-1]
    if level_cycles:
        window = max(1, round((raw.window.time[-1] - raw.window.time[0]) / drive.period))
        amplitudes = amplitudes[-max(1, int(level_cycles / window)):]
    if last.amplitude == 0:
        outcome = Outcome.STEADY if amplitudes[-1] <= tolerance * amplitudes.max() else classify(amplitudes, tolerance)
        return (Outcome.TRANSIENT if outcome is Outcome.GROWS and not last.constant else outcome), measures
    outcome = classify(amplitudes, tolerance)
    if outcome is Outcome.GROWS:
        return outcome, {k: replace(m, error=None) for k, m in measures.items()}
    steady, error = raw.steady
    if outcome is Outcome.TRANSIENT and steady is not None:
        base = measures["relative_displacement_amplitude"]
        total = error + (base.error or 0.0) * steady / max(abs(base.value), 1e-300)
        measures = measures | {"relative_displacement_amplitude_steady": Measure(steady, "m", float(total), base.floor)}
    return outcome, measures


def off_the_piece(outcome: Outcome | None, reach: float, length: float) -> Outcome | None:
    """The outcome of a run, or LEAVES_CONTACT where its largest |slide| `reach` [m] passed the length [m] of the piece.

    From that moment on nothing overlaps, so it comes before whatever the run did later: settle, go on growing, or pass
    the stop of the flexure, which would have ended the run before had it stood nearer. A motion that grows without
    having passed the end within the run still `grows`. Only a solve that missed its residual comes first, since its
    slide means nothing.
    """
    return Outcome.LEAVES_CONTACT if reach > length and outcome is not Outcome.NOT_CONVERGED else outcome


def changing_note(outcome: Outcome, drive) -> list:
    """The sentence, in a list, on measures under a drive that changes to the end; an empty list for other drives."""
    if outcome is not Outcome.TRANSIENT or drive.segments:
        return []
    return ["the drive changes to the end, so nothing settles: the measures are those of the last cycles; the whole "
            "motion is in result.nc"]


def steady_of(drive, amplitudes, phasors) -> tuple:
    """Steady amplitude and its error under a drive that ends as a sine, (None, None) under any other.

    A released or struck rig comes to rest, whatever the tail of its amplitudes looks like.
    """
    return steady_amplitude(amplitudes, phasors) if sinusoidal(drive) else (None, None)
