"""Periodic motions of a mode without a drive, by shooting: backbones and limit cycles.

z'' + (D - 2 zeta omega) z' + Omega^2 z + rows^T F/m = 0 has, for every amplitude of the output, one periodic motion of a
mode with its own omega and zeta. The negative damping of all coordinates supplies what friction and dampers take, so
that zeta is the loss of a cycle over 8 pi times the mean kinetic energy, as in a slow free decay (extended periodic
motion: Krack, Comput. Struct. 154, 59, 2015). With one mode that moves as a sine of amplitude A and slide s this is
omega^2 = omega_0^2 + s^2 K_eq/m and zeta = zeta_0 omega_0/omega + loss/(2 pi m omega^2 A^2), where K_eq and the loss are
those of the friction loop. A limit cycle has zeta = 0. In a test of phase resonance a force at the output, in phase with
its velocity, takes the place of the negative damping.

Loads are constant, and all forces change their sign with the motion, so that its second half period is the first one
with the opposite sign. The map is that of half a period, whose end is given the opposite sign. Its derivatives are the
square root of those of a period, which the negative damping multiplies by up to exp(4 pi zeta).

The unknowns are the state at phase 0, the frequency, and the damping or the force. A period begins where the
fundamental of the output vanishes and rises, far from the reversals of the output.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain, pairwise
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ..core import ModalBasis, NotConverged, PatchfemError
from .cases import MIN_STEPS, Case, Options, UndrivenRig, make_rig, make_start
from .drives import make_tones
from .laws import is_rigid
from .measures import split_integrals
from .periodic import MAX_STABLE_MULTIPLIER, MIN_STOP, copy_state
from .periodic_curves import N_FIRST, ExtendedShooting
from .quasi_static import find_static_motions
from .records import (
    Clock,
    Cycle,
    Memory,
    Mode,
    Setting,
    State,
    Window,
)
from .runs import COARSE, COARSE_STEP, ERROR_FLOOR, estimate_error, run_case

MAX_STEPS = 1e5  # steps of the engine in the first periods of the search for a motion
# Largest changes of the two further unknowns in a Newton step: frequency and rate, relative to the frequency
LONGEST_STEPS = np.array([0.3, 0.6])
RATE_SCALE = 0.1  # magnitude of the rate 2 zeta omega, relative to the frequency
# Amplitudes of quasi-static motions that are tried as starts, relative to that of the motion
STATIC_RATIOS = (1.0, 0.5, 2.0)

# Amplitudes between which limit cycles are bracketed, relative to that of den Hartog's balance
MIN_CYCLE_RATIO = 1e-6
MAX_CYCLE_RATIO = 4.0
NO_CYCLE_MESSAGE = "a limit cycle was not found between two amplitudes that enclose it"
NOT_FOLLOWED_MESSAGE = (
    "limit cycles are looked for among free motions of rising amplitude, and these could not be followed up to the "
    "amplitude at which friction dissipates what the mode gains"
)


class Accuracy(NamedTuple):
    """Tolerance of a step, and smallest number of steps per period."""

    rtol: float
    n_steps: float


FINE = Accuracy(1e-11, MIN_STEPS)
# Steps of the motions whose differences from the fine ones are the errors
ROUGH = Accuracy(COARSE * FINE.rtol, MIN_STEPS / COARSE_STEP)


def estimate_errors(values, rough, distances=0.0) -> np.ndarray:
    """Return the errors (..., k) of values of k motions from those of motions with larger steps.

    Parameters
    ----------
    values, rough : (..., k) array
        Values with FINE and with ROUGH steps.
    distances : (..., k) array
        Changes of the values by the next Newton step of the motions.
    """
    return estimate_error(values - rough, values, FINE.rtol) + distances


class FreeMotion(NamedTuple):
    """Periodic motion of a mode that a negative damping or a force at the output sustains.

    - amplitude: half the range of the output [m]
    - omega, rate: frequency [rad/s], and damping rate 2 zeta omega [1/s] or a multiple of the force
    - loss: work of friction per cycle [J]
    - distance: largest part of the next Newton step with the error of the steps, relative to the scale of each unknown;
      that of the rate is RATE_SCALE omega
    - sticks: whether an interface with rigid friction rests for a part of the cycle
    - shooting: map of a period
    - state: state at its start
    - slope: change (2 n + 2,) of the modes, divided by the amplitude, and of frequency and rate per change of the logarithm
      of the amplitude, since the motion from which this one was found
    """

    amplitude: float
    omega: float
    rate: float
    loss: float
    distance: float
    sticks: bool
    shooting: "FreeShooting"
    state: State
    slope: np.ndarray | float = 0.0

    @property
    def unknowns(self) -> np.ndarray:
        """Modal coordinates and velocities, divided by the amplitude, frequency and rate (2 n + 2,) at the start."""
        n_modes = self.shooting.motions.rig.modes.omega.size
        motion = self.state.y[: 2 * n_modes] / self.amplitude
        return np.append(motion, self.state.y[self.shooting.extra])

    @property
    def zeta(self) -> float:
        """Damping ratio of structure and friction."""
        return self.rate / (2 * self.omega)

    @property
    def force(self) -> float:
        """Amplitude [N] of the force at the output that sustains the motion."""
        return self.rate * self.shooting.unit_force

    def find_shape(self) -> np.ndarray:
        """Return the first harmonic (n,) of the modal coordinates [m] as complex amplitudes."""
        # Samples of a period for the shape of its motion
        n_samples = 64
        times = np.arange(n_samples // 2) * (self.shooting.period / n_samples)
        case = replace(self.shooting.case, samples=times)
        rows = run_case(case, start=self.shooting.load_loops(self.state)).rows
        half = rows[np.isin(rows[:, 0], times), 1 : 1 + case.rig.modes.shape[1]]
        return np.fft.rfft(np.vstack([half, -half]), axis=0)[1] * (2 / n_samples)

    def find_multiplier(self) -> float:
        """Return the magnitude of the largest Floquet multiplier besides that of a shift in time, which is 1."""
        shooting = self.shooting
        shooting.map = None
        shooting.state = shooting.advance(self.state)
        linear = shooting.differentiate(self.state)[0]
        multipliers = shooting.find_motion_multipliers(linear)
        shift = np.argmin(np.abs(multipliers - 1))
        return float(np.abs(np.delete(multipliers, shift)).max(initial=0.0)) ** 2


class LinearMotion(NamedTuple):
    """Motion of a linear mode, or of one with the secant stiffness of friction loops, from which a search begins.

    - omega: frequency [rad/s]
    - shape: (n,) modal coordinates of any size
    - zeta: damping ratio
    """

    omega: float
    shape: np.ndarray
    zeta: float = 0.0


class FreeShooting(ExtendedShooting):
    """Map of half a period of a free motion, whose further unknowns are frequency and rate.

    The rate is that of the negative damping, 2 zeta omega, or it multiplies the force. The map adds to the
    frequency the residual of the phase of the output, and to the rate that of its amplitude.

    Parameters
    ----------
    motions : FreeMotions
        Rig, accuracy and excitation.
    start : LinearMotion
        Motion from which the search begins.
    amplitude : float
        Half the range of the output [m].
    """

    def __init__(self, motions: "FreeMotions", start, amplitude: float):
        self.motions = motions
        self.start = start
        self.amplitude = amplitude
        rig = motions.rig
        modes = rig.modes
        omega, shape, zeta = start
        reach = float(modes.output @ shape)
        sizes = (amplitude, amplitude * omega)
        rtol, n_steps = motions.accuracy
        options = Options(rtol=rtol, n_steps=n_steps, max_steps=MAX_STEPS)
        signal = make_tones([], 2 * np.pi / omega)
        arrays = make_rig(modes, signal, rig.interfaces, sizes, options)

        # The force that supplies to the linear mode the power of the negative damping of rate 1
        self.unit_force = modes.mass * sizes[1] * float(shape @ shape) / reach**2
        arrays.modes[Mode.PUSH] = modes.output * self.unit_force / modes.mass

        y = make_start(arrays, rig.interfaces)
        y[modes.omega.size : 2 * modes.omega.size] = shape * sizes[1] / reach
        empty = np.zeros(0)
        super().__init__(
            Case(arrays, y, empty, empty, empty, rig.n_friction),
            (omega, 2 * zeta * omega),
            (omega, RATE_SCALE * omega),
            [one.law for one in rig.interfaces],
        )

    def find_conditions(self, before: State) -> np.ndarray:
        """Return the residuals (2,) of the phase of the fundamental of the output and of its amplitude."""
        omega = before.y[self.extra[0]]
        cycle = self.record.cycles[0]
        size = max(cycle[Cycle.MAX], -cycle[Cycle.MIN])
        cosine = 2 * omega / np.pi * cycle[Cycle.COS]
        gain = RATE_SCALE * omega * (size / self.amplitude - 1)
        return np.array([omega * cosine / self.amplitude, gain])

    def find_excess(self, step, start) -> float:
        """Return the larger one of the Newton steps of frequency and rate, relative to those of LONGEST_STEPS."""
        return float(np.abs(step[self.extra] / (LONGEST_STEPS * start[self.extra[0]])).max())

    def set_extra(self, values) -> None:
        """Give the map its frequency [rad/s] and its negative damping or force of a rate [1/s]."""
        omega, rate = values
        self.period = 2 * np.pi / omega
        settings = self.case.rig.settings.copy()
        settings[Setting.LONGEST_STEP] = self.period / self.motions.accuracy.n_steps
        settings[Setting.OMEGA] = omega
        settings[Setting.PERIOD] = self.period
        rig = self.case.rig._replace(settings=settings)
        if self.motions.is_forced:
            rig = rig._replace(tones=np.array([[rate, omega, np.pi / 2]]))
        else:
            damping = self.motions.rig.modes.damping_matrix
            rig = rig._replace(damping=damping - rate * np.eye(len(damping)))
        self.case = replace(self.case, rig=rig, ends=np.array([self.period / 2]))

    def find_ranges(self) -> np.ndarray:
        """Return the smallest and largest slide (i, 2) of the interfaces over a period [m]."""
        largest = np.abs(super().find_ranges()).max(axis=1)
        return np.column_stack([-largest, largest])

    def begin_near(self, motion: FreeMotion) -> None:
        """Begin at a motion that is extrapolated from another one over the logarithm of the amplitude."""
        ratio = self.amplitude / motion.amplitude
        unknowns = motion.unknowns + motion.slope * np.log(ratio)
        state = copy_state(motion.state)
        state.y[: unknowns.size - 2] = unknowns[:-2] * self.amplitude
        state.y[self.extra] = unknowns[-2:]
        state.memory[:, Memory.STACK :: 2] *= ratio
        state.memory[:, [Memory.SIZE, Memory.SPEED]] = 0.0
        state.clock[[Clock.OUTPUT_SIZE, Clock.OUTPUT_SPEED]] = 0.0
        self.state = state

    def solve(self) -> FreeMotion | None:
        """Find the motion, or None without convergence."""
        # A correction that leads far away ends with values that are not finite.
        with np.errstate(invalid="ignore", over="ignore"):
            try:
                return self._search()
            except NotConverged:
                return None

    def _search(self) -> FreeMotion | None:
        """Find the motion by Newton's method, or None without convergence."""
        # Change over half a period, relative to the motion, that counts as none
        change_tol = 1e-10
        # Steps of the whole search, relative to those of the first periods
        max_steps_ratio = 60.0
        # Smallest cosines between the start of the search and a motion. At a larger angle the motion is that of another
        # mode, or one whose harmonics are in resonance. A force at the output moves the modes otherwise than the free
        # motion.
        min_cosines = (0.9, 0.5)
        # The laws take the states and the memory of the loop.
        laws = slice(2 * self.motions.rig.modes.omega.size, self.extra[0])
        for _ in range(N_FIRST):
            end = self.advance(self.state)
            self.state.memory[:] = end.memory
            self.state.y[laws] = end.y[laws]

        # Motions far from that of the mode may take very many steps.
        self.limit_steps(max_steps_ratio * self.n_steps)
        guess = self.state
        found = self.find_fixed_point(change_tol)
        if found is None:
            return None
        is_near = self._find_cosine(guess, found[0]) > min_cosines[self.motions.is_forced]
        return self._describe(found[0]) if is_near else None

    def _find_cosine(self, first: State, second: State) -> float:
        """Return the cosine of the angle between two states of the modes, whose velocities are divided by the frequency."""
        n = self.motions.rig.modes.omega.size
        unit = np.append(np.ones(n), np.full(n, 1 / second.y[self.extra[0]]))
        a = first.y[: 2 * n] * unit
        b = second.y[: 2 * n] * unit
        return float(a @ b / (np.linalg.norm(a) * np.linalg.norm(b)))

    def _describe(self, state: State) -> FreeMotion:
        """Return the motion that starts with a state, from which the last half period was computed."""
        omega, rate = state.y[self.extra]
        n_friction = self.case.n_friction
        work = split_integrals(self.case, self.state.y)[:n_friction, 0]
        stuck = self.record.faces[:n_friction, Window.STUCK].copy()
        # The integration misses each unknown by round-off of its scale, also where the next step is smaller.
        distance = self.find_multipliers(state)[1] + ERROR_FLOOR * FINE.rtol
        rigid = [is_rigid(one.law.law) for one in self.motions.rig.interfaces[:n_friction]]
        return FreeMotion(
            amplitude=self.amplitude,
            omega=float(omega),
            rate=float(rate),
            loss=2 * float(work.sum()),
            distance=distance,
            sticks=bool((stuck[rigid] > MIN_STOP * self.period).any()),
            shooting=self,
            state=state,
        )


