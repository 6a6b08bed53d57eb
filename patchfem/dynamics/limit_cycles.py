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
from scipy.optimize import brentq

from ..core import ModalBasis, NotConverged
from .exponentials import find_exponentials
from .harmonic.backbone import FreeBalance, find_free_motions
from .harmonic.equations import HarmonicBalance
from .harmonic.forces import LawGroup
from .harmonic.series import half_range

# Number of samples of a cycle for its amplitude; with parabolas between
# samples the error is negligible.
N_SAMPLES = 4096
# Number of amplitudes at which the damping of a free motion is
# evaluated to bracket its sign changes.
N_AMPLITUDES = 48
# Smallest of these amplitudes, relative to the amplitude 4 F/(pi |c|
# omega) of den Hartog's balance.
MIN_AMPLITUDE_RATIO = 1e-6
# Largest of these amplitudes, relative to the same amplitude.
MAX_AMPLITUDE_RATIO = 4.0
# Smallest relative amplitude if the free motions in micro-slip cannot be computed.
MIN_SLIDING_RATIO = 0.02
# Number of amplitudes if the free motions in micro-slip cannot be computed.
N_SLIDING_AMPLITUDES = 16
NOT_FOLLOWED_MESSAGE = (
    "limit cycles are looked for among free motions of rising amplitude, and these could not be followed up to the "
    "amplitude at which friction dissipates what the mode gains"
)
# Relative error of an amplitude due to round-off and the tolerances of the solvers.
AMPLITUDE_TOL = 1e-9
# Largest velocity at a reversal that counts as zero, times the half
# period and relative to the slide.
REST_TOL = 1e-8
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


