"""The steady motion over grooves: a march that is brought to repeat, and the curve of such motions."""

from dataclasses import replace
from time import perf_counter

import numpy as np

from ....core import NotConverged, Outcome
from ....dynamics.harmonic import orbits
from ....dynamics.march import march as engine
from ....effects import SINE_WAVEFORM
from ....model.rig import DriveLevels
from ....response.measures import peaks_between
from ..interface import contact_of
from ..march import MarchReader
from ..solution import Solution
from .curves import Followed, Shown, curve_point, traced, unlasting

STEPS, MOST = 256, 4096  # of a cycle, at first and at most
EXACT = 1024  # of a law without memory, whose steps their error chooses: samples
LEAD = 30  # cycles within which a lifted mass leaves its grooves, or stays in them
READ = 1e-9  # relative error of a step's end
LOOSE = 1e-6  # change from cycle to cycle, over the size of a motion, up to which it repeats
ROUGH = 1e-2  # change of the multipliers beyond 1 that the steps of a march leave open


def left_grooves(model, numerics, patch, drive, contact) -> Solution | None:
    """The Solution of a motion under the sine `drive` whose lifted mass leaves the grooves within LEAD cycles of a
    march from rest; None where it stays in them, or nothing is lifted.

    contact: its model of grooves. The errors are what half the steps change.
    """
    if not model.grooves.lifted_mass:
        return None
    begin, found = perf_counter(), []
    rig = model.rig.with_signal(drive, levels=DriveLevels(), waveform=SINE_WAVEFORM)
    for steps in (STEPS, STEPS // 2):
        done = engine.march(
            rig.modes, drive, contact, LEAD, steps, 1, rig.springs.travel, whole=False
        )
        if done.outcome is not Outcome.LEAVES_GROOVES:
            return None
        few = replace(numerics, cycles=LEAD, steps=steps, window=1)
        read = MarchReader(replace(model, rig=rig), few, patch, contact)
        found.append(read.solution(done, perf_counter() - begin, None))
    fine, half = (one.values for one in found)
    errors = {
        name: abs(value - half.get(name, 0.0)) + READ * abs(value) for name, value in fine.items()
    }
    return replace(
        found[0], errors=errors, extra={"regime": "leaves its grooves", "multipliers": np.zeros(0)}
    )


class MarchFinder(Followed):
    """Finds the steady motion over grooves by a march that is brought to repeat."""

    tries_another, leaves = True, (0.3, 30.0)  # its points have errors of a tolerance

    def __init__(self, model, numerics, patch, frames: int = 0, say=None):
        self.model, self.patch, self.frames = model, patch, frames
        self.contact = contact_of(model, numerics, patch)
        exact = self.contact.set_valued
        self.steps = model.accuracy.steps_per_cycle or (EXACT if exact else STEPS)
        self.numerics = replace(numerics, cycles=1.0, window=1)
        engine.warm_up(model.rig.modes, model.rig.drive.signal, self.contact, say)

    def _run(self, drive, near, steps: int):
        """A Run that repeats, from the Run `near` as it stands or from rest."""
        run = engine.fresh(
            self.model.rig.modes, drive, self.contact, steps, self.model.rig.springs.travel
        )
        if near is not None:
            run.contact = type(near.contact)(*(array.copy() for array in near.contact))
            run.state[:] = near.state
            run.placed(*near.state)
        left = orbits.settled(run)
        if run.outcome is not None and run.outcome is not Outcome.EXCEEDS_TRAVEL:
            raise NotConverged(run.message)
        if run.outcome is None and left > LOOSE:
            raise NotConverged(
                f"no periodic motion was found within {orbits.MOST} cycles: "
                f"the motion still changes by {left:.2g} of its amplitude from one cycle to the next; "
                'use accuracy.method = "march"'
            )
        return run, left

    def _read(self, run, steps: int, frames: int = 0) -> tuple:
        """(measures by name, Mark of a cycle, snapshots, whether it sticks)."""
        mark, snapshots = orbits.shown(run, frames)
        read = MarchReader(
            self.model, replace(self.numerics, steps=steps), self.patch, self.contact
        )
        stuck = bool(np.ptp(mark.window.slip) <= read.held) and not read.creeps
        values = read.values(mark, run.drive, stuck)
        return values | {"drift_per_cycle": 0.0}, mark, snapshots, stuck

    def point(self, drive, near=None) -> tuple:
        """As of `_point`; a motion that leaves its grooves instead, without a Run."""
        try:
            return self._point(drive, near)
        except NotConverged:
            if (
                gone := left_grooves(self.model, self.numerics, self.patch, drive, self.contact)
            ) is None:
                raise
        return gone, None

    def _point(self, drive, near) -> tuple:
        """The steady motion as a cycle of it, and the Run that goes on in it; steps are doubled until half of them
        change its amplitude by less than the tolerance, which is the error of every measure."""
        begin, name = perf_counter(), "relative_displacement_amplitude"
        run, left = self._run(drive, near, self.steps)
        half = self._read(self._run(drive, run, self.steps // 2)[0], self.steps // 2)[0]
        steps, read = self.steps, self._read(run, self.steps, self.frames)
        while self._rough(read[0][name], half[name]) and run.outcome is None:
            if 2 * steps > MOST or self.model.accuracy.steps_per_cycle is not None:
                break
            steps, half = 2 * steps, read[0]
            run, left = self._run(drive, run, steps)
            read = self._read(run, steps, self.frames)
        values, mark, snapshots, stuck = read
        between = peaks_between(mark.window, True)
        found = orbits.multipliers(run) if run.outcome is None else np.zeros(0)
        regime = "stuck" if stuck else "stick-slip" if values.get("stick_fraction") else "sliding"
        outcome, message = run.outcome or (Outcome.STUCK if stuck else Outcome.STEADY), run.message
        if not stuck and np.abs(found).max(initial=0.0) > 1 + ROUGH:
            outcome, message, regime = (
                Outcome.NOT_CONVERGED,
                unlasting(found),
                f"{regime}, unstable",
            )
        errors = {
            key: abs(v - half.get(key, v)) + abs(v) * (left + READ) + between.get(key, 0.0)
            for key, v in values.items()
            if v is not None
        }
        if "slip_start_phase" in errors:
            errors["slip_start_phase"] = (
                min(errors["slip_start_phase"], np.pi / 2) + 2 * np.pi / steps
            )
        extra = {
            "regime": regime,
            "multipliers": found,
            "residual": left,
            "map": "march",
            "steps_per_cycle": steps,
        }
        return Solution(
            values,
            mark.window,
            mark.window,
            np.array([values[name]]),
            (None, None),
            outcome,
            snapshots,
            mark.ledger,
            perf_counter() - begin,
            self.contact,
            message=message,
            errors=errors,
            extra=extra,
        ), run

    def _rough(self, value: float, half: float) -> bool:
        return abs(value - half) > self.model.accuracy.tolerance * abs(value)

    def shown(self, drive, near=None) -> Shown:
        """A point of a curve."""
        try:
            return curve_point(drive, *self.point(drive, near))
        except NotConverged:
            if near is None:
                raise
        return curve_point(drive, *self.point(drive))

    def curve(self, drive) -> tuple:
        """(points of the curve over the frequency, each found from the one before it, no folds)."""
        return traced(self.model.rig.modes, drive, self.shown), ()
