"""Runs of a rig from event to event by the engine `event_driven`.

In: a Model, its Numerics and its Patch. Out: a Solution whose measures the engine has summed over its steps. The samples of
the histories are those of the last cycles, of equal distances before them, and of the events.
"""

from dataclasses import replace
from time import process_time
from typing import NamedTuple

import numpy as np

from ... import friction
from ...convergence import convergence_error
from ...core import NotConverged, Outcome, Response
from ...event_driven import cases
from ...event_driven import runs as engine
from ...event_driven.laws import is_rigid, masing
from ...event_driven.measures import compute_energies
from ...event_driven.records import Margin, Memory, State, Status
from ...measures.errors import ERROR_MEASURES, compute_absolute_changes
from ...measures.events import (
    SEGMENT_BORDER,
    Events,
    VibratingMode,
    classify_changes,
    compute_stuck_vibration,
    find_segment_borders,
    select_strongest,
    sort_events,
)
from ...measures.measures import Values
from ...measures.rows import find_definition, select_names
from ...structure.drive_sizes import choose_samples_per_cycle, is_sinusoidal
from ...structure.histories import find_accelerations
from ..bench.masing import find_stretches
from ..interfaces import bands
from . import engines
from .evaluation import (
    EngineRun,
    RunEvaluator,
    compute_sampled_loop,
    compute_work_check,
    describe_escape,
    find_travel,
    first_mode_stiffness,
)
from .joints import Joints, make_joints

LATE_SAMPLES_PER_CYCLE = 400  # samples of each of the last cycles
MIN_WINDOW_SAMPLES = 101  # samples of the last cycles of a run shorter than a cycle
N_EARLY_SAMPLES = 8_000  # samples of equal distances before the last cycles
EARLY_SAMPLES_PER_CYCLE = 40  # largest number of these in a cycle by default
MIN_SAMPLED_CYCLES = 2.0  # cycles at the end that have as many samples as the window
SAME_SAMPLE_TIME_TOL = 1e-9  # distance of samples that are one, in cycles
# Distance from a place of a grid of equal distances that is round-off, in distances
SAME_PLACE_TOL = 1e-6
# Groups of measures that are computed in the same way where bands of a face slide apart: those of the motion, of the whole
# run and of the errors of the solution. The others follow from the averages over the bands.
BAND_MEASURE_GROUPS = ("curve", "run", "error")
# Outcomes of motions that the engine ends early, by its status
EARLY_OUTCOME_BY_STATUS = {
    Status.EXCEEDS_TRAVEL: Outcome.EXCEEDS_TRAVEL,
    Status.LEAVES_GROOVES: Outcome.LEAVES_GROOVES,
}


class SampleTimes(NamedTuple):
    """Times of the samples of a run [s].

    - samples (k,): all of them.
    - snapshots (f,): those at which the elements are stored, in the last cycle.
    - window_start: start of the window.
    """

    samples: np.ndarray
    snapshots: np.ndarray
    window_start: float


class ElementSnapshot(NamedTuple):
    """State of the elements of patches at an instant of the last cycle.

    - time: [s].
    - faces: displacement [m] and stretches (e,) [m] of each interface.
    """

    time: float
    faces: list

    @property
    def slide(self) -> float:
        """Displacement of the first interface [m]."""
        return self.faces[0][0]

    @property
    def stretch(self) -> np.ndarray:
        """Stretches (e,) of the elements of the first interface [m]."""
        return self.faces[0][1]