@dataclass(frozen=True, eq=False, slots=True)
class FreeMotions:
    """Free motions of a mode.

    - rig: modes and interfaces
    - mode: index of the coordinate of the mode
    - accuracy: steps of the motions
    - is_forced: whether a force at the output sustains them, instead of a negative damping of all coordinates
    """

    rig: UndrivenRig
    mode: int
    accuracy: Accuracy = FINE
    is_forced: bool = False

    def solve(self, amplitude: float, near: FreeMotion):
        """Find a motion from a similar one.

        Parameters
        ----------
        amplitude : float
            Half the range of the output [m].
        near : FreeMotion
            Similar motion.

        Returns
        -------
        FreeMotion or None
            None without convergence.
        """
        # Relative difference of amplitudes between which no slope is taken
        same_amplitude_tol = 1e-3
        shooting = FreeShooting(self, near.shooting.start, amplitude)
        shooting.begin_near(near)
        motion = shooting.solve()
        if motion is None or abs(motion.amplitude / near.amplitude - 1) < same_amplitude_tol:
            return motion
        step = np.log(motion.amplitude / near.amplitude)
        return motion._replace(slope=(motion.unknowns - near.unknowns) / step)

    def follow(self, amplitude: float, near: FreeMotion) -> FreeMotion | None:
        """Return the motion at an amplitude [m], followed from another one `near` in steps as long as possible, or None."""
        # Attempts to reach an amplitude from another one, with halved steps where no motion is found
        max_followed = 20
        # Shortest step, as a logarithm of the amplitude
        min_followed_step = 0.01
        targets = [amplitude]
        for _ in range(max_followed):
            if abs(np.log(targets[-1] / near.amplitude)) < min_followed_step and len(targets) > 1:
                return None
            motion = self.solve(targets[-1], near)
            if motion is None:
                targets.append(float(np.sqrt(near.amplitude * targets[-1])))
                continue
            # Beyond the aperiodic limit no motion is wanted, and they become hard to find.
            if motion.zeta > 1 and not self.is_forced:
                return None
            near = motion
            targets.pop()
            if not targets:
                return near
        return None

    def find(self, amplitudes, similar: list[FreeMotion | None] | None = None) -> list:
        """Find the motions at increasing amplitudes (k,) [m] of the output.

        They are followed upwards from the mode with sticking contacts, then downwards from the mode without the contact.
        Where this fails, the search begins at a quasi-static motion. A pass ends where rigid friction rests for a part of
        the cycle.

        Parameters
        ----------
        amplitudes : (k,) array
            Half the range of the output [m], increasing.
        similar : list, optional
            Similar motions at these amplitudes, or None, from which the search begins.

        Returns
        -------
        list of (FreeMotion or None)
        """
        # Amplitudes at which the mode with sticking contacts and that without them are tried as starts, relative to that
        # of the first motion
        stuck_ratios = (1e-2, 1e-4, 1e-6)
        free_ratios = (3.0, 10.0)
        amplitudes = [float(amplitude) for amplitude in amplitudes]
        out: list[FreeMotion | None] = [None] * len(amplitudes)
        if similar is not None:
            for k, near in enumerate(similar):
                out[k] = None if near is None else self.solve(amplitudes[k], near)

        rig = self.rig
        modes = rig.modes
        stuck_mode = modes.compute_stuck_mode(rig.rows, rig.stiffness, self.mode)
        free_mode = (modes.omega[self.mode], np.eye(modes.omega.size)[self.mode])

        # Each pass follows the motions from that at the amplitude before.
        upwards = range(len(amplitudes))
        passes = ((upwards, stuck_mode, stuck_ratios), (upwards[::-1], free_mode, free_ratios))
        for order, mode, ratios in passes:
            near = None
            linear = [(ratio, LinearMotion(*mode)) for ratio in (1.0, *ratios)]
            for k in order:
                if out[k] is None and near is not None:
                    out[k] = self.follow(amplitudes[k], near)
                if out[k] is None:
                    static = self._list_static_motions(amplitudes[k])
                    starts = chain(linear[:1], static, linear[1:])
                    out[k] = self._follow_linear_motion(amplitudes[k], starts)
                near = out[k]
                linear = []
                if near is not None and near.sticks:
                    break
        return out

    def _list_static_motions(self, amplitude: float) -> Iterator[tuple[float, LinearMotion]]:
        """Yield the quasi-static motions at STATIC_RATIOS of an amplitude [m], as starts."""
        # Step tolerance of the friction loops of these motions
        static_rtol = 1e-6
        amplitudes = amplitude * np.array(STATIC_RATIOS)
        row = self.rig.modes.output
        if not row[self.mode] or any(is_rigid(one.law.law) for one in self.rig.interfaces):
            return
        try:
            found = find_static_motions(self.rig, self.mode, amplitudes, row, static_rtol)
        except (NotConverged, PatchfemError):
            return
        for ratio, motion in zip(STATIC_RATIOS, found):
            if np.isfinite(motion.omega):
                yield ratio, LinearMotion(motion.omega, motion.z, motion.zeta)

    def _follow_linear_motion(self, amplitude: float, starts) -> FreeMotion | None:
        """Return the motion at an amplitude [m] that is followed from the first of `starts` that leads to one, or None.

        A start is the ratio of its amplitude to this one, and a `LinearMotion`.
        """
        for ratio, linear in starts:
            if linear.omega and self.rig.modes.output @ linear.shape:
                motion = FreeShooting(self, linear, ratio * amplitude).solve()
                if motion is not None:
                    return self.follow(amplitude, motion)
        return None


