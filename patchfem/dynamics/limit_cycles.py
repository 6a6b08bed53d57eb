"""Limit cycles of modes with negative damping and friction, in the absence of a drive signal.

Friction of at most F dissipates up to 4 F A in a cycle of amplitude A, and a damping c < 0 supplies pi |c|
omega A^2. Where both are equal the motion is periodic: one mode under Coulomb friction at A = 4 F/(pi
|c| omega), to first order in the damping (den Hartog's balance). Beyond the largest of these
amplitudes friction no longer bounds the motion: flutter. Below it the motion decays, to rest or to
a smaller limit cycle that is stable.

`find_relay_cycles` is exact for rigid friction, which is a relay of the sliding velocity (Tsypkin
1984, ch. 6); `find_balance_cycles` applies to every law of harmonic balance: a limit cycle is a motion of
`harmonic.backbone` whose damping is 0.
"""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq, newton

from ..core import ModalBasis, NotConverged
from .harmonic.backbone import FreeBalance, find_free_motions
from .harmonic.equations import HarmonicBalance
from .harmonic.forces import LawGroup
from .harmonic.series import half_range

# Number of samples of a cycle for its amplitude; with cubics between
# samples the error is negligible.
N_SAMPLES = 4096
# Number of amplitudes at which the damping of a free motion is
# evaluated to bracket its sign changes.
N_AMPLITUDES = 48
# Smallest of these amplitudes, relative to the amplitude 4 F/(pi |c|
# omega) of den Hartog's balance.
MIN_CYCLE_RATIO = 1e-6
# Largest of these amplitudes, relative to the same amplitude.
MAX_CYCLE_RATIO = 4.0
# Smallest relative amplitude if the free motions in micro-slip cannot be computed.
MIN_SLIDING_RATIO = 0.02
# Number of amplitudes if the free motions in micro-slip cannot be computed.
N_SLIDING_AMPLITUDES = 16
NOT_FOLLOWED_MESSAGE = (
    "limit cycles are looked for among free motions of rising amplitude, and these could not be followed up to the "
    "amplitude at which friction dissipates what the mode gains"
)
# Relative error of an amplitude due to round-off and the tolerances of the solvers.
LIMIT_CYCLE_TOL = 1e-9
# Largest velocity at a reversal that counts as zero, times the half
# period and relative to the slide.
REST_TOL = 1e-8
# Largest condition number of the eigenvectors of modes; round-off of a motion is then below LIMIT_CYCLE_TOL.
MAX_MODES_CONDITION = 1e6
CRITICAL_CHANGE = 1e-10  # relative change of the damping that separates the eigenvectors
MAX_SECANT_STEPS = 12  # largest number of secant steps for the damping that balances an amplitude
# Largest damping ratio of friction by den Hartog's balance; above it friction is at least 3 times
# the elastic force at the reversal, so the interface sticks there.
MAX_FIRST_RATIO = 2.0
# Number of harmonics of the first solution; a second solution with
# twice as many estimates its error.
N_HARMONICS = 9