class LumpedEvaluator(RunEvaluator):
    """Evaluator that computes runs of the engine `event_driven`, and measures from them.

    Parameters
    ----------
    model : Model
        Rig, drive and friction laws.
    numerics : Numerics
        Step tolerance, cycles and window.
    patch : Patch or None
        None under [normal] or between masses.
    joints : Joints, optional
        Laws of the interfaces; they are made by default.
    """

    def __init__(self, model, numerics, patch, joints: Joints | None = None):
        begin = process_time()
        self.joints = joints = joints or make_joints(model, numerics, patch)
        super().__init__(model, numerics, patch, joints, joints.stick_tolerance)
        self.prepare = {"reduce": process_time() - begin}
        self.bands_slide_apart = model.rig.friction.bands_slide_apart and self.has_friction

    def integrate(
        self, drive, cycles: float, before: EngineRun | None, n_frames: int = 0, progress=None
    ) -> EngineRun:
        """Integrate the motion under a drive from the end of another run.

        Parameters
        ----------
        drive
            Acceleration of the base, or force over the modal mass.
        cycles : float
            Number of cycles of the drive.
        before : EngineRun or None
            Run from whose end the motion goes on, or None for the start of the rig.
        n_frames : int
            Number of snapshots of the interface in the last cycle.
        progress : callable, optional
            Callback for the completed fraction.
        """
        run = self.resume(drive, cycles, None if before is None else before.end, n_frames)
        count = int(run.cycles_done + 1e-9)
        if count and not self.model.rig.drive.levels.amplitudes:
            # The last cycle is not complete.
            run = replace(run, extremes=run.extremes[:count], phasors=run.phasors[:count])
        # Measures of the whole run add up from level to level.
        for name in select_names("run"):
            if before is not None and name in before.values:
                run.values[name] += before.values[name]
        if progress is not None:
            progress(1.0)
        return run

    def resume(self, drive, cycles: float, state: State | None, n_frames: int = 0) -> EngineRun:
        """Integrate the motion under a drive.

        Parameters
        ----------
        drive
            Acceleration of the base or force over the modal mass, over time.
        cycles : float
            Number of cycles of the drive.
        state : State or None
            State from which the motion goes on, or None for the start of the rig.
        n_frames : int
            Number of snapshots of the elements in the last cycle.
        """
        rig = self.model.rig
        numerics = self.numerics

        def advance(cycles: float, samples, travel: float):
            """Return the motion of the engine.

            Parameters
            ----------
            cycles : float
                Number of cycles of the drive.
            samples : (k,) array
                Times of the samples [s].
            travel : float
                Output [m] at which the motion ends.
            """
            schedule = cases.Schedule(cycles, numerics.window, np.unique(samples), travel)
            settings = {"rtol": numerics.local, "n_steps": numerics.steps}
            case = cases.make_rig_case(rig, self.joints.laws, schedule, signal=drive, **settings)
            return engine.run_case(case, start=state)

        travel = find_travel(rig)
        times = choose_sample_times(numerics, drive, cycles, n_frames)
        motion = advance(cycles, times.samples, travel)

        # Why the motion ended early, as an outcome or as an error.
        outcome = EARLY_OUTCOME_BY_STATUS.get(motion.status)
        message = ""
        if outcome is None and motion.status != Status.DONE:
            march = ""
            if not engines.MARCH.find_unsupported_feature(self.model):
                # Some messages end with a remedy of their own.
                before = ", or" if ";" in motion.message else ";"
                march = f'{before} use accuracy.method = "march"'
            raise NotConverged(motion.message + march)
        if outcome is not None:
            message = describe_escape(rig, travel)
            if outcome is Outcome.LEAVES_GROOVES:
                message = self.model.grooves.describe_lift(motion.time)
            # Only a run with a known end has the measures and samples of its last cycles.
            cycles = motion.time / drive.period
            times = choose_sample_times(numerics, drive, cycles, 0)
            motion = advance(cycles, times.samples, np.inf)

        time = motion.rows[:, 0]
        if hasattr(drive, "band"):
            # Spectra need samples of equal distances.
            is_kept = np.isin(time, times.samples)
        else:
            # Differences of samples at nearly the same time are round-off, except at a jump of the force; the last sample
            # is kept.
            is_late = np.diff(time) > SAME_SAMPLE_TIME_TOL * drive.period
            is_late |= motion.rows[1:, -1] == Margin.AFTER
            is_kept = np.append(is_late, True)
        histories = motion.make_response(rig.modes, drive)
        response = histories.select(is_kept)
        if self.model.grooves is not None and self.model.grooves.lifted_mass:
            response = self._add_vertical_force(response, drive)

        run = EngineRun(
            values=dict(motion.values),
            response=response,
            window=response.select(response.time >= times.window_start * (1 - 1e-15)),
            ledger=compute_energies(motion.case, motion.final) | {"steps": float(motion.n_steps)},
            outcome=outcome,
            message=message,
            extremes=motion.extremes,
            phasors=motion.phasors,
            end=motion.final,
            cycles_done=cycles,
            log=self._list_events(motion, drive),
            snapshots=self._list_snapshots(histories, times.snapshots, state),
        )
        return bands.average_over_bands(run, self.patch) if self.bands_slide_apart else run

    def _add_vertical_force(self, response: Response, drive) -> Response:
        """Return histories with the vertical force on the flanks, which carries load and lifted mass, as normal load."""
        grooves = self.model.grooves
        modes = self.model.rig.modes
        accelerations = find_accelerations(
            modes,
            drive.values(response.time),
            response.modal,
            response.modal_rate,
            np.outer(response.force, modes.slide),
        )
        lift = grooves.find_lift(response.slide, response.slide_rate, accelerations @ modes.slide)
        force = self.joints.laws[0][1].mean + grooves.lifted_mass * lift
        return replace(response, extra=response.extra | {"normal_load": force})

    def _list_events(self, motion, drive) -> Events | None:
        """Return stops, releases and reversals of the interfaces, and the changes of the drive.

        None for laws that have no such events, because some part of them always slips.
        """
        laws = [law for law, _ in self.joints.laws]
        are_rigid = all(is_rigid(law.law) for law in laws)
        if not laws or not (are_rigid or all(masing.has_stick(law) for law in laws)):
            return None
        directions = motion.find_directions()
        rows = motion.event_rows
        modes = self.model.rig.modes
        slides = rows[:, 1 : 1 + modes.omega.size] @ modes.interfaces.T
        borders = [start for start in find_segment_borders(drive) if start < motion.time]
        events = [(start, 0, SEGMENT_BORDER, np.nan) for start in borders]
        for k, states in enumerate(directions.T):
            changed = np.flatnonzero(states[:-1] != states[1:])
            kinds = classify_changes(states[changed], states[changed + 1])
            events += zip(rows[changed, 0], [k + 1] * changed.size, kinds, slides[changed, k])
        return sort_events(events)

    def _list_snapshots(self, histories: Response, times, start) -> list[ElementSnapshot]:
        """Return the stretches of the elements of patches at given times, from the whole motion before.

        What happened before its start is in the memory of its `State`, if it does not start from rest. `histories` are
        those of the whole motion with its events, `times` [s] are those of the snapshots, and `start` is the `State`
        from which the motion went on, or None.
        """
        if not len(times) or not self.joints.elements:
            return []
        at = np.searchsorted(histories.time, times)
        states = []
        for i, (_, yields) in enumerate(self.joints.elements):
            remembered = np.zeros(0)
            if start is not None:
                # Slides of the origin and of the reversals that the law remembers
                memory = start.memory[i]
                stack = memory[Memory.STACK :: 2][: int(memory[Memory.COUNT])]
                remembered = memory[Memory.ORIGIN] + np.append(0.0, stack)
            path = np.append(remembered, histories.slides[:, i])
            states.append(find_stretches(yields, path, at + remembered.size))
        return [ElementSnapshot(float(time), faces) for time, *faces in zip(times, *states)]

    def describe_cycles(self, run, drive) -> dict:
        """Return the measures of the engine.

        Bands that slide independently are parts of a single interface, whose loop of the mean displacement is that of
        samples.

        Parameters
        ----------
        run : EngineRun
            Run of the engine `event_driven`.
        drive
            Drive of this run, which may be a single level.
        """
        values = {
            name: None if np.isnan(value) else float(value) for name, value in run.values.items()
        }
        if not is_sinusoidal(drive):
            values |= dict.fromkeys(select_names("sine"))
        window = run.window
        if not self.has_friction:
            values |= dict.fromkeys(select_names("run"))
        else:
            if not first_mode_stiffness(self.model, run.window):
                # The interface moves in several modes.
                values["equivalent_damping"] = None
            work = window.extra["ledger"][0]
            # Friction work of all interfaces by the trapezoidal rule, and its magnitude
            pairs = zip(window.slides.T, window.forces.T)
            sampled = [friction.path_work.sampled_work(*pair) for pair in pairs]
            known = {
                "sampled": sum(float(part.sum()) for part in sampled),
                "passed": sum(float(abs(part).sum()) for part in sampled),
                "booked": work[-1] - work[0],
            }
            values["work_check"] = compute_work_check(run.ledger | known)
        if not self.bands_slide_apart:
            return {"integrated": values}

        names = ["slip_start_phase"]
        for group in BAND_MEASURE_GROUPS:
            names += select_names(group)
        place = (window.time - window.time[0]) / np.diff(window.time).max()
        # The yaw does work in addition to that of the mean displacement.
        work = np.ptp(window.extra["ledger"][0, [0, -1]])
        cycles = (window.time[-1] - window.time[0]) / drive.period
        return {
            "integrated": {name: values.get(name) for name in names},
            "is_single_interface": True,
            "loop": compute_sampled_loop(window, drive, float(work / cycles)),
            # The other measures need samples of equal distances.
            "window": window.select(np.abs(place - np.round(place)) <= SAME_PLACE_TOL),
        }

    def estimate_run_errors(self, run, drive, values: Values) -> Values:
        """Estimate the sampling errors of the measures of a random motion; {} for other drives.

        They follow from the changes when every second sample of the window is removed, except for the last one.

        Parameters
        ----------
        run
            Run of the engine, with LATE_SAMPLES_PER_CYCLE samples in the cycles of its window.
        drive
            Drive of the run.
        values : dict of float
            Measures by name.
        """
        if not hasattr(drive, "band"):
            return {}
        count = run.window.time.size
        samples = np.append(np.arange(0, count - 1, 2), count - 1)
        thinned = replace(run, window=run.window.select(samples))
        coarse_values = self.evaluate_measures(thinned, drive)
        errors = {}
        for name, change in compute_absolute_changes(values, coarse_values).items():
            if change > 0 and name not in ERROR_MEASURES:
                row = find_definition(name)
                error = convergence_error(change, order=row.order)
                errors[name] = error + row.sample_error / LATE_SAMPLES_PER_CYCLE
        return errors

    def find_tail(self, run) -> VibratingMode | None:
        """Return the free vibration that remains after the last slip of a release, or None.

        No interface slips any more, so that the rig is linear. There is none for other drives and nonlinear springs.
        """
        rig = self.model.rig
        is_linear = not self.joints.laws
        springs = np.zeros(len(rig.modes.interfaces)) if is_linear else self.joints.springs
        if not rig.drive.is_release or not np.isfinite(springs).all() or rig.springs.is_nonlinear:
            return None

        # The part of the motion in which no interface slips.
        motion = run.response
        if not is_linear:
            moves = np.abs(np.diff(motion.slips, axis=0)).max(axis=1) > 0
            last = np.flatnonzero(moves)[-1] + 1 if moves.any() else 0
            motion = motion.select(motion.time >= motion.time[last])
        vibration = []
        if motion.time.size > 1:
            vibration = compute_stuck_vibration(rig.modes, springs, motion)
        return select_strongest(vibration) if vibration else None


