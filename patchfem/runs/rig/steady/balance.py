"""The steady motion of laws with memory and of springs that bend, by harmonic balance; its curve through folds."""

from dataclasses import replace
from time import perf_counter

import numpy as np

from ....compiled import load
from ....core import IntegratedMeasures, NotConverged, Outcome, SineDrive
from ....dynamics.harmonic import branch as branches
from ....dynamics.harmonic.balance import cycle_energy, periodic_response
from ....dynamics.harmonic.balance import regime as balanced_regime
from ....dynamics.harmonic.forces import Group
from ....dynamics.harmonic.laws import Interlock, Spring
from ....dynamics.harmonic.point import finer
from ....dynamics.harmonic.point import point as periodic_point
from ....dynamics.harmonic.stability import with_stability
from ....dynamics.integrated import Run
from ....formatting import format_length
from ....response.errors import finer_errors
from ....response.measures import acceleration_peak
from ....response.spectrum import odd_harmonics, wave_measures
from ..interface import contact_model
from ..reading import Reader, friction_works
from ..solution import Solution, sampled_loop
from .curves import LAST, SHOWN, Shown, unlasting

SAMPLES = 4096  # of the cycle that measures are read off


class Balanced(Reader):
    """What one cycle of a balance shows; turns: `Periodic.turns` of it."""

    turns: tuple = ()

    def integrated(self, run, drive) -> IntegratedMeasures:
        """The two books of friction work and the turns; the middle of a motion that repeats stays."""
        return IntegratedMeasures(
            drift=0.0,
            friction_works=friction_works(run.response, run.ledger["friction"]),
            reversals=(tuple(one[:2] for one in self.turns),) if self.turns else (),
        )

    def more(self, run, drive, stuck: bool) -> dict:
        """The loop of a cycle by the trapezoidal rule, force and slip as its samples and turns have them."""
        loop = sampled_loop(run.window, drive, run.ledger["friction"])
        if not self.rubs or not self.turns:
            return {"loop": loop}
        _, forces, slips = (
            np.append(beside, own)
            for beside, own in zip(zip(*self.turns), (0.0, run.window.force, run.window.slip))
        )
        return {
            "loop": loop,
            "known": {
                "friction_force_peak": float(np.abs(forces).max()),
                "slip_amplitude": float(np.ptp(slips)) / 2,
            },
        }


