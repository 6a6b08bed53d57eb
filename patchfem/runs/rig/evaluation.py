"""Evaluation of a run of any engine: measures, stick, outcome and drive levels.

In: a run of an engine. Out: its Solution. Subclasses of `RunEvaluator` override the methods for
quantities that their engine computes more accurately than from samples.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import friction
from ...core import Outcome, Response
from ...cost_model import measure_cpu_time
from ...effects import law_has_trait
from ...response.decay_curve import measure_last_cycle_amplitude
from ...response.events import Events, is_all_stuck
from ...response.loops import reversal_force_rule
from ...response.measures import Values, relative_gap
from ...response.rows import AMPLITUDE, LastCycles, compute_measures
from ...structure.drive_sizes import is_sinusoidal
from .levels import run_levels
from .solution import Solution, first_interface_load, first_mode_stiffness


@dataclass(frozen=True, eq=False, slots=True)
class EngineRun:
    """Run of an engine that sums the measures over its steps, with its histories.

    - values: measures of the last cycles by name.
    - response, window: histories of the run and of its last cycles.
    - extremes (c, 2), phasors (c,): minimum and maximum, and complex amplitude at the drive frequency, of the output [m]
      in each of c cycles.
    - ledger: energies [J] and counters by name.
    - outcome, message: how the run ended, if it ended early.
    - end: state at the end, from which another run can go on.
    - cycles_done: number of cycles.
    - log: events of the interfaces, or None.
    - snapshots: states of the elements of a patch in the last cycle.
    """

    values: Values
    response: Response
    window: Response
    extremes: np.ndarray
    phasors: np.ndarray
    ledger: Values
    outcome: Outcome | None
    message: str
    end: Any
    cycles_done: float
    log: Events | None = None
    snapshots: Sequence = ()


class RunEvaluator:
    """Evaluation of the runs of a model that one engine has computed.

    The subclass of an engine integrates the motion under a drive from the end of another run (`integrate`). It returns the
    fields of `LastCycles` that it computes more accurately than from samples (`describe_cycles`), further fields of the
    Solution (`collect_solution_fields`), and the errors that the run itself shows (`estimate_run_errors`).

    Parameters
    ----------
    model : Model
    numerics : Numerics
    patch : Patch or None
    contact : optional
        Contact model of the engine.
    stick_tolerance : float
        Largest slip per cycle [m] at which the interface counts as stuck.
    """

    def __init__(self, model, numerics, patch, contact=None, stick_tolerance: float = 0.0):
        self.model = model
        self.numerics = numerics
        self.patch = patch
        self.contact = contact
        self.has_friction = model.friction is not None
        # With a law that creeps, the interface slips under every force, however small.
        self.creeps = self.has_friction and law_has_trait(model.friction.law, "creeps")
        self.stick_tolerance = 0.0 if self.creeps else stick_tolerance

    def solve(self, frames: int, progress, prepare: Values) -> Solution:
        """Compute the motion of the rig, for one drive level after another, and its Solution.

        Parameters
        ----------
        frames : int
            Number of snapshots of the interface in the last cycle.
        progress : callable or None
            Callback for the completed fraction.
        prepare : dict
            CPU time of each part of the preparation [s].
        """
        begin = measure_cpu_time()
        drive = self.model.rig.drive
        fields = {}
        if drive.levels.amplitudes:
            run, fields = run_levels(self, frames, progress)
        else:
            run = self.integrate(drive.signal, self.numerics.cycles, None, frames, progress)
        return self.make_solution(run, measure_cpu_time() - begin, prepare=prepare, **fields)

    def evaluate_measures(self, run, drive=None, ledger=None, *, stuck: bool = False) -> Values:
        """Compute the measures of a run from its last cycles.

        Parameters
        ----------
        run
            Run of the engine, with all cycles or with those of a drive level.
        drive : optional
            Drive of the run; default: that of the model.
        ledger : (4, k), optional
            Friction work, and stored, dissipated and created energy [J] at the samples of the whole run.
        stuck : bool
            Whether the interface is stuck during the last cycles.
        """
        model = self.model
        drive = drive or model.rig.drive.signal
        fields = {"window": run.window, "run_energies": run.ledger}
        if self.has_friction:
            fields |= {"reversal_rule": reversal_force_rule(model), "ledger": ledger}

        # What the engine knows better replaces what follows from samples.
        fields |= self.describe_cycles(run, drive, stuck=stuck)
        window = fields["window"]
        n_cycles = min(self.numerics.window, len(run.extremes))
        last_cycles = LastCycles(
            drive=drive,
            extremes=run.extremes[-n_cycles:],
            load=first_interface_load(model, self.patch),
            stiffness=first_mode_stiffness(model, window),
            is_sine=is_sinusoidal(drive),
            **fields,
        )

        values = compute_measures(last_cycles)

        # The amplitude of a decay is that of its last complete cycle, not of the whole window.
        if model.rig.drive.kind == "free":
            # It may begin before the window.
            motion = (run.response.time, run.response.output, run.response.output_rate)
            amplitude = measure_last_cycle_amplitude(*motion, drive.period)
            if amplitude is not None:
                values[AMPLITUDE] = amplitude
        return values

    def is_stuck(self, run) -> bool:
        """Return whether no interface or band slips in the last cycles by more than `stick_tolerance` [m].

        A law that creeps never sticks.
        """
        if not self.has_friction or self.creeps:
            return False
        return is_all_stuck(run.window, self.stick_tolerance)

    def make_solution(self, run, seconds: float, drive=None, **other_fields) -> Solution:
        """Evaluate a run and return its Solution.

        Measures follow from the last `numerics.window` cycles. The amplitude is half the difference of the largest and the
        smallest output of these cycles, except for a release: that of its last whole cycle. `run_errors` are the errors
        that the run itself shows: of sampling, and those of its engine. Errors due to steps and mesh need coarse runs and
        are not part of it.

        Parameters
        ----------
        run
            Run of the engine.
        seconds : float
            CPU time of the run [s].
        drive : optional
            Drive of the run; default: that of the model.
        **other_fields
            Further fields of the Solution.
        """
        drive = drive or self.model.rig.drive.signal
        stuck = self.is_stuck(run)
        values = self.evaluate_measures(run, drive, run.response.extra.get("ledger"), stuck=stuck)
        fields = {"message": run.message, "log": run.log, "snapshots": run.snapshots}
        fields |= self.collect_solution_fields(run, drive)

        # Without an early end, the outcome stays open until the errors are known.
        return Solution(
            values=values,
            response=run.response,
            window=run.window,
            outcome=run.outcome or (Outcome.STUCK if stuck else None),
            book=run.ledger,
            seconds=seconds,
            contact=self.contact,
            stick_tolerance=self.stick_tolerance,
            run_errors=self.estimate_run_errors(run, drive, values),
            extremes=run.extremes,
            phasors=run.phasors,
            **(fields | other_fields),
        )


def compute_sampled_work(response) -> Values:
    """Return {"sampled": friction work of a Response, "passed": integral of its absolute value} [J].

    Both follow from the samples of all interfaces by the trapezoidal rule.
    """
    pairs = zip(response.slides.T, response.forces.T)
    parts = [friction.path_work.sampled_work(slide, force) for slide, force in pairs]
    sampled = sum(float(part.sum()) for part in parts)
    return {"sampled": sampled, "passed": sum(float(abs(part).sum()) for part in parts)}


def compute_work_check(energies: Values) -> float:
    """Return the relative difference of the friction work from samples and from the energy balance.

    Parameters
    ----------
    energies : dict
        Energies of a run [J]. "sampled" is the friction work from samples, "booked" that of the
        energy balance, and "passed" the integral of its absolute value.
    """
    scale = energies["power"] + energies["peak_stored"]
    return relative_gap(energies["sampled"], energies["booked"], energies["passed"], scale)