def choose_sample_times(numerics, drive, cycles: float, n_frames: int = 0) -> SampleTimes:
    """Choose the times of the samples and of `n_frames` snapshots.

    Parameters
    ----------
    numerics : Numerics
        Number of cycles of the window, and whether the histories before it are stored.
    drive : drives.DriveSignal
        Drive, whose period divides the run into cycles.
    cycles : float
        Number of cycles of the drive in the run.
    n_frames : int
        Number of snapshots in the last cycle.
    """
    period = drive.period
    end = cycles * period
    window_start = max(0.0, end - numerics.window * period)
    first = window_start
    early = np.zeros(0)
    if numerics.whole:
        # Before the last cycles the distances are larger, and equal.
        first = max(0.0, min(window_start, end - MIN_SAMPLED_CYCLES * period))
        count = max(1, min(EARLY_SAMPLES_PER_CYCLE, N_EARLY_SAMPLES // max(cycles, 1)))
        count = choose_samples_per_cycle(drive, cycles) or count
        early = np.arange(0.0, first - 1e-9 * period, period / count)

    # Each of the last cycles has LATE_SAMPLES_PER_CYCLE samples.
    late = _divide(window_start, end, period, MIN_WINDOW_SAMPLES)
    if first < window_start:
        late = np.union1d(_divide(first, window_start, period, 2), late)

    # A snapshot is taken at a sample, where all histories have a value.
    begin = max(0.0, end - period)
    at = begin + (end - begin) * (1 + np.arange(n_frames)) / max(n_frames, 1)
    nearest = np.abs(late[:, None] - at).argmin(axis=0)
    return SampleTimes(np.append(early, late), late[nearest], window_start)


def _divide(begin: float, end: float, period: float, minimum: int) -> np.ndarray:
    """Return times (k,) [s] of equal distances from begin to end, LATE_SAMPLES_PER_CYCLE in a period.

    The times and the period are in [s], and `minimum` is the smallest number of times.
    """
    count = round((end - begin) / period * LATE_SAMPLES_PER_CYCLE) + 1
    return np.linspace(begin, end, max(minimum, count))
