"""Runs of a rig without friction and nonlinear springs, by exact steps of its linear equations.

In: a Model and its Numerics. Out: a Solution whose measures are sums and extremes over the steps of
`structure.linear_motion`. No code is compiled.
"""

from dataclasses import replace

import numpy as np

from ...core import InitialState, Outcome, Response
from ...motion_measures import energy_balance, measure_acceleration
from ...response.measures import Values
from ...response.ringing import compute_stuck_vibration, select_strongest
from ...response.rows import select_names
from ...structure.drive_sizes import find_drive_omega, is_sinusoidal
from ...structure.histories import make_response
from ...structure.linear_motion import POINTS, WEIGHTS, LinearRig, Steps, interpolate
from .evaluation import EngineRun, RunEvaluator
from .sample_times import choose_sample_times
from .solution import Fields, Solution, describe_escape, find_travel

N_STEPS = 16  # steps per period of the fastest vibration; 8 of them change a measure by less than 1e-9 of its value
N_FINE = 32  # parts of a step whose ends are compared to find the extremes of its polynomial
# Distance of the largest point of a step from that of its cycle, relative to the range of the cycle, at which the largest
# value of the cycle may still lie in this step.
EXTREME_MARGIN = 0.02
N_HALVINGS = 40  # halvings of a part of a step in the search for the end of the travel
BORDER_TOL = 1e-9  # distance of two ends of steps that are one, in cycles


def run_linear(model, numerics, patch=None, frames: int = 0, say=None, progress=None) -> Solution:
    """Compute the motion of a linear rig, for one drive level after another.

    Parameters
    ----------
    model : Model
        Rig and drive, without friction.
    numerics : Numerics
        Steps, cycles and window.
    patch, frames, say : optional
        Not used; other engines need them.
    progress : callable, optional
        Callback for the completed fraction.
    """
    return LinearEvaluator(model, numerics, None).solve(0, progress, {})


