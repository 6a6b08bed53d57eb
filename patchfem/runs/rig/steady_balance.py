"""The steady motion of laws with memory and of springs that bend, by harmonic balance; its curve through folds."""

from dataclasses import replace
from time import perf_counter

import numpy as np

from ...compiled import load
from ...core import BaseSine, NotConverged, Outcome
from ...dynamics.harmonic import branch as branches
from ...dynamics.harmonic.balance import cycle_energy, periodic_response, regime
from ...dynamics.harmonic.forces import Group
from ...dynamics.harmonic.harmonic import pack
from ...dynamics.harmonic.laws import Interlock, Spring, analysis
from ...dynamics.harmonic.point import balance_of
from ...dynamics.harmonic.point import point as periodic_point
from ...dynamics.harmonic.stability import with_stability
from ...dynamics.march.march import march
from ...dynamics.second_book import gap, sampled_work
from ...response.rows import measures_of
from .interface import contact_model, flank_of, model_of
from .solution import Solution, sampled_loop, seen
from .strips import other_measures

ADRIFT = ("the steady motion that the balance found over the grooves does not last: another one is reached from rest; "
          'use accuracy.method = "march"')
CYCLES, STEPS, FEW = 30, 256, 31  # of the march that a balance over grooves starts from, and its harmonics
SAMPLES = 1024  # of the cycle that measures are read off


class Balance:
    """Laws with memory and springs that bend, by harmonic balance."""

    def __init__(self, model, numerics, patch, say):
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
        self.group, self.tolerance = Group(rig.modes, parts), model.accuracy.tolerance
        self.climbing = model_of(model, numerics, patch) if model.grooves is not None else None

    def _from_rest(self, drive) -> np.ndarray:
        """Unknowns of a start: the last cycle of a short march from rest, as over grooves there are several motions."""
        done = march(self.modes, drive, self.climbing, CYCLES, STEPS, 1, whole=False)
        if done.outcome is not None:
            raise NotConverged(done.message)
        slides = analysis(done.window.slide[None, -STEPS - 1:-1], FEW)
        balance = balance_of(self.modes, self.group, 0)
        held = sum(1 if k == 0 else 2 for k, *_ in balance.plant(drive.omega, FEW).free)
        return np.concatenate([pack(balance.lift.T @ slides), np.zeros(held)])

    def point(self, drive, near=None) -> tuple:
        """The steady motion, from the point `near` of a curve where there are several, its measures read off one cycle;
        errors from half the harmonics, twice as many over grooves, and the balance's own."""
        begin = perf_counter()
        near = near if near is not None or self.climbing is None else self._from_rest(drive)
        found = periodic_point(self.modes, drive, self.group, self.harmonics, self.tolerance, start=near)
        others = 2 * found.harmonics if self.climbing is not None else max(1, found.harmonics // 2)
        other = periodic_point(self.modes, drive, self.group, others, self.tolerance,
                               start=found if near is not None else None)
        stable = with_stability(found, self.modes)
        values, response, book = self._measured(found, drive)
        rough = self._measured(other, drive)[0]
        # the higher harmonics follow those of `found`, not those of half as many: measured, 20 times less is left out
        share = 1.0 if self.climbing is not None else 0.1
        errors = {name: share * abs(v - rough.get(name, v)) + abs(v) * min(found.error, 1.0)
                  for name, v in values.items()}
        if "slip_start_phase" in errors:
            errors["slip_start_phase"] = min(errors["slip_start_phase"], np.pi / 2) + 2 * np.pi / SAMPLES
            errors["stick_fraction"] = errors.get("stick_fraction", 0.0) + 4 / SAMPLES
        name, _ = regime(found)
        held = name == "stuck"
        extra = {"regime": name if stable.stable else f"{name}, unstable", "multipliers": stable.multipliers,
                 "residual": found.residual, "harmonics": found.harmonics}
        amplitude = np.array([values["relative_displacement_amplitude"]])
        outcome, message = Outcome.STUCK if held else Outcome.STEADY, ""
        grooves, load = self.model.grooves, response.extra.get("normal_load")
        if grooves is not None and not stable.stable:
            outcome, message = Outcome.NOT_CONVERGED, ADRIFT
        if load is not None and load.min() <= 0:
            from ...dynamics.grooves.run import lifts

            outcome, message = Outcome.NOT_CONVERGED, lifts(grooves, response.time[int(np.argmin(load))])
        raw = Solution(values, response, response, amplitude, (None, None), outcome, [], book, perf_counter() - begin,
                       message=message)
        return raw, errors, extra

    def _measured(self, found, drive) -> tuple:
        response = periodic_response(found, self.modes, drive, SAMPLES)
        if not drive.moving:
            response = replace(response, base_acceleration=0 * response.base_acceleration)
        book = cycle_energy(found, self.modes) | {"stored": 0.0, "iterations": float(found.iterations)}
        speed = np.arange(len(found.modal))[:, None] * found.omega * np.abs(found.modal)
        book |= {"power": abs(book["work_in"]), "peak_stored": self.modes.mass / 2 * float(np.sum(speed**2))}
        top = found.amplitude(self.modes.output)
        middle = (response.output.max() + response.output.min()) / 2
        extremes = np.array([[middle - top, middle + top]])
        known = {"drift_per_cycle": 0.0}
        if self.model.friction is not None:
            parts = sampled_work(response.slide, response.force)
            energy = book["power"] + book["peak_stored"]
            known["work_check"] = gap(float(parts.sum()), book["friction"], float(np.abs(parts).sum()), energy)
        values = measures_of(seen(self.model, self.patch, response, extremes, book, SAMPLES, drive=drive, known=known,
                                  loop=sampled_loop(response, drive, book["friction"])))
        if self.model.friction is not None:
            values |= other_measures(response, drive, SAMPLES)
        return values, response, book

    def curve(self, drive) -> tuple:
        """(curve as arrays by name through its folds, the sine of its largest amplitude, the point there)."""
        if hasattr(drive, "low"):
            first = BaseSine(drive.acceleration, 2 * np.pi * drive.low, drive.moving)
            branch = branches.response(self.modes, first, self.group, (drive.low, drive.high), self.harmonics,
                              self.tolerance, True)
        else:
            sizes = [s.amplitude for s in drive.segments]
            first = BaseSine(sizes[0], drive.segments[0].omega, drive.moving)
            branch = branches.levels(self.modes, first, self.group, sizes if len(sizes) != 2 else
                                     [sizes[0], np.mean(sizes), sizes[1]], self.harmonics, self.tolerance, True)
        amplitude = branch.amplitudes(self.modes.output)
        curve = {"frequency": np.array([p.omega / (2 * np.pi) for p in branch.points]),
                 "level": np.array([p.level for p in branch.points]), "amplitude": amplitude,
                 "regime": np.array(["stable" if p.stable else "unstable" for p in branch.points]),
                 "multiplier": np.array([np.abs(p.multipliers).max(initial=0.0) for p in branch.points]),
                 "folds": np.array(branch.folds)}
        best = branch.points[int(np.argmax(amplitude))]
        return curve, BaseSine(best.level, best.omega, drive.moving), best