class LimitCycle(NamedTuple):
    """Limit cycle of a self-excited mode.

    - amplitude, error: half the range of the output, and its error [m]
    - omega: angular frequency [rad/s]
    - is_stable: whether perturbations decay
    """

    amplitude: float
    error: float
    omega: float
    is_stable: bool


def find_unstable_modes(modes: ModalBasis) -> np.ndarray:
    """Return the indices (k,) of the modal coordinates that have negative damping."""
    return np.flatnonzero(np.diagonal(modes.damping_matrix) < 0)


def estimate_amplitude(modes: ModalBasis, row, limit: float, mode: int) -> float:
    """Estimate the limit-cycle amplitude [m] of the output by den Hartog's energy balance, 4 F s/(pi |d| omega m).

    Friction of at most F dissipates up to 4 F A in a cycle of amplitude A, and a damping d < 0 supplies pi |d| m omega
    A^2.

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure without the contact.
    row : ndarray
        (n,) slide s per coordinate.
    limit : float
        Friction force F [N].
    mode : int
        Index of the coordinate, whose damping d is negative.
    """
    gives = -modes.damping_matrix[mode, mode] * modes.omega[mode] * modes.mass
    return 4 * limit * abs(row[mode] * modes.output[mode]) / (np.pi * gives)


