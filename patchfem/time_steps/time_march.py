"""March of a rig with contact points over the cycles of its drive, and the record of its motion."""

from copy import copy
from dataclasses import dataclass
from enum import IntEnum
from itertools import pairwise
from math import ceil
from typing import NamedTuple

import numpy as np

from .. import kernel_cache
from ..core import ModalBasis, Outcome, Response, SineDrive
from ..friction.bonds.strip_rows_kernels import ListState
from ..friction.path_work import sampled_work
from ..motion_measures import find_reversal_steps
from ..structure import drive_sizes
from ..structure.histories import INTERFACE_HISTORIES, find_accelerations, make_response
from . import checkpoint
from .contacts import Contact
from .march_rows_kernels import (
    DONE,
    EXCEEDS_TRAVEL,
    LEAVES_GROOVES,
    N_PORT_COLUMNS,
    NO_CONTACT_SET,
    RESIDUAL,
    TOO_MANY_PARTS,
    Flank,
    Port,
    Sample,
    Shear,
    System,
    Total,
)
from .step_rows_kernels import WIDTH, Value
from .systems import copy_system, make_system

MAX_CYCLES_AT_ONCE = 8
MAX_STEPS_AT_ONCE = 8000
# Change of the state between two parts of a march, relative to its size, below which they repeat
SAME_CYCLE = 1e-11
MAX_EARLY_SAMPLES_PER_CYCLE = 128  # samples per cycle of the histories before the window
WHOLE_CYCLE_TOL = 1e-6  # fraction of a cycle that is round-off of the number of cycles
EDGE = 1e-9  # distance of the samples of a drive from the ends of a step, in steps
# Sums that a repeated cycle continues
REPEATED = [Total.WORK_IN, Total.POWER, Total.VISCOUS]
# Column of the number of the step in a row of a record; the first three of `Energy` follow
NUMBER = -4
PRESS_COLUMNS = ("normal_load", "normal_moment", "normal_energy", "heave", "turn")


class Energy(IntEnum):
    """Sums of a record over all steps [J]. The first three are also columns of its rows, after the number of the step.

    - WORK: friction work, by mean forces of the steps
    - DISSIPATED, CREATED: work that is not stored, where it is above 0 and where it is below
    - SAMPLED: friction work by the forces at the samples
    - PASSED: sum of the magnitudes of the friction works of the steps
    """

    WORK = 0
    DISSIPATED = 1
    CREATED = 2
    SAMPLED = 3
    PASSED = 4


class Snapshot(NamedTuple):
    """State of the m contact points of the first interface at an instant.

    - time [s], slide [m], force [N], slip [m] of the first port; heave [m] and pitch [rad]
    - forces, stretch, bend, load (m,): friction force [N], elastic stretch [m] and load [N] of each point, and its
      displacement by shear of the pieces [m]
    - moves (m,): displacement of the port of each point [m]
    - nodal (k,): forces of the nodes [N]; (0,) if the pressure does not change
    - vertical: vertical force on the flanks of grooves [N]
    """

    time: float
    slide: float
    force: float
    slip: float
    heave: float
    pitch: float
    forces: np.ndarray
    stretch: np.ndarray
    bend: np.ndarray
    load: np.ndarray
    moves: np.ndarray
    nodal: np.ndarray
    vertical: float


@dataclass(frozen=True, eq=False, slots=True)
class Motion:
    """Motion of a rig.

    - response: histories of the samples that were kept
    - window: histories of all samples of the last cycles
    - step_force: mean friction force of the first interface in each step of the window [N]
    - window_work: friction work in the window [J]
    - extremes (c, 2), phasors (c,): smallest and largest output, and phasor of the output, in each cycle [m]
    - ledger: energies [J] and counters by name
    - outcome, message: how the run ended, None and "" at its last step
    - cycles_done: number of cycles
    - snapshots: states at the ends of equal parts of the last cycle
    - end: the march at its end, from which another one can go on
    - log: None, because a march has no list of events
    """

    response: Response
    window: Response
    step_force: np.ndarray
    window_work: float
    extremes: np.ndarray
    phasors: np.ndarray
    ledger: dict[str, float]
    outcome: Outcome | None
    message: str
    cycles_done: float
    snapshots: list[Snapshot]
    end: "March"
    log: None = None


