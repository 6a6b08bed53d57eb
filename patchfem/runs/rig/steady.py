"""The engine `harmonic`: the steady motion of a scene found directly, and its curve over frequency or level.

Coulomb interfaces by shooting on the map of their events, other laws by harmonic balance. What is found is a motion
that repeats with the drive; its regime, multipliers and stability are named.
"""

from dataclasses import replace
from time import perf_counter

import numpy as np

from ...core import BaseSine, Outcome, PatchfemError
from ...response.rows import measures_of
from .engines import no_closed_form
from .solution import Solution, sampled_loop, seen
from .strips import other_measures

SAMPLES = 1024  # of the cycle that measures are read off
POINTS = 121  # of a curve by the event map


def run_steady(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """The steady motion at a sine, or the largest on a curve over a sweep or over levels, whose sine is extra["at"]."""
    drive = model.rig.drive
    sine = drive if isinstance(drive, BaseSine) else None
    exact = model.friction is None or not no_closed_form(model, steady=True)
    finder = (_Events if exact else _Balance)(model, numerics, patch, say)
    if sine is not None:
        raw, errors, extra = finder.point(sine)
        return replace(raw, errors=errors, extra=extra)
    curve, best, near = finder.curve(drive)
    raw, errors, extra = finder.point(best, near)
    return replace(raw, errors=errors, extra=extra | {"curve": curve, "at": best})


def drives_of(drive, count: int) -> list:
    """Sines of a curve: over a sweep `count` frequencies from end to end, over levels each of them."""
    if hasattr(drive, "low"):
        space = np.geomspace if drive.logarithmic else np.linspace
        return [BaseSine(drive.acceleration, 2 * np.pi * f, drive.moving) for f in space(drive.low, drive.high, count)]
    return [BaseSine(s.amplitude, s.omega, drive.moving) for s in drive.segments]


class _Events:
    """Coulomb interfaces, or none at all, by the event map."""

    def __init__(self, model, numerics, patch, say):
        from .exact import forces_of

        self.model, self.numerics, self.modes, self.patch, self.say = model, numerics, model.rig.modes, patch, say
        self.forces = forces_of(model, patch)

    def found(self, drive, start=None):
        """Steady motion by shooting, from `start` on."""
        from ...dynamics.events.steady_events import steady

        return steady(self.modes, drive, *self.forces, start=start)

    def point(self, drive, near=None) -> tuple:
        """The steady motion, found from the start `near`, as a run of the exact engine that begins in it."""
        from .exact import run_exact

        begin = perf_counter()
        found = self.found(drive, near)
        few = replace(self.numerics, cycles=2.0, window=1)
        here = replace(self.model.rig, drive=drive, start=found.start, levels=())
        raw = run_exact(replace(self.model, rig=here), few, self.patch)
        outcome = {"unbounded": Outcome.GROWS, "stuck": Outcome.STUCK}.get(found.regime, Outcome.STEADY)
        extra = {"regime": found.regime, "multipliers": found.multipliers, "residual": found.residual}
        raw = replace(raw, outcome=outcome, book=raw.book | {"iterations": 0.0}, seconds=perf_counter() - begin)
        return raw, {name: abs(v) * (1e-9 + found.residual) for name, v in raw.values.items()}, extra

    def curve(self, drive) -> tuple:
        """Curve as arrays by name, and the sine of its largest amplitude; None: the motion there is the only one."""
        drives = drives_of(drive, POINTS)
        if self.modes.omega.size == 1 and len(self.modes.interfaces) == 1:
            curve = self._single(drives)
        else:
            names = ("frequency", "level", "amplitude", "regime", "multiplier")
            rows = [self._row(one) for one in drives]
            curve = {name: np.array(column) for name, column in zip(names, zip(*rows))}
        finite = np.where(np.isfinite(curve["amplitude"]), curve["amplitude"], -1.0)
        return curve, drives[int(np.argmax(finite))], None

    def _single(self, drives) -> dict:
        """The curve of one mode by its own map, compiled."""
        from ...compiled import load

        load("dynamics.one_mode.steady_kernels", self.say)
        from ...dynamics.one_mode.steady import response

        found = response(self.modes, drives, float(self.forces[0][0]), float(self.forces[1][0]))
        names = [f"{stops:g} stops" if str(regime) == "stops" else str(regime)
                 for regime, stops in zip(found.regime, found.stops)]
        return {"frequency": found.omega / (2 * np.pi), "level": np.array([one.acceleration for one in drives]),
                "amplitude": found.amplitude, "regime": np.array(names), "multiplier": np.abs(found.multiplier)}

    def _row(self, drive) -> tuple:
        found = self.found(drive)
        bounded = found.regime != "unbounded"
        return (drive.omega / (2 * np.pi), drive.acceleration, found.amplitude if bounded else np.nan, found.regime,
                float(np.abs(found.multipliers).max(initial=0.0)))


class _Balance:
    """Laws with memory and springs that bend, by harmonic balance."""

    def __init__(self, model, numerics, patch, say):
        from ...compiled import load
        from .interface import contact_model

        load("dynamics.harmonic.cycle_kernels", say)
        from ...dynamics.harmonic.forces import Group
        from ...dynamics.harmonic.laws import Interlock, Spring

        rig = model.rig
        if len(rig.modes.interfaces) > 1:
            raise PatchfemError("'harmonic' with several interfaces of laws without an exact solution: not yet built; "
                                "use method = \"march\"", "accuracy.method")
        parts = []
        if model.friction is not None:
            parts.append((0, contact_model(model, numerics, patch)))
        if rig.interlock is not None:
            parts.append((0, Interlock(*rig.interlock)))
        if rig.cubic is not None:
            parts.append((rig.modes.output, Spring(0.0, rig.cubic)))
        self.model, self.modes, self.patch, self.harmonics = model, rig.modes, patch, model.accuracy.harmonics
        self.group, self.tolerance = Group(rig.modes, parts), model.accuracy.tolerance

    def point(self, drive, near=None) -> tuple:
        """The steady motion, from the point `near` of a curve where there are several, its measures read off one cycle;
        errors from half the harmonics and the balance's own."""
        from ...dynamics.harmonic.balance import regime
        from ...dynamics.harmonic.point import point
        from ...dynamics.harmonic.stability import with_stability

        begin = perf_counter()
        found = point(self.modes, drive, self.group, self.harmonics, self.tolerance,
                      start=near)
        fewer = point(self.modes, drive, self.group, max(1, found.harmonics // 2), self.tolerance, start=near and found)
        stable = with_stability(found, self.modes)
        values, response, book = self._measured(found, drive)
        rough = self._measured(fewer, drive)[0]
        # the higher harmonics follow those of `found`, not those of `fewer`: measured, 20 times less is left out
        errors = {name: abs(v - rough.get(name, v)) / 10 + abs(v) * min(found.error, 1.0) for name, v in values.items()}
        if "slip_start_phase" in errors:
            errors["slip_start_phase"] = min(errors["slip_start_phase"], np.pi / 2) + 2 * np.pi / SAMPLES
            errors["stick_fraction"] = errors.get("stick_fraction", 0.0) + 4 / SAMPLES
        name, _ = regime(found)
        held = name == "stuck"
        extra = {"regime": name if stable.stable else f"{name}, unstable", "multipliers": stable.multipliers,
                 "residual": found.residual, "harmonics": found.harmonics}
        amplitude = np.array([values["relative_displacement_amplitude"]])
        outcome = Outcome.STUCK if held else Outcome.STEADY
        raw = Solution(values, response, response, amplitude, (None, None), outcome, [], book, perf_counter() - begin)
        return raw, errors, extra

    def _measured(self, found, drive) -> tuple:
        from ...dynamics.harmonic.balance import cycle_energy, periodic_response

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
        values = measures_of(seen(self.model, self.patch, response, extremes, book, SAMPLES, drive=drive, known=known,
                                  loop=sampled_loop(response, drive, book["friction"])))
        if self.model.friction is not None:
            values |= other_measures(response, drive, SAMPLES)
        return values, response, book

    def curve(self, drive) -> tuple:
        """(curve as arrays by name through its folds, the sine of its largest amplitude, the point there)."""
        from ...dynamics.harmonic.branch import levels, response

        if hasattr(drive, "low"):
            first = BaseSine(drive.acceleration, 2 * np.pi * drive.low, drive.moving)
            branch = response(self.modes, first, self.group, (drive.low, drive.high), self.harmonics,
                              self.tolerance, True)
        else:
            sizes = [s.amplitude for s in drive.segments]
            first = BaseSine(sizes[0], drive.segments[0].omega, drive.moving)
            branch = levels(self.modes, first, self.group, sizes if len(sizes) != 2 else [sizes[0], np.mean(sizes),
                            sizes[1]], self.harmonics, self.tolerance, True)
        amplitude = branch.amplitudes(self.modes.output)
        curve = {"frequency": np.array([p.omega / (2 * np.pi) for p in branch.points]),
                 "level": np.array([p.level for p in branch.points]), "amplitude": amplitude,
                 "regime": np.array(["stable" if p.stable else "unstable" for p in branch.points]),
                 "multiplier": np.array([np.abs(p.multipliers).max(initial=0.0) for p in branch.points]),
                 "folds": np.array(branch.folds)}
        best = branch.points[int(np.argmax(amplitude))]
        return curve, BaseSine(best.level, best.omega, drive.moving), best