def find_limit_cycles(rig: UndrivenRig, limit: float) -> tuple[list[LimitCycle], float]:
    """Find the limit cycles of modes with negative damping, whose interface slides.

    They are the free motions whose damping changes its sign over the amplitude. The friction of an interface that rests
    for a part of the cycle is not that of a sliding one, so that the motions of rigid friction are followed down to the
    amplitude at which it begins to rest.

    Parameters
    ----------
    rig : UndrivenRig
        Modes, and one friction interface.
    limit : float
        Largest friction [N].

    Returns
    -------
    cycles : list of LimitCycle
        In increasing amplitude.
    min_amplitude : float
        Smallest amplitude of the output that was examined [m]; 0 if all were.

    Raises
    ------
    NotConverged
        If no free motion is found at the largest amplitude.
    """
    # Number of amplitudes at which the damping is evaluated
    n_amplitudes = 48
    cycles = []
    min_amplitude = 0.0
    row = rig.rows[0]
    for mode in find_unstable_modes(rig.modes):
        size = estimate_amplitude(rig.modes, row, limit, mode)
        if not size > 0:
            continue
        amplitudes = size * np.geomspace(MIN_CYCLE_RATIO, MAX_CYCLE_RATIO, n_amplitudes)
        motions = FreeMotions(rig, int(mode)).find(amplitudes)
        known = [motion is not None and not motion.sticks for motion in motions]
        if not known[-1]:
            raise NotConverged(NOT_FOLLOWED_MESSAGE)

        # The motions above the last gap
        first = 0 if all(known) else len(known) - known[::-1].index(False)
        if first:
            min_amplitude = max(min_amplitude, amplitudes[first])
        for low, high in pairwise(motions[first:]):
            if np.sign(low.rate) * np.sign(high.rate) < 0:
                cycles.append(_find_cycle_between(low, high))
    return sorted(cycles), min_amplitude