def load_kernels(contact: Contact, say=None):
    """Return the compiled march for a contact; code for lists of bonds and contact sets is compiled only if it has them.

    Parameters
    ----------
    contact : Contact
        Contact points.
    say : callable, optional
        Callback for a line of text.
    """
    kernel_cache.report_compilation_to(say)
    parts = {}
    if contact.press is None:
        parts["normal"] = "time_steps.no_normal_kernels"
    step_parts = dict(parts)
    if not contact.has_lists:
        step_parts["lists"] = "time_steps.no_lists_kernels"
    if module := contact.law_module:
        step_parts["laws"] = kernel_cache.instantiate("time_steps.laws_kernels", {"own": module})
    steps = kernel_cache.instantiate("time_steps.march_kernels", step_parts)
    return kernel_cache.instantiate("time_steps.loop_kernels", parts | {"steps": steps})


def sample_drive(drive, step: float, first: int, count: int) -> np.ndarray:
    """Return value, slope and second derivative (count, 3) of parabolas through the drive in each step.

    The ends are taken inside of the step, because the drive may jump there.

    Parameters
    ----------
    drive : core.SineDrive or another drive
        Acceleration or force over mass as a function of time.
    step : float
        Duration of a step [s].
    first : float
        Start of the first step, in steps.
    count : int
        Number of steps.
    """
    starts = first + np.arange(count)[:, None]
    times = step * (starts + np.array([EDGE, 0.5, 1 - EDGE]))
    values = drive.values(times.ravel()).reshape(count, 3)
    start, middle, end = values.T
    slope = (4 * middle - 3 * start - end) / step
    return np.stack([start, slope, 4 * (start - 2 * middle + end) / step**2], axis=1)


# ---- march