class LimitCycle(NamedTuple):
    """Limit cycle of a self-excited mode: amplitude, frequency and stability.

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
    """Estimate the limit-cycle amplitude [m] of a modal coordinate by den Hartog's energy balance.

    It is 4 F s/(pi |d| omega m).

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure without the contact.
    row : ndarray
        (n,) slide per coordinate.
    limit : float
        Friction force F [N].
    mode : int
        Index of the coordinate, whose damping d is negative.

    Returns
    -------
    float
    """
    gives = -modes.damping_matrix[mode, mode] * modes.omega[mode] * modes.mass
    return 4 * limit * abs(row[mode]) / (np.pi * gives)


def find_relay_cycles(
    modes: ModalBasis, row, slip_force: float, stick_force: float
) -> list[LimitCycle]:
    """Find the limit cycles under rigid friction in which the interface never sticks.

    Between two reversals the friction force is constant, so that the state y = (z, z') obeys y' = A (y - e), where e is
    the state of rest under this force. After half a period T/2 the state must be the opposite one, exp(A T/2) (y - e) + e
    = -y, which has one solution y for each T. The limit cycles are the roots T/2 at which this y has no velocity at the
    interface. In addition, the interface must slide in one direction in between, and at the reversal it must need more
    than the static friction to stick.

    Parameters
    ----------
    modes : ModalBasis
        Modes, none of which is rigid.
    row : ndarray
        (n,) slide per coordinate.
    slip_force, stick_force : float
        Kinetic and static friction force [N].

    Returns
    -------
    list of LimitCycle
        In increasing amplitude.
    """
    relay = _Relay(modes, row, slip_force, stick_force)
    cycles = []
    for mode in find_unstable_modes(modes):
        cycles += relay.find_cycles(mode)
    return sorted(cycles)


class _Relay:
    """Modes with rigid friction on a row, whose states y = (z, z') obey y' = A (y - e) between two reversals.

    Parameters
    ----------
    modes : ModalBasis
        Modes, none of which is rigid.
    row : ndarray
        (n,) slide per coordinate.
    slip_force, stick_force : float
        Kinetic and static friction force [N].
    """

    def __init__(self, modes: ModalBasis, row, slip_force: float, stick_force: float):
        n = modes.omega.size
        self.modes = modes
        self.row = np.asarray(row, float)
        self.stick_force = stick_force
        rest = np.append(row * slip_force / (modes.mass * modes.omega**2), np.zeros(n))

        # Both eigenvectors of a critically damped mode are equal; with a little more damping they differ.
        for change in (0.0, CRITICAL_CHANGE):
            damping = (1 + change) * modes.damping_matrix
            self.matrix = np.block(
                [[np.zeros((n, n)), np.eye(n)], [-np.diag(modes.omega**2), -damping]]
            )
            self.rates, self.vectors = np.linalg.eig(self.matrix)
            scaled = self.vectors * np.append(modes.omega, np.ones(n))[:, None]
            if np.linalg.cond(scaled) <= MAX_MODES_CONDITION:
                break
        # Parts of the state of rest e in the eigenvectors
        self.rest = np.linalg.solve(self.vectors, rest)

    def find_reversals(self, half_periods) -> np.ndarray:
        """Return the parts (2 n, k) of states from which the motion goes to their opposites in half periods (k,) [s].

        With E = exp(A T/2) and the state of rest e, E (y - e) + e = -y, so that y = tanh(A T/4) e.
        """
        return np.tanh(np.outer(self.rates, half_periods) / 2) * self.rest[:, None]

    def find_reversal_speeds(self, half_periods) -> np.ndarray:
        """Return the velocities (k,) of the slide at these states, times the half period and divided by the slide [1]."""
        n = self.row.size
        states = (self.vectors @ self.find_reversals(half_periods)).real
        slides = np.abs(self.row) @ np.abs(states[:n])
        return self.row @ states[n:] * half_periods / np.maximum(slides, 1e-300)

    def find_cycles(self, mode: int) -> list[LimitCycle]:
        """Return the limit cycles whose frequency is close to that of a mode."""
        half_periods = np.pi / self.modes.omega[mode] * np.geomspace(0.6, 1.7, 400)
        speeds = self.find_reversal_speeds(half_periods)

        def find_speed(half_period: float) -> float:
            """Return the velocity of the slide at the reversal for a half period [s], as `find_reversal_speeds`."""
            return float(self.find_reversal_speeds(np.array([half_period]))[0])

        cycles = []
        for k in np.flatnonzero(speeds[:-1] * speeds[1:] <= 0):
            half_period = brentq(find_speed, *half_periods[k : k + 2], xtol=1e-16, rtol=1e-14)
            # Where an undamped mode is in resonance, the interface does not stop at the reversal.
            if abs(find_speed(half_period)) < REST_TOL:
                cycles.append(self.make_cycle(half_period))
        return [cycle for cycle in cycles if cycle is not None]

    def make_cycle(self, half_period: float) -> LimitCycle | None:
        """Return the limit cycle that has a given half period [s].

        The result is None if the interface reverses within the half period, or if the static friction holds it.
        """
        row = self.row
        n = row.size
        output = self.modes.output
        times = np.linspace(0, half_period, N_SAMPLES // 2 + 1)
        deviation = self.find_reversals([half_period])[:, 0] - self.rest
        path = (deviation * np.exp(np.outer(times, self.rates)) + self.rest) @ self.vectors.T
        path = path.real

        # The slide is falling, and at its start the interface needs a force -m a to stay at rest.
        speeds = path[:, n:] @ row
        slide = float(np.abs(row) @ np.abs(path[0, :n]))
        hold = -self.modes.mass * (self.matrix @ path[0])[n:] @ row / (row @ row)
        if speeds[1:-1].max() > 1e-9 * slide / half_period or hold <= self.stick_force:
            return None

        # Largest magnitude of the cubics through the samples of the output and of its velocity.
        curve = CubicHermiteSpline(times, path[:, :n] @ output, path[:, n:] @ output)
        extremes = curve(np.append(times, curve.derivative().roots(extrapolate=False)))
        amplitude = float(np.nanmax(np.abs(extremes)))

        # A time shift of the reversal absorbs part of a perturbation, so the map is from reversal to reversal.
        growth = np.exp(half_period * self.rates)
        speed = (self.vectors @ (self.rates * growth * deviation)).real
        step = ((self.vectors * growth) @ np.linalg.inv(self.vectors)).real
        face = np.append(np.zeros(n), row)
        reversal_map = step - np.outer(speed, face @ step) / (face @ speed)
        is_stable = bool(np.abs(np.linalg.eigvals(reversal_map)).max() < 1)
        return LimitCycle(amplitude, LIMIT_CYCLE_TOL * amplitude, np.pi / half_period, is_stable)


def trace_relay_backbone(
    modes: ModalBasis, row, forces: tuple[float, float], amplitudes, mode: int
) -> list[tuple[LimitCycle, float] | None]:
    """Compute the backbone of a mode under rigid friction at prescribed amplitudes.

    A damping -g of every coordinate sustains the motion of `mode` (extended periodic motion: Krack
    2015); its ratio is g/(2 omega).

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure without the contact.
    row : ndarray
        (n,) slide per coordinate.
    forces : tuple
        Kinetic and static friction [N].
    amplitudes : array_like
        (k,) amplitudes [m].
    mode : int
        Index of the coordinate of the mode.

    Returns
    -------
    list
        (LimitCycle, damping ratio) at each amplitude, or None if the interface would stick.
    """
    modal_rate = float(modes.damping_matrix[mode, mode])

    def solve_cycle(log_rate: float) -> LimitCycle:
        """Return the cycle under a damping of all coordinates, or raise NotConverged if the interface would stick."""
        added = (modal_rate + np.exp(log_rate)) * np.eye(modes.omega.size)
        sustained = replace(modes, damping=modes.damping_matrix - added)
        cycles = _Relay(sustained, row, *forces).find_cycles(mode)
        cycles = [cycle for cycle in cycles if cycle.amplitude > 0]
        if not cycles:
            raise NotConverged("the interface sticks at its reversals")
        return min(cycles, key=lambda cycle: abs(cycle.omega - modes.omega[mode]))

    def find_motion(amplitude: float) -> tuple | None:
        """Return the cycle of an amplitude [m] and its damping ratio."""
        # The first guess is den Hartog's balance.
        lost = 4 * forces[0] * abs(row[mode] * modes.output[mode])
        rate = lost / (np.pi * modes.mass * modes.omega[mode] * amplitude)
        if not 0 < rate <= 2 * MAX_FIRST_RATIO * modes.omega[mode]:
            return None
        first = float(np.log(rate))
        try:
            log_rate = newton(
                lambda log_rate: np.log(solve_cycle(log_rate).amplitude / amplitude),
                first,
                x1=first + 0.01,
                tol=LIMIT_CYCLE_TOL,
                maxiter=MAX_SECANT_STEPS,
            )
            cycle = solve_cycle(log_rate)
        except (NotConverged, RuntimeError):
            return None
        return cycle, float((modal_rate + np.exp(log_rate)) / (2 * cycle.omega))

    return [find_motion(float(amplitude)) for amplitude in amplitudes]


def find_balance_cycles(
    modes: ModalBasis, group: LawGroup, row, limit: float
) -> tuple[list[LimitCycle], float]:
    """Find the limit cycles of modes with one friction interface by harmonic balance.

    Each is solved again with twice the harmonics and samples. A law whose force decreases with the slide may have no free
    motion in micro-slip; the backbone then starts where the interface slides, at the mode without
    friction.

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure without the contact.
    group : LawGroup
        Law of the interface.
    row : ndarray
        (n,) slide per coordinate.
    limit : float
        Largest friction [N].

    Returns
    -------
    cycles : list of LimitCycle
    min_amplitude : float
        Smallest amplitude of the output that was examined [m]; 0 if all were.

    Raises
    ------
    NotConverged
        If no free motion is found from either start.
    """
    cycles = []
    min_amplitude = 0.0
    for mode in find_unstable_modes(modes):
        if limit * abs(row[mode]) > 0:
            mode_cycles, min_mode_amplitude = _find_mode_cycles(
                modes, group, int(mode), estimate_amplitude(modes, row, limit, mode)
            )
            cycles = cycles + mode_cycles
            min_amplitude = max(min_amplitude, min_mode_amplitude * abs(modes.output[mode]))
    return sorted(cycles), min_amplitude


def _find_mode_cycles(
    modes: ModalBasis, group: LawGroup, mode: int, size: float
) -> tuple[list[LimitCycle], float]:
    """Return the limit cycles of one mode and the smallest amplitude [m] that was examined.

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure without the contact.
    group : LawGroup
        Law of the interface.
    mode : int
        Index of the coordinate of the mode.
    size : float
        Estimated amplitude of the coordinate [m]. The examined range of amplitudes is relative to it.
    """
    stuck_mode = modes.compute_stuck_mode(group.rows, group.stiffness(), mode)
    free_mode = (modes.omega[mode], np.eye(modes.omega.size)[mode])

    # The path begins with the sticking contact, or with the sliding one if that fails.
    paths = (
        (np.geomspace(MIN_CYCLE_RATIO, MAX_CYCLE_RATIO, N_AMPLITUDES), stuck_mode, 0.0),
        (
            np.geomspace(MIN_SLIDING_RATIO, MAX_CYCLE_RATIO, N_SLIDING_AMPLITUDES),
            free_mode,
            MIN_SLIDING_RATIO * size,
        ),
    )

    for ratios, start, min_amplitude in paths:
        found = [
            _find_undamped_motions(modes, group, mode, (size * ratios, start), harmonics)
            for harmonics in (N_HARMONICS, 2 * N_HARMONICS + 1)
        ]
        if None in found:
            continue

        coarse, fine = found
        if len(coarse) != len(fine):
            raise NotConverged(
                f"{len(coarse)} limit cycles were found with {N_HARMONICS} harmonics but {len(fine)} limit "
                f"cycles with {2 * N_HARMONICS + 1} harmonics"
            )

        # The change with the number of harmonics bounds the error.
        cycles = []
        for other, cycle in zip(coarse, fine):
            change = abs(other.amplitude - cycle.amplitude)
            cycles.append(cycle._replace(error=2 * change + LIMIT_CYCLE_TOL * cycle.amplitude))
        return cycles, min_amplitude

    raise NotConverged(NOT_FOLLOWED_MESSAGE)


def _find_undamped_motions(
    modes: ModalBasis,
    group: LawGroup,
    mode: int,
    path: tuple[np.ndarray, tuple[float, np.ndarray]],
    harmonics: int,
) -> list[LimitCycle] | None:
    """Find the limit cycles of a mode, which are its free motions without damping.

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure without the contact.
    group : LawGroup
        Law of the interface.
    mode : int
        Index of the coordinate of the mode.
    path : tuple
        Amplitudes (k,) [m], and the frequency [rad/s] and the shape (n,) of the first motion.
    harmonics : int
        Number of harmonics.

    Returns
    -------
    list of LimitCycle or None
        None if free motions are not found at all amplitudes.
    """
    amplitudes, start = path
    samples = group.samples_for(harmonics, np.abs(group.rows @ start[1]) * amplitudes[-1])
    equations = FreeBalance(HarmonicBalance(modes, group, samples), mode, harmonics)
    motions = find_free_motions(equations, amplitudes, mode=start)
    if None in motions:
        return None

    # Where the damping changes its sign, a motion without damping lies between two others.
    cycles = []
    for low, high in pairwise(motions):
        if np.sign(low.motion.zeta) * np.sign(high.motion.zeta) < 0:
            share = low.motion.zeta / (low.motion.zeta - high.motion.zeta)
            guess = low.unknowns + share * (high.unknowns - low.unknowns)
            motion = equations.solve(guess, None)[1]
            amplitude = half_range(motion.modal @ modes.output)
            cycles.append(LimitCycle(amplitude, 0.0, motion.omega, high.motion.zeta > 0))
    return cycles
