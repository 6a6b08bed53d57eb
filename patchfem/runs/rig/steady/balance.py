"""The steady motion of laws with memory and of springs that bend, by harmonic balance; its curve through folds."""

from dataclasses import replace
from time import perf_counter

import numpy as np

from ....compiled import load
from ....core import BaseSine, NotConverged, Outcome, Start, say
from ....dynamics.harmonic import branch as branches
from ....dynamics.harmonic.balance import cycle_energy, periodic_response
from ....dynamics.harmonic.balance import regime as balanced_regime
from ....dynamics.harmonic.forces import Group
from ....dynamics.harmonic.harmonic import pack
from ....dynamics.harmonic.laws import Interlock, Spring, analysis
from ....dynamics.harmonic.point import balance_of
from ....dynamics.harmonic.point import point as periodic_point
from ....dynamics.harmonic.stability import with_stability
from ....dynamics.integrated import Integrated, Run
from ....dynamics.march.march import march
from ....response.measures import acceleration_peak
from ....response.spectrum import odd_harmonics, wave_measures
from ..interface import contact_model, flank_of, model_of
from ..reading import Reader, books_of
from ..solution import Solution, sampled_loop
from .curves import LAST, SHOWN, Shown, unlasting
from .marched import disturbed, lasts, left_grooves

ADRIFT = ("the steady motion that the balance found over the grooves does not last: another one is reached from rest; "
          'use accuracy.method = "march"')
CYCLES, STEPS, FEW = 30, 256, 31  # of the march that a balance over grooves starts from, and its harmonics
SAMPLES = 4096  # of the cycle that measures are read off
BESIDE = 2  # points on either side of one of a curve, whose changes count for it
OF_HALF = 0.7  # of the change by half the harmonics and samples: seen at 350 points of elastic-plastic elements, whose
# motion is known exactly, 0.1 of it is left on the mean and 0.55 at most


class Balanced(Reader):
    """What one cycle of a balance shows."""

    def integrated(self, run, drive) -> Integrated:
        """The two books of friction work; the middle of a motion that repeats stays."""
        return Integrated(drift=0.0, books=books_of(run.response, run.ledger["friction"]))

    def more(self, run, drive, stuck: bool) -> dict:
        """The loop of a cycle by the trapezoidal rule."""
        return {"loop": sampled_loop(run.window, drive, run.ledger["friction"])}