class LinearEvaluator(RunEvaluator):
    """Evaluator that computes runs of a linear rig, and measures from the steps of their motions."""

    def integrate(
        self, drive, cycles: float, before: EngineRun | None, frames: int = 0, progress=None
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
        frames : int
            Not used, because there is no interface.
        progress : callable, optional
            Callback for the completed fraction.
        """
        start = self.model.rig.start if before is None else before.end
        if start is None:
            rest = np.zeros(self.model.rig.modes.omega.size)
            start = InitialState(rest, rest)
        travel = find_travel(self.model.rig)
        run = self._run(drive, cycles, start, travel)
        if run.outcome is not None:
            # Only a run with a known end has the measures and samples of its last cycles.
            run = replace(
                self._run(drive, run.cycles_done, start, np.inf),
                outcome=run.outcome,
                message=describe_escape(self.model.rig, travel),
            )
        # Measures of the whole run add up from level to level.
        for name in select_names("run"):
            if before is not None and name in before.values:
                run.values[name] += before.values[name]
        if progress is not None:
            progress(1.0)
        return run

    def _run(self, drive, cycles: float, start: InitialState, travel: float) -> EngineRun:
        """Compute a run, which ends early where the magnitude of the output exceeds `travel` [m]."""
        modes = self.model.rig.modes
        times = choose_sample_times(self.numerics, drive, cycles)
        rig = LinearRig(modes, 2 * np.pi / self.numerics.steps)
        observer = Observer(rig, drive, cycles, times.window_start)
        samples = np.unique(times.samples)
        rows = []
        for steps in rig.follow(drive, start, list_borders(drive, cycles, times.window_start)):
            observer.add(steps)
            inside = samples[(samples >= steps.times[0]) & (samples < steps.times[-1])]
            rows.append(steps.evaluate(inside))
            escape = observer.find_escape(steps, travel)
            if escape is not None:
                cycles = escape / drive.period
                break

        end = steps.states[-1]
        response = self._make_response(drive, samples, np.concatenate([*rows, end[None]]))
        n = modes.omega.size
        window = response.select(response.time >= times.window_start * (1 - 1e-15))
        return EngineRun(
            values=observer.compute_measures(),
            response=response,
            window=window,
            extremes=observer.cycles[:, :2],
            phasors=observer.find_phasors(),
            ledger=observer.energies,
            outcome=None if escape is None else Outcome.EXCEEDS_TRAVEL,
            message="",
            end=InitialState(end[:n], end[n:]),
            cycles_done=cycles,
        )

    def _make_response(self, drive, times, states) -> Response:
        """Return the histories of the states (k, 2n) at the first k of the sample times [s]."""
        modes = self.model.rig.modes
        n = modes.omega.size
        count = len(states)
        times = times[:count]
        nothing = np.zeros((count, 0))
        motion = (times, states[:, :n], states[:, n:])
        extra = {"ledger": np.zeros((4, count))}
        return make_response(
            modes,
            drive,
            drive.values(times),
            motion,
            np.zeros((count, n)),
            (nothing, nothing, nothing, nothing),
            extra,
        )

    def describe_cycles(self, run: EngineRun, drive, *, stuck: bool) -> Fields:
        """Return the measures that are sums and extremes over the steps.

        Parameters
        ----------
        run : EngineRun
        drive
            Drive of this run, which may be a single level.
        stuck : bool
            Not used, because there is no interface.
        """
        values = {name: None if np.isnan(value) else value for name, value in run.values.items()}
        if not is_sinusoidal(drive):
            values |= dict.fromkeys(select_names("sine"))
        return {"integrated": values}

    def collect_solution_fields(self, run: EngineRun, drive) -> Fields:
        """Return the free vibration after a release, by the name of its field in `Solution`; {} for other drives."""
        rig = self.model.rig
        if rig.drive.kind != "free" or run.response.time.size < 2:
            return {}
        springs = np.zeros(len(rig.modes.interfaces))
        vibration = compute_stuck_vibration(rig.modes, springs, run.response)
        return {"tail": select_strongest(vibration)} if vibration else {}


def list_borders(drive, cycles: float, window_start: float) -> np.ndarray:
    """Return the times (m,) [s] between which the steps have equal lengths.

    They are the ends of the cycles, which are counted from the end of the run, the start of the window, and the instants at
    which the formula of the drive changes.

    Parameters
    ----------
    drive : drives.DriveSignal
    cycles : float
        Number of cycles of the drive.
    window_start : float
        Start of the window [s].
    """
    end = cycles * drive.period
    breaks = [segment.start for segment in drive.segments]
    if not breaks and not getattr(drive, "tones", ()):
        breaks = list(drive.breaks)
    ends = end - drive.period * np.arange(int(cycles + BORDER_TOL) + 1)
    times = np.concatenate([[0.0, window_start], ends, breaks])
    times = np.unique(times[(times >= 0) & (times < end)])
    # Borders that differ by round-off are one.
    is_apart = np.diff(times, append=end) > BORDER_TOL * drive.period
    times = times[is_apart | (times == 0)]
    return np.append(times, end)


class Observer:
    """Sums and extremes over the steps of a linear motion.

    Parameters
    ----------
    rig : LinearRig
    drive : drives.DriveSignal
    cycles : float
        Number of cycles of the drive.
    window_start : float
        Start of the last cycles, whose measures are returned [s].

    Attributes
    ----------
    cycles : (c, 2) array
        Minimum and maximum of the output in each cycle [m].
    energies : dict
        Energies of the whole motion by name [J].
    """

    def __init__(self, rig: LinearRig, drive, cycles: float, window_start: float):
        modes = rig.modes
        # Cycles are counted from the end, as the window is; an incomplete one at the start is left out.
        n_cycles = max(1, int(cycles + BORDER_TOL))
        self.first_start = max(0.0, cycles - n_cycles) * drive.period
        self.rig = rig
        self.drive = drive
        self.window_start = window_start
        self.omega = find_drive_omega(drive)
        self.cycles = np.tile([np.inf, -np.inf], (n_cycles, 1))
        self.integrals = np.zeros(n_cycles, complex)
        self.durations = np.zeros(n_cycles)
        self.gauge = modes.output if modes.gauge is None else modes.gauge
        # Window: extremes of gauge and acceleration, duration, first and third harmonic of the acceleration
        self.extremes = np.tile([np.inf, -np.inf], (2, 1))
        self.span = 0.0
        self.harmonics = np.zeros(2, complex)
        self.start_energy = None
        self.energies = dict.fromkeys(
            ("work_in", "viscous", "power", "friction", "stored", "peak_stored", "steps"), 0.0
        )

    def add(self, steps: Steps) -> None:
        """Add steps that follow those before."""
        modes = self.rig.modes
        n = modes.omega.size
        points = steps.points
        output = points[..., :n] @ modes.output
        lengths = steps.lengths
        self._add_energies(steps)

        # Extremes and phasor of the output of each cycle
        middle = (steps.times[:-1] + steps.times[1:]) / 2
        cycle = np.floor((middle - self.first_start) / self.drive.period).astype(int)
        cycle = np.minimum(cycle, len(self.cycles) - 1)
        found, extremes = find_extremes(output, cycle)
        found, extremes = found[found >= 0], extremes[found >= 0]
        self.cycles[found, 0] = np.minimum(self.cycles[found, 0], extremes[:, 0])
        self.cycles[found, 1] = np.maximum(self.cycles[found, 1], extremes[:, 1])
        phase = np.exp(-1j * self.omega * steps.node_times)
        is_whole = cycle >= 0
        parts = lengths * ((output[:, 1:-1] * phase) @ WEIGHTS)
        np.add.at(self.integrals, cycle[is_whole], parts[is_whole])
        np.add.at(self.durations, cycle[is_whole], lengths[is_whole])

        # Window
        is_inside = middle > self.window_start
        if not is_inside.any():
            return
        rates = points[is_inside] @ self.rig.matrix[n:].T
        rates += steps.point_drive[is_inside, :, None] * self.rig.push[n:]
        acceleration = rates @ modes.output
        if self.drive.moving:
            acceleration += steps.point_drive[is_inside]
        gauge = points[is_inside][..., :n] @ self.gauge
        same = np.zeros(len(gauge), int)
        for row, values in zip(self.extremes, (gauge, acceleration)):
            _, extremes = find_extremes(values, same)
            row[0] = min(row[0], extremes[0, 0])
            row[1] = max(row[1], extremes[0, 1])
        self.span += float(lengths[is_inside].sum())
        for k, order in enumerate((1, 3)):
            part = acceleration[:, 1:-1] * phase[is_inside] ** order
            self.harmonics[k] += lengths[is_inside] @ (part @ WEIGHTS)

    def _add_energies(self, steps: Steps) -> None:
        """Add the works of the drive and of the dampers [J] in steps."""
        modes = self.rig.modes
        n = modes.omega.size
        rates = steps.node_states[..., n:]
        power = -(rates @ modes.base) * steps.node_drive
        loss = np.einsum("kjx,xy,kjy->kj", rates, modes.damping_matrix, rates)
        work = modes.mass * steps.lengths * (power @ WEIGHTS)
        states = steps.states
        stored = (states[:, n:] ** 2).sum(1) + ((modes.omega * states[:, :n]) ** 2).sum(1)
        stored *= modes.mass / 2
        if self.start_energy is None:
            self.start_energy = float(stored[0])
        energies = self.energies
        energies["work_in"] += float(work.sum())
        energies["power"] += float(np.abs(work).sum())
        energies["viscous"] += float(modes.mass * (steps.lengths @ (loss @ WEIGHTS)))
        energies["stored"] = float(stored[-1]) - self.start_energy
        energies["peak_stored"] = max(energies["peak_stored"], float(stored.max()))
        energies["steps"] += float(work.size)

    def find_escape(self, steps: Steps, travel: float) -> float | None:
        """Return the first time [s] in the steps at which the magnitude of the output exceeds `travel` [m], or None."""
        n = self.rig.modes.omega.size
        output = steps.points[..., :n] @ self.rig.modes.output
        fine = np.abs(output @ FINE.T).reshape(-1)
        beyond = np.flatnonzero(fine > travel)
        if not beyond.size:
            return None
        step, part = divmod(int(beyond[0]), N_FINE + 1)
        low, high = (
            steps.times[step] + steps.lengths[step] * np.array([max(part - 1, 0), part]) / N_FINE
        )
        for _ in range(N_HALVINGS):
            middle = (low + high) / 2
            place = steps.evaluate(np.array([middle]))[0, :n] @ self.rig.modes.output
            low, high = (low, middle) if abs(place) > travel else (middle, high)
        return high

    def find_phasors(self) -> np.ndarray:
        """Return the complex amplitude (c,) of the output at the drive frequency [m] in each cycle."""
        return 2 * self.integrals / self.durations

    def compute_measures(self) -> Values:
        """Return the measures of the window and of the whole motion by name; NaN without a value."""
        period = self.drive.period
        whole = 1.0 if self.span > period * (1 - 1e-6) else np.nan
        first, third = whole * self.harmonics
        values = {
            "relative_displacement_amplitude": np.ptp(self.extremes[0]) / 2,
            "absolute_acceleration_peak": np.abs(self.extremes[1]).max(),
            **measure_acceleration(first, third, self.span),
            "energy_balance": energy_balance(self.energies),
        }
        return {name: float(value) for name, value in values.items()}


# Matrix from the values at the points of a step to those at the ends of N_FINE equal parts of it
FINE = interpolate(POINTS, np.linspace(0.0, 1.0, N_FINE + 1))


def find_extremes(values, groups) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest and the largest value of the polynomials of groups of steps.

    Parameters
    ----------
    values : (k, p) array
        Values at the points of each step.
    groups : (k,) array of int
        Rising number of the group of each step.

    Returns
    -------
    found : (g,) array of int
        Numbers of the groups.
    extremes : (g, 2) array
        Minimum and maximum of each group.
    """
    found, first, group = np.unique(groups, return_index=True, return_inverse=True)
    extremes = np.zeros((found.size, 2))
    for column, sign in ((0, -1.0), (1, 1.0)):
        signed = sign * values
        top = signed.max(axis=1)
        highest = np.maximum.reduceat(top, first)
        lowest = np.minimum.reduceat(signed.min(axis=1), first)
        is_near = top >= (highest - EXTREME_MARGIN * (highest - lowest))[group]

        # The vertex of the parabola through the largest fine point and its neighbours
        fine = signed[is_near] @ FINE.T
        rows = np.arange(len(fine))
        middle = np.clip(fine.argmax(axis=1), 1, N_FINE - 1)
        below, at, above = (fine[rows, middle + shift] for shift in (-1, 0, 1))
        bend = 2 * at - below - above
        is_vertex = (bend > 0) & (np.abs(above - below) <= 2 * bend)
        rise = np.divide((above - below) ** 2, 8 * bend, out=np.zeros_like(at), where=is_vertex)
        peaks = np.maximum(at + rise, fine.max(axis=1))
        largest = highest.copy()
        np.maximum.at(largest, group[is_near], peaks)
        extremes[:, column] = sign * largest
    return found, extremes