def _find_cycle_between(low: FreeMotion, high: FreeMotion) -> LimitCycle:
    """Return the limit cycle between two free motions whose dampings have different signs.

    It is the free motion without damping. It is stable if the damping rises over the amplitude and no other perturbation
    of the motion grows.
    """
    # Relative error of the amplitude of a limit cycle at which its search ends
    amplitude_tol = 1e-12
    # Ratio of the amplitudes between which the slope of the damping is taken
    slope_ratio = 1.001
    known = {float(np.log(motion.amplitude)): motion for motion in (low, high)}

    def find_rate(level: float) -> float:
        """Return the damping rate [1/s] at the logarithm of an amplitude, followed from the nearest known motion."""
        if level not in known:
            near = known[min(known, key=lambda other: abs(other - level))]
            motion = near.shooting.motions.follow(float(np.exp(level)), near)
            if motion is None:
                raise NotConverged(NO_CYCLE_MESSAGE)
            known[level] = motion
        return known[level].rate

    cycle = known[brentq(find_rate, *known, xtol=amplitude_tol)]

    # An error of the rate moves its root by the ratio to the slope over the amplitude.
    motions = cycle.shooting.motions
    rough = replace(motions, accuracy=ROUGH).solve(cycle.amplitude, cycle)
    above = motions.solve(slope_ratio * cycle.amplitude, cycle)
    if rough is None or above is None:
        raise NotConverged(NO_CYCLE_MESSAGE)
    slope = (above.rate - cycle.rate) / (above.amplitude - cycle.amplitude)
    rate_error = abs(cycle.rate) + RATE_SCALE * cycle.omega * cycle.distance
    rate_error += estimate_errors(cycle.rate, rough.rate)
    error = rate_error / abs(slope) + ERROR_FLOOR * FINE.rtol * cycle.amplitude
    is_stable = high.rate > 0 and cycle.find_multiplier() < MAX_STABLE_MULTIPLIER
    return LimitCycle(cycle.amplitude, float(error), cycle.omega, is_stable)