def find_relay_cycles(modes: ModalBasis, row, slip_force: float, stick_force: float) -> list:
    """Find the limit cycles under rigid friction in which the interface never sticks.

    After a reversal the force is constant: y(T/2) = E (y - e) + e = -y has one y for each half
    period T/2. It is a limit cycle if the interface stops at the reversal, slides in one direction in
    between, and would need more than the static friction to stick.

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
    cycles = []
    for mode in find_unstable_modes(modes):
        cycles += _find_mode_relay_cycles(modes, row, (slip_force, stick_force), mode)
    return sorted(cycles)


def _find_mode_relay_cycles(modes: ModalBasis, row, forces: tuple, mode: int) -> list:
    """Find the limit cycles under rigid friction whose frequency is close to that of a given mode.

    forces: kinetic and static friction [N].
    """
    cycles = []
    half_periods = np.pi / modes.omega[mode] * np.geomspace(0.6, 1.7, 400)
    speed_ratios = _reversal_speed_ratios(modes, row, forces[0], half_periods)
    for k in np.flatnonzero(speed_ratios[:-1] * speed_ratios[1:] <= 0):
        half_period = brentq(
            lambda half_period: _find_reversal(modes, row, forces[0], half_period)[1],
            half_periods[k],
            half_periods[k + 1],
            xtol=1e-16,
            rtol=1e-14,
        )
        # Where an undamped mode is in resonance, the interface does not stop at the reversal.
        is_reversal = abs(_find_reversal(modes, row, forces[0], half_period)[1]) < REST_TOL
        if (
            is_reversal
            and (limit_cycle := _make_relay_cycle(modes, row, forces, half_period)) is not None
        ):
            cycles.append(limit_cycle)
    return cycles


def trace_relay_backbone(modes: ModalBasis, row, forces: tuple, amplitudes, mode: int) -> list:
    """Compute the backbone of a mode under rigid friction at prescribed amplitudes.

    A damping -g of every coordinate sustains the motion of `mode` (extended periodic motion: Krack
    2015); its ratio is g/(2 omega).

    Parameters
    ----------
    modes : ModalBasis
    row : ndarray
    forces : tuple
        Kinetic and static friction [N], see `find_relay_cycles`.
    amplitudes : array_like
        (k,) amplitudes [m].
    mode : int

    Returns
    -------
    list
        (LimitCycle, damping ratio) at each amplitude, or None if the interface would stick.
    """

    def solve_cycle(log_rate: float):
        undamped_modes = replace(
            modes,
            damping=modes.damping_matrix
            - (modal_rate + np.exp(log_rate)) * np.eye(modes.omega.size),
        )
        cycles = _find_mode_relay_cycles(undamped_modes, row, forces, mode)
        cycles = [candidate for candidate in cycles if candidate.amplitude > 0]
        return min(
            cycles, key=lambda candidate: abs(candidate.omega - modes.omega[mode]), default=None
        )

    modal_rate = float(modes.damping_matrix[mode, mode])
    rate_at_1_m = (
        4
        * forces[0]
        * abs(row[mode] * modes.output[mode])
        / (np.pi * modes.mass * modes.omega[mode])
    )
    rates = rate_at_1_m / np.asarray(amplitudes, float)
    max_rate = 2 * MAX_FIRST_RATIO * modes.omega[mode]
    dampings = [None] * len(rates)
    for k in np.flatnonzero((rates > 0) & (rates <= max_rate)):
        dampings[k] = _solve_damping(solve_cycle, float(amplitudes[k]), modal_rate, float(rates[k]))
    return dampings


def _solve_damping(
    solve_cycle, amplitude: float, modal_rate: float, friction_rate: float
) -> tuple | None:
    """Solve for the limit cycle with an amplitude [m], and its damping ratio, by the secant method.

    modal_rate: damping rate of the mode [1/s]; friction_rate: guess of the damping rate of friction [1/s].
    """
    log_rates = np.log([friction_rate, 1.01 * friction_rate])
    cycles = [solve_cycle(log_rate) for log_rate in log_rates]
    for _ in range(MAX_SECANT_STEPS):
        if None in cycles:
            return None
        log_errors = [np.log(limit_cycle.amplitude / amplitude) for limit_cycle in cycles]
        if abs(log_errors[1]) < AMPLITUDE_TOL or log_errors[0] == log_errors[1]:
            return cycles[1], float((modal_rate + np.exp(log_rates[1])) / (2 * cycles[1].omega))
        log_rates = np.array(
            [
                log_rates[1],
                log_rates[1]
                - log_errors[1] * (log_rates[1] - log_rates[0]) / (log_errors[1] - log_errors[0]),
            ]
        )
        cycles = [cycles[1], solve_cycle(log_rates[1])]
    return None


def _free_motion_matrices(modes: ModalBasis, t) -> np.ndarray:
    """Return the transition matrices (k, 2n, 2n) of the modal state (z, z') over time spans (k,)."""
    times = np.asarray(t, float)
    n = modes.omega.size
    # Velocities are divided by `scale`, so that all entries of the matrix have a similar size.
    scale = max(float(modes.omega.max()), 1 / float(times.max()))
    stiffness = -np.diag(modes.omega**2) / scale
    rates = np.block([[np.zeros((n, n)), scale * np.eye(n)], [stiffness, -modes.damping_matrix]])
    size = np.repeat([1.0, scale], n)
    return find_exponentials(rates * times[:, None, None]) * (size[:, None] / size)


def _reversal_speed_ratios(modes: ModalBasis, row, force: float, half_periods) -> np.ndarray:
    """Return dimensionless interface velocities (k,) at the reversal for assumed half periods.

    It is the velocity times the half period, divided by the slide; see `_find_reversal`.
    """
    n = modes.omega.size
    eye = np.eye(2 * modes.omega.size)
    equilibrium = np.concatenate([row * force / (modes.mass * modes.omega**2), np.zeros(n)])
    flow = _free_motion_matrices(modes, half_periods)
    y = np.einsum("kab,kb->ka", np.linalg.pinv(flow + eye, rcond=1e-14), (flow - eye) @ equilibrium)
    return y[:, n:] @ row * half_periods / np.maximum(np.abs(y[:, :n]) @ np.abs(row), 1e-300)


def _find_reversal(modes: ModalBasis, row, force: float, half_period: float) -> tuple:
    """Return the state at the reversal of a periodic motion with an assumed half period.

    Also returns the slide velocity there, times the half period and divided by the slide, and the
    equilibrium.
    half_period: assumed half period [s].
    """
    n = modes.omega.size
    eye = np.eye(2 * modes.omega.size)
    equilibrium = np.concatenate([row * force / (modes.mass * modes.omega**2), np.zeros(n)])
    flow = _free_motion_matrices(modes, [half_period])[0]
    y = np.linalg.lstsq(flow + eye, (flow - eye) @ equilibrium, rcond=None)[0]
    return (
        y,
        float(row @ y[n:]) * half_period / max(float(np.abs(row) @ np.abs(y[:n])), 1e-300),
        equilibrium,
    )


def _make_relay_cycle(
    modes: ModalBasis, row, forces: tuple, half_period: float
) -> LimitCycle | None:
    """Return the limit cycle that has a given half period [s].

    The result is None if the interface reverses or sticks within the half period.

    """
    slip_force, stick_force = forces
    n = modes.omega.size
    y, _, equilibrium = _find_reversal(modes, row, slip_force, half_period)
    times = np.linspace(0, half_period, N_SAMPLES // 2 + 1)
    path = equilibrium + _free_motion_matrices(modes, times) @ (y - equilibrium)
    rate = path[:, n:] @ row
    slide_scale = float(np.abs(row) @ np.abs(y[:n]))
    static_force = (
        -modes.mass * (modes.omega**2 * y[:n] + modes.damping_matrix @ y[n:]) @ row / (row @ row)
    )
    if rate[1:-1].max() > 1e-9 * slide_scale / half_period or -static_force <= stick_force:
        return None
    motion = path[:, :n] @ modes.output
    cycle = np.concatenate([motion, -motion[1:]])
    amplitude = _find_maximum(cycle)
    coarse_amplitude = _find_maximum(cycle[::2])
    # A time shift of the reversal absorbs part of a perturbation, so the
    # map is from reversal to reversal.
    speed = np.concatenate([path[-1, n:], _find_accelerations(modes, path[-1], row, slip_force)])
    face = np.concatenate([np.zeros(n), row])
    reversal_map = (np.eye(2 * n) - np.outer(speed, face) / (face @ speed)) @ _free_motion_matrices(
        modes, [half_period]
    )[0]
    is_stable = bool(np.abs(np.linalg.eigvals(reversal_map)).max() < 1)
    return LimitCycle(
        amplitude,
        abs(amplitude - coarse_amplitude) + AMPLITUDE_TOL * amplitude,
        np.pi / half_period,
        is_stable,
    )


def _find_accelerations(modes: ModalBasis, y, row, force: float) -> np.ndarray:
    """Return the modal accelerations (n,) in a state (2 n,), with a force [N] applied along a row."""
    n = modes.omega.size
    return row * force / modes.mass - modes.omega**2 * y[:n] - modes.damping_matrix @ y[n:]


def _find_maximum(samples) -> float:
    """Return the maximum of a sampled motion (k,), interpolated by a parabola through three samples.

    The motion changes sign after half a period.
    """
    k = int(np.argmax(samples))
    if not 0 < k < samples.size - 1:
        k = 1 if k == 0 else samples.size - 2
    a, b, c = samples[k - 1 : k + 2]
    bend = a - 2 * b + c
    return float(b - (c - a) ** 2 / (8 * bend)) if bend < 0 else float(samples.max())


def find_balance_cycles(modes: ModalBasis, group: LawGroup, row, limit: float) -> tuple:
    """Find the limit cycles of modes with one friction interface by harmonic balance.

    Each is solved again with twice the harmonics and samples. A law whose force decreases with the slide may have no free
    motion in micro-slip; the backbone then starts where the interface slides, at the mode without
    friction.

    Parameters
    ----------
    modes : ModalBasis
    group : LawGroup
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


def _find_mode_cycles(modes: ModalBasis, group: LawGroup, mode: int, size: float) -> tuple:
    """Return the limit cycles of one mode and the smallest amplitude [m] that was examined."""
    stuck_mode = modes.compute_stuck_mode(group.rows, group.stiffness(), mode)
    free_mode = (modes.omega[mode], np.eye(modes.omega.size)[mode])
    paths = (
        (np.geomspace(MIN_AMPLITUDE_RATIO, MAX_AMPLITUDE_RATIO, N_AMPLITUDES), stuck_mode, 0.0),
        (
            np.geomspace(MIN_SLIDING_RATIO, MAX_AMPLITUDE_RATIO, N_SLIDING_AMPLITUDES),
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
        cycles = []
        for other, cycle in zip(coarse, fine):
            change = abs(other.amplitude - cycle.amplitude)
            cycles.append(cycle._replace(error=2 * change + AMPLITUDE_TOL * cycle.amplitude))
        return cycles, min_amplitude
    raise NotConverged(NOT_FOLLOWED_MESSAGE)


def _find_undamped_motions(
    modes: ModalBasis, group: LawGroup, mode: int, path: tuple, harmonics: int
) -> list | None:
    """Find the limit cycles of a mode: free motions without damping; None if free motions are not found.

    path: amplitudes (k,) [m], and frequency [rad/s] and shape (n,) of the first motion.
    """
    amplitudes, start = path
    samples = group.samples_for(harmonics, np.abs(group.rows @ start[1]) * amplitudes[-1])
    equations = FreeBalance(HarmonicBalance(modes, group, samples), mode, harmonics, start[0])
    found = find_free_motions(equations, amplitudes, mode=start)
    if None in found:
        return None

    # Where the damping changes its sign, a motion without damping lies between two others.
    cycles = []
    for low, high in pairwise(found):
        if np.sign(low.motion.zeta) * np.sign(high.motion.zeta) < 0:
            share = low.motion.zeta / (low.motion.zeta - high.motion.zeta)
            guess = low.unknowns + share * (high.unknowns - low.unknowns)
            motion = equations.solve(guess, None)[1]
            amplitude = half_range(motion.modal @ modes.output)
            cycles.append(LimitCycle(amplitude, 0.0, motion.omega, high.motion.zeta > 0))
    return cycles