class Balance:
    """Laws with memory and springs that bend, by harmonic balance."""

    tries_another = False

    def __init__(self, model, numerics, patch, frames: int = 0, say=None):
        load("dynamics.harmonic.cycle_kernels", say)
        rig = model.rig
        parts = []
        if model.friction is not None:
            parts.append((0, flank_of(model, patch) if model.grooves is not None else
                          contact_model(model, numerics, patch)))
        if rig.interlock is not None:
            parts.append((0, Interlock(*rig.interlock)))
        if rig.cubic is not None:
            parts.append((rig.modes.output, Spring(0.0, rig.cubic)))
        self.model, self.modes, self.patch, self.harmonics = model, rig.modes, patch, model.accuracy.harmonics
        self.numerics = numerics
        self.group, self.tolerance = Group(rig.modes, parts), model.accuracy.tolerance
        self.climbing = model_of(model, numerics, patch) if model.grooves is not None else None

    def _near(self, drive, near):
        """A start: the Periodic `near`; over grooves, where there are several motions, the unknowns of the last cycle
        of a short march from rest; else None."""
        if near is not None or self.climbing is None:
            return near
        done = march(self.modes, drive, self.climbing, CYCLES, STEPS, 1, whole=False)
        if done.outcome is not None:
            raise NotConverged(done.message)
        slides = analysis(done.window.slide[None, -STEPS - 1:-1], FEW)
        balance = balance_of(self.modes, self.group, 0)
        held = sum(1 if k == 0 else 2 for k, *_ in balance.plant(drive.omega, FEW).free)
        return np.concatenate([pack(balance.lift.T @ slides), np.zeros(held)])

    def point(self, drive, near=None) -> tuple:
        """The steady motion, from the point `near` of a curve where there are several, its measures read off one cycle,
        and its Periodic; errors from half the harmonics, twice as many over grooves, and the balance's own."""
        begin = perf_counter()
        try:
            near = self._near(drive, near)
        except NotConverged:
            if (gone := self._left(drive)) is None:
                raise
            return gone, None
        found = periodic_point(self.modes, drive, self.group, self.harmonics, self.tolerance, start=near)
        others = 2 * found.harmonics if self.climbing is not None else max(1, found.harmonics // 2)
        other = periodic_point(self.modes, drive, self.group, others, self.tolerance,
                               start=found if near is not None else None)
        stable, notes = self._judged(found, drive), ()
        if self.climbing is None and not stable.stable:
            found, stable, other, notes = self._lasting(drive, found, stable, other)
        values, response, book = self._measured(found, drive)
        rough = self._measured(other, drive)[0]
        # the higher harmonics follow those of `found`, not those of half as many: measured, 20 times less is left out
        share = 1.0 if self.climbing is not None else 0.1
        errors = {name: share * abs(v - rough.get(name, v)) + abs(v) * min(found.error, 1.0)
                  for name, v in values.items()}
        if "slip_start_phase" in errors:
            errors["slip_start_phase"] = min(errors["slip_start_phase"], np.pi / 2) + 2 * np.pi / SAMPLES
            errors["stick_fraction"] = errors.get("stick_fraction", 0.0) + 4 / SAMPLES
        name, _ = balanced_regime(found)
        held = name == "stuck"
        extra = {"regime": name if stable.stable else f"{name}, unstable", "multipliers": stable.multipliers,
                 "residual": found.residual, "harmonics": found.harmonics}
        amplitude = np.array([values["relative_displacement_amplitude"]])
        outcome, message = Outcome.STUCK if held else Outcome.STEADY, ""
        grooves, load = self.model.grooves, response.extra.get("normal_load")
        if grooves is not None and not stable.stable:
            outcome, message = Outcome.NOT_CONVERGED, ADRIFT
        elif not stable.stable:
            outcome, message = Outcome.NOT_CONVERGED, unlasting(stable.multipliers)
        if load is not None and load.min() <= 0:
            from ....dynamics.grooves.run import lifts

            if (gone := self._left(drive, Start(response.modal[0], response.modal_rate[0]))) is not None:
                return gone, None
            outcome, message = Outcome.NOT_CONVERGED, lifts(grooves, response.time[int(np.argmin(load))])
        return Solution(values, response, response, amplitude, (None, None), outcome, [], book, perf_counter() - begin,
                        message=message, errors=errors, extra=extra, notes=notes), found

    def _left(self, drive, start=None) -> Solution | None:
        """As of `left_grooves`."""
        return left_grooves(self.model, self.numerics, self.patch, drive, self.climbing, start)

    def _lasting(self, drive, found, stable, other) -> tuple:
        """In place of a Periodic that does not last the smallest one under the same drive that does, with its
        multipliers and with half its harmonics, and a note on it; what is given, where none is found."""
        every = branches.branches(self.modes, drive, self.group, self.tolerance)
        lasts = [one for one in every if one.stable]
        if not lasts:
            return found, stable, other, ()
        found = periodic_point(self.modes, drive, self.group, self.harmonics, self.tolerance, start=lasts[0])
        half = max(1, found.harmonics // 2)
        other = periodic_point(self.modes, drive, self.group, half, self.tolerance, start=found)
        sizes = ", ".join(say(one.amplitude(self.modes.output), 3) for one in every)
        note = f"at this drive {len(every)} steady motions balance ({sizes}), {len(lasts)} of which last" + (
            "" if len(lasts) == 1 else "; the smallest of these is shown, accuracy.method = \"march\" tells which one "
            "is reached from rest")
        return found, with_stability(found, self.modes), other, (note,)

    def shown(self, drive, near=None) -> Shown:
        """A point of a curve, its errors unknown."""
        found = periodic_point(self.modes, drive, self.group, self.harmonics, self.tolerance,
                               start=self._near(drive, near))
        return self._shown(self._judged(found, drive))

    def _judged(self, found, drive):
        """The Periodic with its multipliers; over grooves those of a march that begins in it, which leaves nothing of
        the changing normal force out."""
        if self.climbing is None:
            return with_stability(found, self.modes)
        sine = BaseSine(found.level, found.omega, drive.moving)
        there = disturbed(self.modes, sine, self.climbing, found.modal)
        return replace(found, multipliers=there, stable=lasts(there))

    def _shown(self, found) -> Shown:
        """What a Periodic with its multipliers shows."""
        kind, stable = balanced_regime(found)[0], bool(found.stable)
        drive = BaseSine(found.level, found.omega, self.model.rig.drive.moving)
        return Shown(drive, self._read(found, drive), {}, kind if stable else f"{kind}, unstable",
                     float(np.abs(found.multipliers).max(initial=0.0)), stable,
                     Outcome.STUCK if kind == "stuck" else Outcome.STEADY, found)

    def _read(self, found, drive) -> dict:
        """The measures that a curve shows, by name."""
        response = self._response(found, drive)
        row = self.modes.output if self.modes.gauge is None else self.modes.gauge
        values = {SHOWN["amplitude"]: found.amplitude(row), SHOWN["acceleration_peak"]: acceleration_peak(response),
                  **wave_measures(*odd_harmonics(response, drive))}
        return {name: value for name, value in values.items() if value is not None}

    def _response(self, found, drive):
        """One cycle of a Periodic as histories."""
        return periodic_response(found, self.modes, drive, SAMPLES)

    def _measured(self, found, drive) -> tuple:
        response = self._response(found, drive)
        book = cycle_energy(found, self.modes) | {"stored": 0.0, "iterations": float(found.iterations)}
        speed = np.arange(len(found.modal))[:, None] * found.omega * np.abs(found.modal)
        book |= {"power": abs(book["work_in"]), "peak_stored": self.modes.mass / 2 * float(np.sum(speed**2))}
        top = found.amplitude(self.modes.output)
        middle = (response.output.max() + response.output.min()) / 2
        extremes = np.array([[middle - top, middle + top]])
        run = Run(response, response, extremes, np.zeros(1), book)
        return Balanced(self.model, self.numerics, self.patch, steps=SAMPLES).values(run, drive), response, book

    def curve(self, drive) -> tuple:
        """(points of the curve over the frequency through its folds, the frequencies [Hz] of these)."""
        first = BaseSine(drive.acceleration, 2 * np.pi * drive.low, drive.moving)
        branch = branches.response(self.modes, first, self.group, (drive.low, drive.high), self.harmonics,
                                   self.tolerance, True)
        found = branch.points if self.climbing is None else [self._judged(one, first) for one in branch.points]
        points = [self._shown(one)._replace(regime="stable" if one.stable else "unstable") for one in found]
        return self._with_errors(points), branch.folds

    def _with_errors(self, points) -> list:
        """Points along a curve with errors: a share of what half the harmonics and samples change, there or at points
        beside it, as a change that passes zero tells nothing; and what the balance itself leaves open."""
        changes = {name: np.zeros(len(points)) for name in SHOWN.values()}
        for k, one in enumerate(points):
            half = self.group.with_samples(one.near.base_samples // 2)
            try:
                fewer = periodic_point(self.modes, one.drive, half, max(1, one.near.harmonics // 2), self.tolerance,
                                       start=one.near)
                rough = self._read(fewer, one.drive)
            except NotConverged:
                rough = {}  # then nothing is known of it
            for name, value in one.values.items():
                changes[name][k] = abs(value - rough.get(name, 0.0))
        out, reach = [], BESIDE + 1
        for k, one in enumerate(points):
            size = {name: float(changes[name][max(k - BESIDE, 0):k + reach].max()) for name in one.values}
            errors = {name: OF_HALF * size[name] + abs(value) * (min(one.near.error, 1.0) + LAST)
                      + LAST * (name == "acceleration_distortion") for name, value in one.values.items()}
            out.append(one._replace(errors=errors))
        return out