class BalanceFinder:
    """Laws with memory and springs that bend, by harmonic balance."""

    tries_another, leaves = False, (1e-2, 0.1)

    def __init__(self, model, numerics, patch, frames: int = 0, say=None):
        load("dynamics.harmonic.cycle_kernels", say)
        rig = model.rig
        parts = []
        if model.friction is not None:
            parts.append((0, contact_model(model, numerics, patch)))
        if rig.springs.interlock is not None:
            parts.append((0, Interlock(*rig.springs.interlock)))
        if rig.springs.cubic is not None:
            parts.append((rig.modes.output, Spring(0.0, rig.springs.cubic)))
        self.model, self.modes, self.patch, self.harmonics = (
            model,
            rig.modes,
            patch,
            model.accuracy.harmonics,
        )
        self.numerics = numerics
        self.group, self.tolerance = Group(rig.modes, parts), model.accuracy.tolerance

    def point(self, drive, near=None) -> tuple:
        """The steady motion, from the point `near` of a curve where there are several, its measures read off one cycle,
        and its Periodic; errors from twice its harmonics, its samples and those it is read at."""
        begin = perf_counter()
        found = periodic_point(
            self.modes, drive, self.group, self.harmonics, self.tolerance, start=near
        )
        stable, notes = with_stability(found, self.modes), ()
        if not stable.stable:
            found, stable, notes = self._lasting(drive, found, stable)
        values, response, book = self._measured(found, drive)
        errors = self._errors(values, found, drive, lambda *of: self._measured(*of, 2 * SAMPLES)[0])
        if "slip_start_phase" in errors:
            errors["slip_start_phase"] = max(
                min(errors["slip_start_phase"], np.pi / 2), 2 * np.pi / SAMPLES
            )
            errors["stick_fraction"] = max(errors.get("stick_fraction", 0.0), 4 / SAMPLES)
        name, _ = balanced_regime(found)
        held = name == "stuck"
        extra = {
            "regime": name if stable.stable else f"{name}, unstable",
            "multipliers": stable.multipliers,
            "residual": found.residual,
            "harmonics": found.harmonics,
        }
        amplitude = np.array([values["relative_displacement_amplitude"]])
        outcome, message = Outcome.STUCK if held else Outcome.STEADY, ""
        if not stable.stable:
            outcome, message = Outcome.NOT_CONVERGED, unlasting(stable.multipliers)
        return Solution(
            values,
            response,
            response,
            amplitude,
            (None, None),
            outcome,
            [],
            book,
            perf_counter() - begin,
            message=message,
            errors=errors,
            extra=extra,
            notes=notes,
        ), found

    def _errors(self, values: dict, found, drive, read) -> dict:
        """Errors by name of the measures of a Periodic; where no finer one balances, what the balance leaves open.

        read(Periodic, drive) -> measures by name.
        """
        out = {name: abs(v) * min(found.error, 1.0) for name, v in values.items()}
        try:
            better = finer(found, self.modes, drive)
        except NotConverged:
            return out
        left = max(found.left, better.left)
        better = read(better, drive) if np.isfinite(better.error) else {}
        return out | {
            name: error + abs(values[name]) * left
            for name, error in finer_errors(values, better).items()
        }

    def _lasting(self, drive, found, stable) -> tuple:
        """In place of a Periodic that does not last the smallest one under the same drive that does, with its
        multipliers and a note on it; what is given, where none is found."""
        every = branches.branches(self.modes, drive, self.group, self.tolerance)
        lasts = [one for one in every if one.stable]
        if not lasts:
            return found, stable, ()
        found = periodic_point(
            self.modes, drive, self.group, self.harmonics, self.tolerance, start=lasts[0]
        )
        sizes = ", ".join(format_length(one.amplitude(self.modes.output), 3) for one in every)
        note = (
            f"at this drive {len(every)} steady motions exist (amplitudes {sizes}), {len(lasts)} of them stable"
            + (
                ""
                if len(lasts) == 1
                else "; the stable motion of smallest amplitude is shown; accuracy.method = "
                '"march" gives the motion that is reached from rest'
            )
        )
        return found, with_stability(found, self.modes), (note,)

    def shown(self, drive, near=None) -> Shown:
        """A point of a curve, its errors unknown."""
        found = periodic_point(
            self.modes, drive, self.group, self.harmonics, self.tolerance, start=near
        )
        return self._shown(with_stability(found, self.modes))

    def _shown(self, found) -> Shown:
        """What a Periodic with its multipliers shows."""
        kind, stable = balanced_regime(found)[0], bool(found.stable)
        drive = SineDrive(found.level, found.omega, self.model.rig.drive.signal.moving)
        return Shown(
            drive,
            self._read(found, drive),
            {},
            kind if stable else f"{kind}, unstable",
            float(np.abs(found.multipliers).max(initial=0.0)),
            stable,
            Outcome.STUCK if kind == "stuck" else Outcome.STEADY,
            found,
        )

    def _read(self, found, drive) -> dict:
        """The measures that a curve shows, by name."""
        response = periodic_response(found, self.modes, drive, SAMPLES)
        row = self.modes.output if self.modes.gauge is None else self.modes.gauge
        values = {
            SHOWN["amplitude"]: found.amplitude(row),
            SHOWN["acceleration_peak"]: acceleration_peak(response),
            **wave_measures(*odd_harmonics(response, drive)),
        }
        return {name: value for name, value in values.items() if value is not None}

    def _measured(self, found, drive, samples: int = SAMPLES) -> tuple:
        response = periodic_response(found, self.modes, drive, samples)
        book = cycle_energy(found, self.modes) | {
            "stored": 0.0,
            "iterations": float(found.iterations),
        }
        speed = np.arange(len(found.modal))[:, None] * found.omega * np.abs(found.modal)
        book |= {
            "power": abs(book["work_in"]),
            "peak_stored": self.modes.mass / 2 * float(np.sum(speed**2)),
        }
        top = found.amplitude(self.modes.output)
        middle = (response.output.max() + response.output.min()) / 2
        extremes = np.array([[middle - top, middle + top]])
        run = Run(response, response, extremes, np.zeros(1), book)
        reader = Balanced(self.model, self.numerics, self.patch, steps=samples)
        reader.turns = found.turns()
        return reader.values(run, drive), response, book

    def curve(self, drive) -> tuple:
        """(points of the curve over the frequency through its folds, the frequencies [Hz] of these)."""
        first = SineDrive(drive.acceleration, 2 * np.pi * drive.low, drive.moving)
        branch = branches.response(
            self.modes,
            first,
            self.group,
            (drive.low, drive.high),
            True,
            harmonics=self.harmonics,
            tolerance=self.tolerance,
        )
        return [self._of_branch(one, first) for one in branch.points], branch.folds

    def apart(self, one: Shown, other: Shown) -> float:
        """Way along a curve from one of its points to another, in which the whole range counts as the largest."""
        return branches.way(one.near, other.near, self._range)

    def between(self, one: Shown, other: Shown, share: float) -> Shown:
        """The point of a curve at a share of the way from one of its points to another, across the line to it."""
        drive = replace(one.drive, omega=one.near.omega)
        return self._of_branch(
            branches.between(self.modes, drive, one.near, other.near, share, self._range), drive
        )

    @property
    def _range(self) -> float:
        """Width [rad/s] of the range that is swept."""
        drive = self.model.rig.drive.signal
        return 2 * np.pi * abs(drive.high - drive.low)

    def _of_branch(self, found, drive) -> Shown:
        """A Periodic of a branch as a point of a curve with its errors."""
        found = with_stability(found, self.modes) if found.stable is None else found
        point = self._shown(found)._replace(regime="stable" if found.stable else "unstable")
        errors = self._errors(point.values, point.near, point.drive, self._read)
        least = {"acceleration_distortion": LAST}  # besides that of the value
        return point._replace(
            errors={
                name: error + LAST * abs(point.values[name]) + least.get(name, 0.0)
                for name, error in errors.items()
            }
        )
