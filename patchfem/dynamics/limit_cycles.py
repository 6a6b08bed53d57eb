"""Limit cycles of modes with negative damping and friction, without a drive.

Friction of at most F takes up to 4 F A of a cycle of amplitude A, and a damping c < 0 gives pi |c|
omega A^2. Where both are equal a motion repeats: one mode under Coulomb friction at A = 4 F/(pi
|c| omega), to first order in the damping (den Hartog's balance). Beyond the largest of these
amplitudes friction no longer holds the motion: flutter. Below it the motion decays, to rest or to
a smaller limit cycle that is stable.

`find_relay_cycles` is exact for rigid friction, which is a relay of the sliding velocity (Tsypkin
1984, ch. 6); `find_balance_cycles` serves every law of harmonic balance: it is the motion of
`harmonic.backbone` whose damping is 0.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ..core import ModalBasis, NotConverged
from . import propagator
from .harmonic.backbone import FreeBalance, FreeMotion, trace_free_motions
from .harmonic.forces import LawGroup
from .harmonic.harmonic import pack_harmonics
from .harmonic.point import make_balance

N_SAMPLES = 4096  # samples of a cycle from which its largest motion is found
N_AMPLITUDES = 48  # number of amplitudes at which the damping of a free motion is evaluated
# smallest and largest of these amplitudes over 4 F/(pi |c| omega)
MIN_AMPLITUDE_RATIO = 1e-6
MAX_AMPLITUDE_RATIO = 4.0
# the same where motions in micro-slip cannot be followed: smallest ratio, and number of amplitudes
MIN_SLIDING_RATIO = 0.02
N_SLIDING_AMPLITUDES = 16
NOT_FOLLOWED_MESSAGE = (
    "limit cycles are looked for among free motions of rising amplitude, and these could not be followed up to the "
    "amplitude at which friction dissipates what the mode gains"
)
# relative error that round-off and the tolerances of the solvers leave in an amplitude
AMPLITUDE_TOL = 1e-9
# velocity of a reversal times half the period over the range of the slide, which counts as rest
REST_TOL = 1e-8
MAX_SECANT_STEPS = 12  # largest number of secant steps to the damping that balances an amplitude
MAX_FIRST_RATIO = 2.0  # damping ratio of friction by den Hartog's balance; where it is larger, friction is 3 times
# the elastic force at the reversal or more, and the interface sticks there
N_HARMONICS = (
    9  # harmonics of the first solution; a second one with twice as many estimates its error
)


class LimitCycle(NamedTuple):
    """A limit cycle.

    - amplitude, error: half the range at the output and its error [m]
    - omega: [rad/s]
    - is_stable: whether disturbances of it decay
    """

    amplitude: float
    error: float
    omega: float
    is_stable: bool


def find_unstable_modes(modes: ModalBasis) -> np.ndarray:
    """Return the numbers (k,) of the coordinates with negative damping."""
    return np.flatnonzero(np.diagonal(modes.damping_matrix) < 0)


def estimate_amplitude(modes: ModalBasis, row, limit: float, mode: int) -> float:
    """Return the amplitude 4 F s/(pi |d| omega m) [m] of a coordinate by den Hartog's balance.

    Parameters
    ----------
    modes : ModalBasis
    row : ndarray
        (n,) slide per coordinate.
    limit : float
        Friction F [N].
    mode : int
        Number of the coordinate, whose damping d is negative.

    Returns
    -------
    float
    """
    gives = -modes.damping_matrix[mode, mode] * modes.omega[mode] * modes.mass
    return 4 * limit * abs(row[mode]) / (np.pi * gives)


def find_relay_cycles(modes: ModalBasis, row, slides: float, holds: float) -> list:
    """Find the limit cycles under rigid friction on an interface that never sticks.

    After a reversal the force is constant: y(T/2) = E (y - e) + e = -y has one y for each half
    period T/2. It is a limit cycle if the interface comes to rest there, slides in one direction in
    between, and needs more than `holds` to stick.

    Parameters
    ----------
    modes : ModalBasis
        None of them rigid.
    row : ndarray
        (n,) slide per coordinate.
    slides, holds : float
        Friction in slip, and largest friction in stick [N].

    Returns
    -------
    list of LimitCycle
        In increasing amplitude.
    """
    return sorted(
        mode_relay_cycle
        for mode in find_unstable_modes(modes)
        for mode_relay_cycle in _find_mode_relay_cycles(modes, row, (slides, holds), mode)
    )


def _find_mode_relay_cycles(modes: ModalBasis, row, forces: tuple, mode: int) -> list:
    """Return the cycles of `find_relay_cycles` with a frequency near that of a coordinate.

    forces: (2,) as there [N].
    """
    out = []
    half = np.pi / modes.omega[mode] * np.geomspace(0.6, 1.7, 400)
    rest = _reversal_speed_ratios(modes, row, forces[0], half)
    for k in np.flatnonzero(rest[:-1] * rest[1:] <= 0):
        t = brentq(
            lambda t: _find_reversal(modes, row, forces[0], t)[1],
            half[k],
            half[k + 1],
            xtol=1e-16,
            rtol=1e-14,
        )
        # this does not hold where a mode without damping is in resonance
        shut = abs(_find_reversal(modes, row, forces[0], t)[1]) < REST_TOL
        if shut and (found := _make_relay_cycle(modes, row, forces, t)) is not None:
            out.append(found)
    return out


def trace_relay_backbone(modes: ModalBasis, row, forces: tuple, amplitudes, mode: int) -> list:
    """Find the free motions at given amplitudes under rigid friction, with their damping.

    A damping -g of every coordinate keeps the motion of `mode` up (extended periodic motion: Krack
    2015); its ratio is g/(2 omega).

    Parameters
    ----------
    modes : ModalBasis
    row : ndarray
    forces : tuple
        Friction in slip and in stick [N], see `find_relay_cycles`.
    amplitudes : array_like
        (k,) [m].
    mode : int

    Returns
    -------
    list
        (LimitCycle, damping ratio), or None where the interface would stick on the way.
    """

    def cycle(log_more: float):
        lifted = replace(
            modes,
            damping=modes.damping_matrix - (own + np.exp(log_more)) * np.eye(modes.omega.size),
        )
        found = [
            mode_relay_cycle
            for mode_relay_cycle in _find_mode_relay_cycles(lifted, row, forces, mode)
            if mode_relay_cycle.amplitude > 0
        ]
        return min(found, key=lambda one: abs(one.omega - modes.omega[mode]), default=None)

    own = float(modes.damping_matrix[mode, mode])
    first = (
        4
        * forces[0]
        * abs(row[mode] * modes.output[mode])
        / (np.pi * modes.mass * modes.omega[mode])
    )
    rates = first / np.asarray(amplitudes, float)
    max_rate = 2 * MAX_FIRST_RATIO * modes.omega[mode]
    return [
        _solve_damping_at(cycle, float(a), own, float(rate)) if 0 < rate <= max_rate else None
        for a, rate in zip(amplitudes, rates)
    ]


def _solve_damping_at(cycle, amplitude: float, own: float, more: float) -> tuple | None:
    """Return LimitCycle and damping ratio at an amplitude [m], by secants of logarithms.

    own: rate of the mode [1/s]; more: guess of what friction takes [1/s].
    """
    g = np.log([more, 1.01 * more])
    found = [cycle(one) for one in g]
    for _ in range(MAX_SECANT_STEPS):
        if None in found:
            return None
        off = [np.log(one.amplitude / amplitude) for one in found]
        if abs(off[1]) < AMPLITUDE_TOL or off[0] == off[1]:
            return found[1], float((own + np.exp(g[1])) / (2 * found[1].omega))
        g = np.array([g[1], g[1] - off[1] * (g[1] - g[0]) / (off[1] - off[0])])
        found = [found[1], cycle(g[1])]
    return None


def _free_motion_matrices(modes: ModalBasis, t) -> np.ndarray:
    """Return the free motion (k, 2n, 2n) of (z, z') over times (k,)."""
    blocks = propagator.free_motion(modes, t)
    if modes.damping is None:
        blocks = [part[..., None] * np.eye(modes.omega.size) for part in blocks]
    return np.block([[blocks[0], blocks[1]], [blocks[2], blocks[3]]])


def _reversal_speed_ratios(modes: ModalBasis, row, force: float, half) -> np.ndarray:
    """Return velocity at the reversal times half period over the swing (k,), for half periods.

    See `_find_reversal`.
    """
    n = modes.omega.size
    eye = np.eye(2 * modes.omega.size)
    rest = np.concatenate([row * force / (modes.mass * modes.omega**2), np.zeros(n)])
    flow = _free_motion_matrices(modes, half)
    y = np.einsum("kab,kb->ka", np.linalg.pinv(flow + eye, rcond=1e-14), (flow - eye) @ rest)
    return y[:, n:] @ row * half / np.maximum(np.abs(y[:, :n]) @ np.abs(row), 1e-300)


def _find_reversal(modes: ModalBasis, row, force: float, t: float) -> tuple:
    """Return the state at the reversal, its velocity times t over the swing, and the rest state.

    t: half period [s].
    """
    n = modes.omega.size
    eye = np.eye(2 * modes.omega.size)
    rest = np.concatenate([row * force / (modes.mass * modes.omega**2), np.zeros(n)])
    flow = _free_motion_matrices(modes, [t])[0]
    y = np.linalg.lstsq(flow + eye, (flow - eye) @ rest, rcond=None)[0]
    return y, float(row @ y[n:]) * t / max(float(np.abs(row) @ np.abs(y[:n])), 1e-300), rest


def _make_relay_cycle(modes: ModalBasis, row, forces: tuple, t: float) -> LimitCycle | None:
    """Return the LimitCycle of half period t [s], None where the interface reverses or sticks."""
    slides, holds = forces
    n = modes.omega.size
    y, _, rest = _find_reversal(modes, row, slides, t)
    times = np.linspace(0, t, N_SAMPLES // 2 + 1)
    path = rest + _free_motion_matrices(modes, times) @ (y - rest)
    rate = path[:, n:] @ row
    swing = float(np.abs(row) @ np.abs(y[:n]))
    pull = -modes.mass * (modes.omega**2 * y[:n] + modes.damping_matrix @ y[n:]) @ row / (row @ row)
    if rate[1:-1].max() > 1e-9 * swing / t or -pull <= holds:
        return None
    motion = path[:, :n] @ modes.output
    cycle = np.concatenate([motion, -motion[1:]])
    found = _find_maximum(cycle)
    coarse = _find_maximum(cycle[::2])
    # a shift of the reversal in time absorbs part of the deviation, so the map goes from reversal to reversal
    speed = np.concatenate([path[-1, n:], _find_accelerations(modes, path[-1], row, slides)])
    face = np.concatenate([np.zeros(n), row])
    turned = (np.eye(2 * n) - np.outer(speed, face) / (face @ speed)) @ _free_motion_matrices(
        modes, [t]
    )[0]
    is_stable = bool(np.abs(np.linalg.eigvals(turned)).max() < 1)
    return LimitCycle(found, abs(found - coarse) + AMPLITUDE_TOL * found, np.pi / t, is_stable)


def _find_accelerations(modes: ModalBasis, y, row, force: float) -> np.ndarray:
    """Return the accelerations (n,) in a state (2 n,) under a force [N] along `row`."""
    n = modes.omega.size
    return row * force / modes.mass - modes.omega**2 * y[:n] - modes.damping_matrix @ y[n:]


def _find_maximum(samples) -> float:
    """Return the maximum of a motion sampled at (k,), between samples by a parabola.

    The motion changes sign after half a period.
    """
    k = int(np.argmax(samples))
    if not 0 < k < samples.size - 1:
        k = 1 if k == 0 else samples.size - 2
    a, b, c = samples[k - 1 : k + 2]
    bend = a - 2 * b + c
    return float(b - (c - a) ** 2 / (8 * bend)) if bend < 0 else float(samples.max())


def find_balance_cycles(modes: ModalBasis, group: LawGroup, row, limit: float) -> tuple:
    """Find the limit cycles of the laws of a LawGroup on one interface, by harmonic balance.

    Each is found with harmonics and samples twice as many. A law that weakens may have no free
    motion in micro-slip; the path then starts where the interface slides, at the mode without
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
        Smallest amplitude of the output that was looked at [m], 0 where all were.

    Raises
    ------
    NotConverged
        If no free motion is found in either way.
    """
    out = []
    least = 0.0
    for mode in find_unstable_modes(modes):
        if limit * abs(row[mode]) > 0:
            found, low = _find_mode_cycles(
                modes, group, int(mode), estimate_amplitude(modes, row, limit, mode)
            )
            out = out + found
            least = max(least, low * abs(modes.output[mode]))
    return sorted(out), least


def _find_mode_cycles(modes: ModalBasis, group: LawGroup, mode: int, size: float) -> tuple:
    """Return the limit cycles of one mode and the smallest amplitude [m] that was examined."""
    shape = np.eye(modes.omega.size)[mode]
    paths = (
        (
            size * np.geomspace(MIN_AMPLITUDE_RATIO, MAX_AMPLITUDE_RATIO, N_AMPLITUDES),
            modes.compute_stuck_mode(group.rows, group.stiffness(), mode),
            0.0,
        ),
        (
            size * np.geomspace(MIN_SLIDING_RATIO, MAX_AMPLITUDE_RATIO, N_SLIDING_AMPLITUDES),
            (modes.omega[mode], shape),
            MIN_SLIDING_RATIO * size,
        ),
    )
    for amplitudes, start, least in paths:
        try:
            few, many = (
                _find_undamped_motions(modes, group, mode, (amplitudes, start), harmonics)
                for harmonics in (N_HARMONICS, 2 * N_HARMONICS + 1)
            )
        except NotConverged:
            continue
        if len(few) != len(many):
            raise NotConverged(
                f"{len(few)} limit cycles were found with {N_HARMONICS} harmonics but {len(many)} limit cycles "
                f"with {2 * N_HARMONICS + 1} harmonics"
            )
        return [
            better._replace(
                error=2 * abs(one.amplitude - better.amplitude) + AMPLITUDE_TOL * better.amplitude
            )
            for one, better in zip(few, many)
        ], least
    raise NotConverged(NOT_FOLLOWED_MESSAGE)


def _find_undamped_motions(
    modes: ModalBasis, group: LawGroup, mode: int, path: tuple, harmonics: int
) -> list:
    """Return the cycles along the free motions of a mode, where their damping changes sign.

    path: amplitudes (k,) [m], and frequency [rad/s] and shape (n,) of the first motion.
    """
    amplitudes, (omega, shape) = path
    slides = np.abs(group.rows @ shape) * amplitudes[-1]
    balance = make_balance(modes, group, group.samples_for(harmonics, slides))
    equations = FreeBalance(balance, mode, harmonics, omega)
    path = trace_free_motions(equations, amplitudes, omega, shape)
    zeta = np.array([one.zeta for one in path])
    out = []
    for k in np.flatnonzero(np.sign(zeta[:-1]) * np.sign(zeta[1:]) < 0):
        found = _solve_undamped_between(equations, path[k], path[k + 1])
        wave = np.exp(
            1j * np.outer(np.linspace(0, 2 * np.pi, N_SAMPLES + 1), np.arange(len(found.modal)))
        )
        motion = (wave @ (found.modal @ modes.output)).real
        half = (_find_maximum(motion) + _find_maximum(-motion)) / 2
        out.append(LimitCycle(half, 0.0, found.omega, bool(zeta[k + 1] > 0)))
    return out


def _pack_unknowns(equations: FreeBalance, one: FreeMotion) -> np.ndarray:
    """Return the unknowns of `FreeBalance.solve` at a free motion."""
    y = equations.balance.lift.T @ one.slides[:, : equations.h + 1]
    return np.append(pack_harmonics(y) / one.amplitude, [one.omega / equations.scale, one.zeta])


def _solve_undamped_between(
    equations: FreeBalance, low: FreeMotion, high: FreeMotion
) -> FreeMotion:
    """Return the free motion without damping between two of opposite sign (Illinois method)."""
    ends = [(np.log(one.amplitude), one.zeta, one) for one in (low, high)]
    last = 0
    for _ in range(60):
        (a, below, start), (b, above, _) = ends
        at = (a * above - b * below) / (above - below)
        _, found = equations.solve(_pack_unknowns(equations, start), float(np.exp(at)))
        if abs(found.zeta) < 1e-13 or abs(b - a) < 1e-13:
            return found
        side = int(np.sign(found.zeta) == np.sign(above))
        ends[side] = (at, found.zeta, found)
        if side == last:  # Illinois rule: the value at the end that stays is halved
            k = 1 - side
            ends[k] = (ends[k][0], ends[k][1] / 2, ends[k][2])
        last = side
    return found
