"""Exact time step of damped modes under a drive signal and constant interface forces.

The step is computed from the matrix exponential of each mode, or of all modes together where
damping couples them, so resonance without damping, rigid modes and overdamped modes need no special
case (report, eqs 3.5-3.10, with i w_i where 3.7 and 3.9 print i w). The effect of the drive and the
energies of a step are sums over its Gauss points, exact to round-off for a drive that is smooth in
the step; where modes are much faster than the step, `doubling` computes it.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ..core import ModalBasis
from . import doubling

# Smallest number of Gauss points in a step.
MIN_GAUSS_POINTS = 8
# Largest number of Gauss points in a step; they resolve 20 radians of the fastest motion.
MAX_GAUSS_POINTS = 48
# Largest number of propagators in the cache, which limits the memory.
MAX_CACHED = 4
# Largest number of coordinates of a cached propagator.
MAX_CACHED_COORDINATES = 32
# Largest product of fastest rate and step length [rad] that MAX_GAUSS_POINTS resolve.
MAX_RATE_TIME = 20.0
# Product [rad] of the fastest rate and the short step, which is doubled until it is the whole step.
SHORT_STEP_RATE_TIME = 4.0


@dataclass(frozen=True, eq=False, slots=True)
class Propagator:
    """Coefficients of the exact time step for n modal coordinates and p interface ports.

    free (4, n): z and z' at the end per z and z' at the start (zz, zv, vz, vv); force_response (2, n): both
    per modal acceleration, constant over the step; dense (2 n, 3 n): the same for (z, z',
    acceleration) if damping couples the coordinates, else (0, 0). slide_response (p, 2 n): displacement
    of every port in a free motion; beta (p, p) [m/N]: displacement of the ports against unit port
    forces; rows (p, n): the ports. loss (6, n) or dense_loss (3 n, 3 n): viscous loss of a step as
    a quadratic form of (z, z', acceleration). drive: see `tables`; steps: number per period.
    """

    dt: float
    steps: int
    rows: np.ndarray
    free: np.ndarray
    force_response: np.ndarray
    dense: np.ndarray
    slide_response: np.ndarray
    beta: np.ndarray
    loss: np.ndarray
    dense_loss: np.ndarray
    nodes: np.ndarray
    parts: dict

    def tables(self, drive, first: int, count: int) -> np.ndarray:
        """Return the drive coefficients for successive steps, one row per step.

        The columns are the contribution of the drive to z and z' (n, n); linear forms in (z, z',
        acceleration) of the work of the drive (3 n) and of the viscous loss (3 n) [J]; the constant
        terms of both [J]; the drive at the end of the step [m s-2]; the displacement of every port
        due to the drive (p) [m].

        Parameters
        ----------
        drive
        first : int
            Number of the first step.
        count : int
            Number of steps.

        Returns
        -------
        ndarray
            (count, 8 n + 3 + p).
        """
        start_times = (first + np.arange(count)) * self.dt
        drive_values = drive.values((start_times[:, None] + self.nodes).ravel()).reshape(count, -1)
        weights = self.parts
        driven_motion = drive_values @ weights["z"]
        # The quadratic form is computed as a product and a sum, because an einsum of
        # three factors is four times slower.
        scalars = np.stack(
            [
                ((drive_values @ weights["work"]) * drive_values).sum(axis=1),
                ((drive_values @ weights["lost"]) * drive_values).sum(axis=1),
                drive.values(start_times + self.dt),
            ],
            axis=1,
        )
        return np.concatenate(
            [
                driven_motion,
                *(drive_values @ weights[key] for key in ("v", "wz", "wv", "wf", "dz", "dv", "df")),
                scalars,
                driven_motion @ self.rows.T,
            ],
            axis=1,
        )


def make_propagator(modes: ModalBasis, drive, steps_per_cycle: int, rows=None) -> Propagator:
    """Return the propagator of the modes for equal steps that divide a drive period.

    The step is exact for a constant friction force and for the drive up to round-off, whatever its
    length. The energy balance of a run contains the work and the loss of each step, so that it would
    show a wrong propagator. Steps of large omega dt use up to MAX_GAUSS_POINTS Gauss points; if these
    do not suffice, a short step is doubled. The last few propagators are cached, because the runs
    that estimate errors use the same ones again.

    Parameters
    ----------
    modes : ModalBasis
    drive
        Drive signal, of which only the period [s] is used.
    steps_per_cycle : int
    rows : array_like, optional
        (p, n) slide of each port per coordinate; the interfaces by default.

    Returns
    -------
    Propagator
        For steps of period / steps_per_cycle [s].
    """
    if rows is None and modes.omega.size <= MAX_CACHED_COORDINATES:
        return _make_interface_propagator(_HashableBasis(modes), drive.period, steps_per_cycle)
    return _make_propagator(
        modes,
        drive.period,
        steps_per_cycle,
        np.array(modes.interfaces if rows is None else rows, float),
    )


class _HashableBasis:
    """Modal basis that is compared and hashed by its numerical values, for use as a cache key."""

    def __init__(self, modes: ModalBasis):
        self.modes = modes
        self.key = tuple(
            np.asarray(0.0 if part is None else part, float).tobytes()
            for part in (
                modes.omega,
                modes.zeta,
                modes.damping,
                modes.interfaces,
                modes.base,
                modes.mass,
            )
        )

    def __eq__(self, other) -> bool:
        return self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)


@lru_cache(maxsize=MAX_CACHED)
def _make_interface_propagator(
    basis: _HashableBasis, period: float, steps_per_cycle: int
) -> Propagator:
    return _make_propagator(
        basis.modes, period, steps_per_cycle, np.array(basis.modes.interfaces, float)
    )


def _make_propagator(modes: ModalBasis, period: float, steps_per_cycle: int, rows) -> Propagator:
    dt = period / steps_per_cycle
    fastest_rate = max(bound_fastest_rate(modes), 2 * np.pi / period)
    n = modes.omega.size
    is_coupled = modes.damping is not None
    if fastest_rate * dt > MAX_RATE_TIME:
        (end_blocks, motion_per_acceleration, drive_weights, loss_form), nodes = (
            _integrate_by_doubling(modes, dt, fastest_rate, 2 * np.pi / period)
        )
    else:
        # Each radian of the fastest motion needs two more Gauss points.
        nodes, weight = _gauss_rule(
            dt,
            int(
                np.clip(
                    MIN_GAUSS_POINTS + 2 * np.ceil(fastest_rate * dt),
                    MIN_GAUSS_POINTS,
                    MAX_GAUSS_POINTS,
                )
            ),
        )
        end_blocks = [part[0] for part in free_motion(modes, np.array([dt]))]
        node_blocks = free_motion(modes, nodes)
        motion_per_acceleration = _motion_per_acceleration(modes, dt, nodes, weight)
        drive_weights, loss_form = _compute_drive_weights(modes, dt, nodes, weight, node_blocks)
    if is_coupled:
        block = np.block([[end_blocks[0], end_blocks[1]], [end_blocks[2], end_blocks[3]]])
        dense = np.concatenate([block, np.concatenate(motion_per_acceleration)], axis=1)
        slide_response = rows @ (block - np.eye(2 * n))[:n]
        beta = rows @ motion_per_acceleration[0] @ rows.T / modes.mass
        free = np.zeros((4, n))
        loss = np.zeros((6, n))
        uncoupled_response = np.zeros((2, n))
    else:
        dense = np.zeros((0, 0))
        uncoupled_response = np.array(motion_per_acceleration)
        free = np.array(end_blocks)
        loss = loss_form
        slide_response = np.concatenate([rows * (end_blocks[0] - 1), rows * end_blocks[1]], axis=1)
        beta = (rows * motion_per_acceleration[0]) @ rows.T / modes.mass
    return Propagator(
        dt,
        steps_per_cycle,
        rows,
        free,
        uncoupled_response,
        np.ascontiguousarray(dense),
        np.ascontiguousarray(slide_response),
        np.ascontiguousarray(beta),
        loss,
        loss_form if is_coupled else np.zeros((0, 0)),
        nodes,
        drive_weights,
    )


def bound_fastest_rate(modes: ModalBasis) -> float:
    """Return an upper bound [1/s] of the oscillation and decay rates of the modes."""
    if modes.damping is None:
        return float(np.max(modes.omega * np.maximum(1.0, 2 * modes.zeta), initial=0.0))
    return max(float(modes.omega.max(initial=0.0)), float(np.linalg.norm(modes.damping, 2)))


def _gauss_rule(dt: float, count: int) -> tuple:
    """Return the points and weights of Gauss quadrature on [0, dt]."""
    x, w = np.polynomial.legendre.leggauss(count)
    return dt * (1 + x) / 2, dt * w / 2


def _integrate_by_doubling(modes: ModalBasis, dt: float, fastest: float, slowest: float) -> tuple:
    """Compute the coefficients for a step much longer than the modal periods, by doubling.

    fastest, slowest [1/s]: rates of the modes and of the drive. Returns (free-motion blocks, motion per acceleration,
    drive weights, quadratic form of the loss) and the nodes.
    """
    n_doublings = max(0, int(np.ceil(np.log2(fastest * dt / SHORT_STEP_RATE_TIME))))
    count = int(
        np.clip(
            MIN_GAUSS_POINTS + 2 * np.ceil(max(SHORT_STEP_RATE_TIME, slowest * dt)),
            MIN_GAUSS_POINTS,
            MAX_GAUSS_POINTS,
        )
    )
    coupled_modes = replace(modes, damping=modes.damping_matrix)
    n = modes.omega.size
    nodes, weight = _gauss_rule(dt, count)
    h = dt / 2**n_doublings
    step_ratio = 1 / 2**n_doublings
    short_nodes = nodes * step_ratio
    short_weights = weight * step_ratio
    step = doubling.make_short_step(
        np.diag(modes.omega**2),
        modes.damping_matrix,
        _motion_per_acceleration(coupled_modes, h, short_nodes, short_weights),
        *_compute_drive_weights(
            coupled_modes, h, short_nodes, short_weights, free_motion(coupled_modes, short_nodes)
        ),
    )
    halves = _lagrange_polynomials(nodes, nodes / 2), _lagrange_polynomials(nodes, (dt + nodes) / 2)
    for _ in range(n_doublings):
        step = doubling.double_step(step, halves)
    parts, quadratic = doubling.split_step(step)
    transition = step.change + np.eye(2 * n)
    blocks = [transition[:n, :n], transition[:n, n:], transition[n:, :n], transition[n:, n:]]
    motion_per_acceleration = (step.force_response[:n], step.force_response[n:])
    if modes.damping is None:
        blocks = [np.diag(part) for part in blocks]
        motion_per_acceleration = tuple(np.diag(part) for part in motion_per_acceleration)
        pairs = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))
        quadratic = np.stack(
            [
                (1 + (i != k)) * np.diag(quadratic[i * n : (i + 1) * n, k * n : (k + 1) * n])
                for i, k in pairs
            ]
        )
    return (blocks, motion_per_acceleration, parts, quadratic), nodes


def free_motion(modes: ModalBasis, times) -> tuple:
    """Return the blocks zz, zv, vz, vv of the modal transition matrix after given times (k,).

    Each has the shape (k, n), or (k, n, n) if damping couples the coordinates.
    """
    times = np.asarray(times, float)
    if modes.damping is None:
        return _free_motion_uncoupled(modes.omega, modes.zeta, times[:, None])
    n = modes.omega.size
    scale = max(float(modes.omega.max()), 1 / float(times.max()))
    # Rates are divided by `scale`, so that all entries of the matrix have a similar size.
    a = np.block(
        [[np.zeros((n, n)), scale * np.eye(n)], [-np.diag(modes.omega**2) / scale, -modes.damping]]
    )
    e = matrix_exponentials(a * times[:, None, None])
    return e[:, :n, :n], e[:, :n, n:] / scale, e[:, n:, :n] * scale, e[:, n:, n:]


def _free_motion_uncoupled(omega, zeta, t) -> tuple:
    """Return the transition blocks of uncoupled modal coordinates (n,) after times t (k, 1).

    The blocks are zz, zv, vz, vv. The closed form holds for any damping ratio.
    """
    decay = zeta * omega
    root = omega * np.sqrt(np.abs(zeta**2 - 1))
    x = root * t
    is_small = x < 1e-3
    underdamped = np.where(is_small | (zeta < 1), x, 0.0)
    overdamped = np.where(~is_small & (zeta > 1), x, 0.0)
    sign = np.where(zeta < 1, -1.0, 1.0)
    square = sign * x * x
    envelope = np.exp(-decay * t)
    c = envelope * np.cos(underdamped)
    s = envelope * np.sinc(underdamped / np.pi)
    c = np.where(is_small, envelope * (1 + square / 2 * (1 + square / 12)), c)
    s = np.where(is_small, envelope * (1 + square / 6 * (1 + square / 20)), s)
    slow_decay = np.exp(-decay * t + overdamped)
    fast_decay = np.exp(-decay * t - overdamped)
    c = np.where(overdamped > 0, (slow_decay + fast_decay) / 2, c)
    s = np.where(
        overdamped > 0,
        (slow_decay - fast_decay) / (2 * np.where(overdamped > 0, overdamped, 1.0)),
        s,
    )
    zv = t * s
    return c + decay * zv, zv, -(omega**2) * zv, c - decay * zv


def matrix_exponentials(a) -> np.ndarray:
    """Compute the exponentials of matrices (k, m, m) by scaling and squaring.

    The Taylor series of order 13 of a matrix with a norm below 1/4 has an error of (1/4)^14/14! =
    4e-20.
    """
    norm = float(np.abs(a).sum(axis=2).max()) if a.size else 0.0
    halvings = max(0, int(np.ceil(np.log2(max(4 * norm, 1e-300)))))
    x = a / 2.0**halvings
    unit = np.eye(a.shape[1])
    out = np.broadcast_to(unit, x.shape)
    for k in range(13, 0, -1):
        out = unit + x @ out / k
    for _ in range(halvings):
        out = out @ out
    return out


def _motion_per_acceleration(modes: ModalBasis, dt: float, nodes, weight) -> tuple:
    """Return the modal coordinate and rate after dt [s], per unit of a constant modal acceleration.

    Each has the shape (n,), or (n, n) if damping couples the coordinates. The first one is the
    integral of zv, which avoids cancellation in a short step.
    """
    return np.tensordot(weight, free_motion(modes, nodes)[1], 1), free_motion(
        modes, np.array([dt])
    )[1][0]


def _compute_drive_weights(modes: ModalBasis, dt, nodes, weight, node_blocks) -> tuple:
    """Return the weights of the drive signal at the Gauss points, and the quadratic form of viscous loss.

    `tables` multiplies the weights by the drive.
    """
    n = modes.omega.size
    base = modes.base
    mass = modes.mass
    m = nodes.size
    _, zv, vz, vv = node_blocks
    is_coupled = modes.damping is not None
    remaining_motion = free_motion(modes, dt - nodes)

    def times_base(part):
        return part @ base if is_coupled else part * base

    def base_times(part):
        return np.einsum("i,kij->kj", base, part) if is_coupled else part * base

    # The velocity at point k per drive at point j is -int_0^tau_k E_vv(tau_k - s) base l_j(s) ds.
    node_velocities = np.empty((m, m, n))
    positions = (1 + np.polynomial.legendre.leggauss(m)[0]) / 2
    for k, tau in enumerate(nodes):
        response = times_base(free_motion(modes, tau * (1 - positions))[3])
        interpolation = _lagrange_polynomials(nodes, tau * positions) * (weight * tau / dt)[:, None]
        node_velocities[k] = -interpolation.T @ response
    if is_coupled:
        damping = (modes.damping + modes.damping.T) / 2
        damped_velocities = np.einsum("ij,klj->kli", damping, node_velocities)
    else:
        damping = 2 * modes.zeta * modes.omega
        damped_velocities = node_velocities * damping
    parts = {
        "z": -weight[:, None] * times_base(remaining_motion[1]),
        "v": -weight[:, None] * times_base(remaining_motion[3]),
        "wz": -mass * weight[:, None] * base_times(vz),
        "wv": -mass * weight[:, None] * base_times(vv),
        "wf": -mass * weight[:, None] * base_times(zv),
        "work": -mass * weight[:, None] * (node_velocities @ base),
        "lost": mass * np.einsum("k,kji,kli->jl", weight, damped_velocities, node_velocities),
    }
    for key, part in (("dz", vz), ("dv", vv), ("df", zv)):
        rule = "k,kji,kil->jl" if is_coupled else "k,kjl,kl->jl"
        parts[key] = 2 * mass * np.einsum(rule, weight, damped_velocities, part)
    if is_coupled:
        velocity_blocks = np.concatenate([vz, vv, zv], axis=2)
        return parts, mass * np.einsum(
            "k,kai,ab,kbj->ij", weight, velocity_blocks, damping, velocity_blocks
        )
    pairs = (vz * vz, 2 * vz * vv, vv * vv, 2 * vz * zv, 2 * vv * zv, zv * zv)
    return parts, np.stack([mass * damping * (weight @ pair) for pair in pairs])


def _lagrange_polynomials(nodes, points) -> np.ndarray:
    """Evaluate the Lagrange polynomials for nodes (m,) at points (k,), as an array (k, m)."""
    node_distances = nodes[:, None] - nodes
    np.fill_diagonal(node_distances, 1.0)
    scale = 1 / np.prod(node_distances / np.ptp(nodes), axis=1)
    distances = (points[:, None] - nodes) / np.ptp(nodes)
    is_node = np.abs(distances) < 1e-15
    unscaled = scale / np.where(is_node, 1.0, distances)
    polynomials = unscaled / unscaled.sum(axis=1, keepdims=True)
    is_exact = is_node.any(axis=1)
    polynomials[is_exact] = is_node[is_exact]
    return polynomials