class March:
    """March of a rig, from rest or from an initial state.

    - modes, drive, contact, steps, step: rig, drive, contact points, steps per cycle and their duration [s]
    - system: arrays of the engine
    - done: number of steps since the start
    - shift: time of step number 0 of the present step size, in steps; below 0 after a first part with shorter steps
    - n_first, first_step: number and duration [s] of the steps of the first part
    - outcome, message: how the march ended, None and "" as long as it goes on
    """

    def __init__(
        self, modes, drive, contact: Contact, steps: int, travel: float = np.inf, start=None
    ):
        self.modes = modes
        self.drive = drive
        self.contact = contact
        self.steps = steps
        self.step = drive.period / steps
        self.system = make_system(contact, self.step, modes, travel, start)
        self.done = 0
        self.shift = 0.0
        self.n_first = 0
        self.first_step = self.step
        self.outcome = None
        self.message = ""
        n_columns = len(contact.point_sets) + (2 if contact.press is not None else 0)
        self.width = 2 * modes.omega.size + Sample.PORTS + N_PORT_COLUMNS * n_columns
        self.kernels = load_kernels(contact)
        self.reset_balance()

    def fork(self, drive=None) -> "March":
        """Return a copy that goes on by itself, under another drive if one is given."""
        other = copy(self)
        other.system = copy_system(self.system)
        if drive is not None:
            other.drive = drive
        return other

    def set_step(self, step: float) -> None:
        """Go on with steps of another duration [s]."""
        time = (self.done + self.shift) * self.step
        fresh = make_system(self.contact, step, self.modes)
        system = self.system
        self.system = system._replace(
            structure=system.structure._replace(
                responses=fresh.structure.responses,
            ),
            ports=system.ports._replace(compliance=fresh.ports.compliance),
            options=system.options._replace(step=float(step)),
        )
        self.step = step
        self.shift = time / step - self.done

    def find_times(self, numbers) -> np.ndarray:
        """Return the times (k,) [s] of the steps with given numbers (k,)."""
        times = (numbers + self.shift) * self.step
        return np.where(numbers < self.n_first, numbers * self.first_step, times)

    @property
    def state(self) -> np.ndarray:
        """Modal coordinates [m] and velocities [m/s], (2, n)."""
        return self.system.state[0].reshape(2, -1)

    def reset_balance(self) -> None:
        """Begin the energy balance and the time anew; the present energy counts as work of the drive."""
        totals = self.system.totals
        totals[:] = 0.0
        self.done = 0
        self.shift = 0.0
        sample = np.zeros((1, self.width))
        self._set_drive(1)
        self.kernels.march(self.system, 0, sample)
        totals[[Total.WORK_IN, Total.STORED]] = self.find_stored_energy(sample[0])
        self.first_energy = float(sample[0, 2 * self.modes.omega.size + Sample.ENERGY])
        self.first_sums = self._sum_lists()

    def find_stored_energy(self, sample) -> float:
        """Return the energy [J] of modes, interfaces and normal contact at a sample."""
        z, v = self.state
        n = 2 * z.size
        squares = float(v @ v + (self.modes.omega * z) @ (self.modes.omega * z))
        interface = sample[n + Sample.ENERGY] + sample[n + Sample.CONTACT_ENERGY]
        interface += sample[n + Sample.SPRINGS]
        return 0.5 * self.modes.mass * squares + float(interface)

    def _set_drive(self, count: int) -> None:
        """Write the drive, and a prescribed load, of the next steps."""
        structure = self.system.structure._replace(
            drive=sample_drive(self.drive, self.step, self.done + self.shift, count + 1)
        )
        if self.contact.load is not None:
            times = self.step * (self.done + self.shift + np.arange(count + 1.0))
            structure = structure._replace(loads=np.asarray(self.contact.load(times), float))
        self.system = self.system._replace(structure=structure)

    def advance(self, count: int) -> np.ndarray:
        """March over a number of steps; return the samples (steps done + 1, w) of their starts and of the end."""
        self._set_drive(count)
        samples = np.zeros((count + 1, self.width))
        n_done, status = self.kernels.march(self.system, count, samples)
        samples = samples[: n_done + 1]
        self.done += n_done
        self._judge(status)
        return samples

    def _judge(self, status: int) -> None:
        """Set outcome and message from the status of the compiled march."""
        advice = "raise accuracy.steps_per_cycle"
        if status == EXCEEDS_TRAVEL:
            self.outcome = Outcome.EXCEEDS_TRAVEL
        elif status == LEAVES_GROOVES:
            self.outcome = Outcome.LEAVES_GROOVES
            self.message = self.contact.grooves.describe_lift((self.done + self.shift) * self.step)
        elif status == NO_CONTACT_SET:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = f"at step {self.done} the method could not determine which points are in contact; {advice}"
        elif status == TOO_MANY_PARTS:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = f"in step {self.done} rigid friction stops and slips too often; {advice}, or give it a stiffness"
        elif status != DONE:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (
                f"at step {self.done} the computed motion is not a finite number; {advice}"
            )

    def check_steps(self) -> None:
        """Set the outcome to not_converged if any step has not met its tolerance."""
        unsolved = int(self.system.totals[Total.UNSOLVED])
        if unsolved:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (
                f"{unsolved} of {self.done} time steps have an error of the friction force above the permitted "
                f"{RESIDUAL:.0e} of the friction limit; raise accuracy.steps_per_cycle"
            )

    def find_sampled_works(self, samples) -> np.ndarray:
        """Return the friction work (k,) [J] in each step between samples (k + 1, w), by the forces at the samples."""
        n = 2 * self.modes.omega.size
        sampled = np.zeros(len(samples) - 1)
        for k, point_set in enumerate(self.contact.point_sets):
            if point_set.is_spring:
                continue
            columns = samples[:, n + Sample.PORTS + N_PORT_COLUMNS * k :]
            mean = columns[:-1, 2] if self.contact.is_rigid(point_set) else None
            slide = samples[:, : n // 2] @ np.asarray(point_set.row, float)
            sampled += sampled_work(slide, columns[:, 0], mean)
        return sampled

    def take_snapshot(self, sample) -> Snapshot:
        """Return the state of the interface at the end of the last step, whose sample is given."""
        n = self.modes.omega.size
        row = self.system.ports.rows[0]
        remainder = sample[2 * n :]
        time = (self.done + self.shift) * self.step
        motion = (time, float(row @ sample[:n]), *remainder[Sample.PORTS : Sample.PORTS + 2])
        motion = (*motion, remainder[Sample.HEAVE], remainder[Sample.PITCH])
        return make_snapshot(self.system, self.contact.first_sets, motion)

    def find_ledger(self, sample, energies) -> dict[str, float]:
        """Return energies [J] and counters by name at a sample of the present state, with the sums `Energy` up to it."""
        n = 2 * self.modes.omega.size
        totals = self.system.totals
        friction = float(energies[Energy.WORK])

        # Friction dissipates its work less the change of the energy stored in the interface.
        ledger = {
            "work_in": float(totals[Total.WORK_IN]),
            "viscous": float(totals[Total.VISCOUS]),
            "power": float(totals[Total.POWER]),
            "friction": friction - float(sample[n + Sample.ENERGY] - self.first_energy),
            "peak_stored": float(totals[Total.STORED]),
            "iterations": float(totals[Total.ITERATIONS]),
            "stored": self.find_stored_energy(sample),
            "booked": friction,
            "sampled": float(energies[Energy.SAMPLED]),
            "passed": float(energies[Energy.PASSED]),
        }
        if self.system.options.has_lists:
            names = ("created", "dissipated", "strips")
            ledger |= dict(zip(names, map(float, self._sum_lists() - self.first_sums)))
            # Largest error of a join that made room in a full list, relative to the load
            errors = self.system.points.lists.states[:, ListState.JOIN_ERROR]
            ledger["join_error"] = float(errors.max(initial=0.0))
        return ledger

    def _sum_lists(self) -> np.ndarray:
        """Return created and dissipated energy [J] of the lists of bonds, and the length of the longest one."""
        states = self.system.points.lists.states
        sums = states[:, [ListState.CREATED, ListState.DISSIPATED]].sum(axis=0)
        return np.append(sums, states[:, ListState.LARGEST_COUNT].max(initial=0.0))


def split_losses(samples, n: int, scale: float) -> np.ndarray:
    """Return the loss [J] in each step between samples, friction work less the gain of stored energy.

    A loss below 0 within round-off is 0. `n` is the number of columns of the motion, `scale` the friction limit [N].

    Parameters
    ----------
    samples : (k + 1, w) array
        Samples, in the rows of `march_rows_kernels.Sample`.
    n : int
        Number of columns of the motion.
    scale : float
        Friction limit [N].
    """
    energy = samples[:, n + Sample.ENERGY]
    losses = samples[:-1, n + Sample.WORK] - np.diff(energy)
    force = np.abs(samples[:-1, n + Sample.PORTS : n + Sample.PORTS + 1]).max(axis=1, initial=scale)
    work = np.abs(samples[:-1, n + Sample.WORK])
    noise = 1e-12 * work + 1e-14 * np.maximum(energy[1:], energy[:-1])
    # The last digit of the motion.
    motion = np.abs(samples[:, : n // 2]).sum(axis=1)
    noise += 2e-15 * force * np.maximum(motion[1:], motion[:-1])
    return np.where((losses < 0) & (losses > -noise), 0.0, losses)


def make_snapshot(system: System, point_sets, motion: tuple[float, ...]) -> Snapshot:
    """Return the state of the points of the first interface.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march.
    point_sets : list of contacts.PointSet
        Points on the first port, or on the ports of the bands of a face.
    motion : tuple
        The first six fields of Snapshot.
    """
    points = system.points
    counts = [point_set.law.load.size for point_set in point_sets]

    def collect(row: Value) -> np.ndarray:
        """Return a row of the values of all points."""
        parts = []
        for p, count in enumerate(counts):
            blocks = points.values[
                points.blocks.first[p] : points.blocks.first[p + 1], row : row + WIDTH
            ]
            parts.append(blocks.flatten()[:count])
        return np.concatenate(parts)

    # The pieces at rest under the present forces; the march brings only their means over a step into equilibrium.
    forces = collect(Value.START)
    bend = np.zeros(forces.size)
    if point_sets[0].shear is not None:
        shape = np.concatenate([point_set.shear.shape for point_set in point_sets])
        bend = shape @ (forces @ shape / point_sets[0].shear.stiffness)
    moves = np.repeat(system.ports.values[Port.SLIDE, : len(counts)], counts)
    arrays = forces, collect(Value.STRETCH), bend, collect(Value.END_LOAD), moves
    vertical = float(system.flank[Flank.VERTICAL]) if system.flank.size else 0.0
    return Snapshot(*motion, *arrays, points.loads.nodal.copy(), vertical)


def march(
    modes: ModalBasis, drive, contact: Contact, cycles: float, steps_per_cycle: int, *,
    window: int = 10, travel: float = np.inf, start=None, frames: int = 0, keeps_samples: bool = True,
    repeats: bool = True, say=None, progress=None,
) -> Motion:  # fmt: skip
    """March a rig over the cycles of its drive.

    The march begins with the fraction of a cycle, so that the window has complete cycles. The steps of this part are
    shorter, so that they end with the part. Cycles of a periodic motion under a sine are not computed again.

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure without the contact.
    drive : core.SineDrive or another drive
        Acceleration of the base.
    contact : Contact
        Laws and loads of the points.
    cycles : float
        Number of cycles, whole or not.
    steps_per_cycle : int
        Number of whole steps per cycle.
    window : int
        Number of last cycles whose samples are all kept.
    travel : float
        Largest output [m].
    start : core.InitialState or March, optional
        Initial state, or a march that goes on under the drive.
    frames : int
        Number of snapshots in the last cycle.
    keeps_samples : bool
        Whether samples from before the window are kept.
    repeats : bool
        Whether a periodic motion is not computed again.
    say, progress : callable, optional
        Callbacks for a line of text and for the completed fraction.

    Raises
    ------
    Missing
        If lists of bonds become too long.
    """
    load_kernels(contact, say)
    if isinstance(start, March):
        run = start.fork(drive)
        run.reset_balance()
    else:
        run = March(modes, drive, contact, steps_per_cycle, travel, start)

    # The fraction of a cycle has the next larger number of steps, all of the same duration.
    part = cycles * steps_per_cycle % steps_per_cycle
    run.n_first = max(ceil(part - WHOLE_CYCLE_TOL * steps_per_cycle), 0)
    n_steps = run.n_first + round(cycles - part / steps_per_cycle) * steps_per_cycle
    whole_step = run.first_step = drive.period / steps_per_cycle
    if run.n_first and abs(run.n_first - part) > WHOLE_CYCLE_TOL:
        run.first_step = whole_step * part / run.n_first
        run.set_step(run.first_step)
    record = Record(run, n_steps, min(window * steps_per_cycle, n_steps), keeps_samples)
    saved = checkpoint.open_checkpoint(run, record, (n_steps, steps_per_cycle, window, frames))
    can_repeat = (
        repeats
        and isinstance(drive, SineDrive)
        and contact.load is None
        and not run.system.options.has_lists
    )

    # Whole cycles at a time, except for the fraction at the start.
    while run.done < n_steps and run.outcome is None:
        if run.done == run.n_first and run.step != whole_step:
            run.set_step(whole_step)
        n_left = n_steps - run.done
        n_early = n_left - record.n_window
        size = n_left % steps_per_cycle or steps_per_cycle
        if size == steps_per_cycle and n_early > steps_per_cycle:
            most = min(MAX_CYCLES_AT_ONCE, MAX_STEPS_AT_ONCE // steps_per_cycle)
            size *= max(1, min(most, n_early // steps_per_cycle))
        if run.done < run.n_first:
            size = run.n_first

        # Sums of this part, which copies of it continue. The last part of all has the snapshots.
        totals = run.system.totals.copy()
        is_last = size == n_left
        record.add(*advance_with_frames(run, size, frames if is_last else 0))

        # If the march is where it was a part before, all parts up to the window are copies of the last one. State and
        # memory are compared, relative to the largest motion of the part and to the memory itself.
        count = (n_steps - record.n_window - run.done) // size
        state = run.system.state[0]
        memory = np.concatenate(
            [run.system.points.memory.ravel(), run.system.points.pieces.shear[Shear.VALUE]]
        )
        now = np.concatenate([state, memory])
        if can_repeat and count > 0 and record.before.size == now.size:
            largest = np.abs(record.last[:, : state.size]).max(axis=0)
            scale = np.concatenate([largest, np.abs(memory)])
            if (np.abs(now - record.before) <= SAME_CYCLE * scale).all():
                record.repeat(count)
                run.done += count * size
                run.system.totals[REPEATED] += count * (run.system.totals - totals)[REPEATED]

        record.before = now if size % steps_per_cycle == 0 else np.zeros(0)
        if run.done < n_steps:
            saved.write_if_due(run, record)
        if progress is not None:
            progress(run.done / n_steps)

    run.check_steps()
    return record.make_motion()


def advance_with_frames(run: March, size: int, frames: int) -> tuple[int, np.ndarray, list]:
    """March over a number of steps, with snapshots at the ends of equal parts.

    Returns the number of the first step, the samples and the snapshots.

    Parameters
    ----------
    run : March
        March, which goes on.
    size : int
        Number of steps.
    frames : int
        Number of snapshots.
    """
    first = run.done
    parts = []
    snapshots = []
    n_parts = min(max(frames, 1), size)
    for begin, end in pairwise(np.linspace(0, size, n_parts + 1).round().astype(int)):
        parts.append(run.advance(int(end - begin)))
        if frames:
            snapshots.append(run.take_snapshot(parts[-1][-1]))
        if run.outcome is not None:
            break
    rows = [part[:-1] for part in parts[:-1]]
    return first, np.concatenate([*rows, parts[-1]]), snapshots


class Record:
    """Samples of a march: all of the window at its end, and some of each earlier cycle.

    A row is a sample, the number of its step and friction work, dissipated and created energy up to it [J].

    - run, n_steps, n_window: March, its number of steps, and that of the window
    - keeps_samples: whether rows from before the window are kept
    - early: rows (k, w) from before the last parts, at equal distances
    - last, recent: rows of the last part, and of the last parts, which contain the window
    - extremes, phasors: of the output in each cycle
    - energies (5,), change (5,): sums up to the last sample, and over the last part [J], see `Energy`
    - snapshots: of the last cycle
    - stride: distance of the samples of earlier cycles
    - before: state and memory at the end of the part before the last, if both have whole cycles, or (0,) without such a
      part
    """

    def __init__(self, run: March, n_steps: int, n_window: int, keeps_samples: bool):
        self.run = run
        self.n_steps = n_steps
        self.n_window = n_window
        self.keeps_samples = keeps_samples
        self.early = []
        self.last = None
        self.recent = []
        self.extremes = []
        self.phasors = []
        self.energies = np.zeros(len(Energy))
        self.change = np.zeros(len(Energy))
        self.snapshots = []
        self.before = np.zeros(0)
        # The distance of early samples divides a cycle, so that each one begins with a sample.
        longest = max(1, run.steps // MAX_EARLY_SAMPLES_PER_CYCLE)
        self.stride = max(k for k in range(1, longest + 1) if run.steps % k == 0)

    def add(self, first: int, samples, snapshots=()) -> None:
        """Add the samples (k + 1, w) from the step `first` on.

        Parameters
        ----------
        first : int
            Number of the first step.
        samples : (k + 1, w) array
            Samples of the steps and of the end.
        snapshots : sequence of Snapshot
            Snapshots of the steps.
        """
        run = self.run
        n = 2 * run.modes.omega.size
        count = len(samples) - 1
        losses = split_losses(samples, n, run.system.options.scale)
        # Only lists of bonds can create energy; of other laws a loss below 0 is an error of the step.
        created = np.maximum(-losses, 0) * run.system.options.has_lists
        works = samples[:-1, n + Sample.WORK]
        sampled = run.find_sampled_works(samples)
        steps = np.stack([works, losses + created, created, sampled, np.abs(works)], axis=1)
        energies = self.energies + np.pad(np.cumsum(steps, axis=0), ((1, 0), (0, 0)))
        numbers = first + np.arange(count + 1.0)[:, None]
        self.last = np.hstack([samples, numbers, energies[:, : Energy.SAMPLED]])
        self._keep(self.last)
        self.change = energies[-1] - self.energies
        self.energies = energies[-1]
        self.snapshots = list(snapshots)

        # Extremes and phasor (2/n times the sum of x exp(-i phase) over n samples) of each cycle; the first and the last one
        # may be a part of a cycle.
        output = samples[:, : n // 2] @ run.modes.output
        speed = samples[:, n // 2 : n] @ run.modes.output
        begins = np.arange(0, max(count, 1), run.steps)
        ends = np.minimum(begins + run.steps, count)
        reversals = find_reversal_steps(np.arange(count + 1.0), output, run.step * speed)
        extremes = []
        for extreme in (np.minimum, np.maximum):
            values = extreme(extreme.reduceat(output, begins), output[ends])
            extreme.at(values, reversals.step // run.steps, reversals.position)
            extremes.append(values)
        self.extremes.extend(np.transpose(extremes))
        phase = (first + np.arange(max(count, 1))) % run.steps / run.steps
        sums = np.add.reduceat(output[: phase.size] * np.exp(-2j * np.pi * phase), begins)
        self.phasors.extend(2 * (ends > begins) / np.maximum(ends - begins, 1) * sums)

    def _keep(self, part: np.ndarray) -> None:
        """Add a part to the rows that are kept.

        All rows of the parts within a window of the last row stay. Of older parts only rows at equal distances stay, or
        none.
        """
        self.recent.append(part)
        window_start = part[-1, NUMBER] - self.n_window
        while len(self.recent) > 1 and self.recent[1][0, NUMBER] <= window_start:
            rows = self.recent.pop(0)
            if self.keeps_samples:
                self.early.append(rows[: -1 : self.stride])
        # Every second sample is kept if there are too many; a cycle then need not begin with one.
        if sum(map(len, self.early)) > drive_sizes.MAX_EARLY_SAMPLES:
            self.early = [np.concatenate(self.early)[::2]]
            self.stride *= 2

    def repeat(self, count: int) -> None:
        """Append copies of the last part of a motion that repeats, instead of computing its next cycles.

        In each copy the step numbers and the energies continue from those of the part before it.

        Parameters
        ----------
        count : int
            Number of copies.
        """
        n_cycles = (len(self.last) - 1) // self.run.steps
        change = np.zeros(self.last.shape[1])
        change[NUMBER:] = self.last[-1, NUMBER:] - self.last[0, NUMBER:]
        for k in range(1, count + 1):
            self._keep(self.last + k * change)
        self.energies = self.energies + count * self.change
        self.extremes += count * self.extremes[-n_cycles:]
        self.phasors += count * self.phasors[-n_cycles:]

    def make_motion(self) -> Motion:
        """Return the record of a finished march."""
        # The last row of a part is the first of the next one.
        run = self.run
        parts = [part[:-1] for part in self.recent]
        rows = np.concatenate([*self.early, *parts, self.last[-1:]])
        if not self.keeps_samples:
            rows = rows[rows[:, NUMBER] >= run.done - self.n_window]

        # The last n_window steps are the window of the measures
        in_window = rows[:, NUMBER] >= run.done - self.n_window
        response = make_histories(run, rows)
        n = 2 * run.modes.omega.size
        window_rows = rows[in_window][:-1]
        has_interface = bool(run.contact.point_sets)
        return Motion(
            response,
            response.select(in_window),
            window_rows[:, n + Sample.PORTS + 2] if has_interface else np.zeros(len(window_rows)),
            float(window_rows[:, n + Sample.WORK].sum()),
            np.array(self.extremes),
            np.array(self.phasors),
            run.find_ledger(self.last[-1], self.energies),
            run.outcome,
            run.message,
            (run.done + run.shift) / run.steps,
            self.snapshots,
            run,
        )


def make_histories(run: March, rows) -> Response:
    """Return rows (k, w) of a record as histories.

    `extra` has the energies: friction work, stored, dissipated and created energy [J]; slides, slide rates, forces and
    slips (k, i) of several interfaces; load, moment and energy of the contact, heave and pitch of a contact that moves.

    Parameters
    ----------
    run : March
        March that was run.
    rows : (k, w) array
        Rows of a record (`Record`).
    """
    modes = run.modes
    contact = run.contact
    time = run.find_times(rows[:, NUMBER])
    n = modes.omega.size

    # Columns of a row: coordinates, rates, energies and loads (`Sample`), then force, slip and mean force of each port.
    z = rows[:, :n]
    rate = rows[:, n : 2 * n]
    first = 2 * n + Sample.PORTS
    sets = contact.point_sets
    columns = rows[:, first : first + N_PORT_COLUMNS * len(sets)]
    columns = columns.reshape(len(rows), len(sets), N_PORT_COLUMNS)
    port_rows = np.array([point_set.row for point_set in sets], float).reshape(len(sets), n)

    # Forces on the modal coordinates, energies, and the state of the normal contact.
    push = run.drive.values(time)
    forces = columns[..., 0]
    pull = forces @ port_rows
    energies = rows[:, NUMBER + 1 :].T
    stored = rows[:, 2 * n + Sample.ENERGY]
    extra = {"ledger": np.insert(energies, Energy.DISSIPATED, stored, axis=0)}
    press = rows[:, 2 * n + Sample.LOAD : 2 * n + Sample.PITCH + 1]
    if contact.press is not None or contact.load is not None:
        extra |= dict(zip(PRESS_COLUMNS, press.T))
    if contact.press is not None:
        # Less load accelerates the holder towards the contact.
        change = press[:, :2] - [contact.press.sets.load, contact.press.sets.moment]
        pull = pull - change @ np.array([contact.press.heave, contact.press.pitch])

    # Relative displacement and velocity of each port; several interfaces have histories of their own.
    slides = z @ port_rows.T
    rates = rate @ port_rows.T
    is_interface = np.array([not point_set.is_spring for point_set in sets], bool)
    interfaces = [part[:, is_interface] for part in (slides, rates, forces, columns[..., 1])]
    if is_interface.any() and not is_interface.all():
        extra |= dict(zip(INTERFACE_HISTORIES, interfaces))
    grooves = contact.grooves
    if grooves is not None and grooves.lifted_mass:
        sliding = find_accelerations(modes, push, z, rate, pull) @ modes.slide
        motion = slides[:, 0], rates[:, 0], sliding
        load = contact.preload if contact.load is None else contact.load(time)
        extra["normal_load"] = load + grooves.lifted_mass * grooves.find_lift(*motion)

    return make_response(modes, run.drive, push, (time, z, rate), pull, interfaces, extra)
