"""Exact step of damped modes under any drive and interface forces constant over the step.

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

# smallest and largest number of Gauss points of a step; 48 resolve 20 radians of the fastest motion
MIN_GAUSS_POINTS = 8
MAX_GAUSS_POINTS = 48
# number of propagators that are cached, and largest number of coordinates of a cached one, which
# bound the memory
MAX_CACHED = 4
MAX_CACHED_COORDINATES = 32
# fastest rate times step length, above which MOST Gauss points do not resolve the motion
MAX_RATE_TIME = 20.0
SHORT_STEP_RATE_TIME = 4.0  # fastest rate times length of the short step that is then doubled


@dataclass(frozen=True, eq=False, slots=True)
class Propagator:
    """Coefficients of a step of dt [s] for n coordinates and p ports.

    free (4, n): z and z' at the end per z and z' at the start (zz, zv, vz, vv); push (2, n): both
    per modal acceleration, constant over the step; dense (2 n, 3 n): the same for (z, z',
    acceleration) where damping couples the coordinates, else (0, 0). reach (p, 2 n): displacement
    of every port in a free motion; beta (p, p) [m/N]: displacement of the ports against unit port
    forces; rows (p, n): the ports. loss (6, n) or dense_loss (3 n, 3 n): viscous loss of a step as
    a quadratic form of (z, z', acceleration). drive: see `tables`; steps: number per period.
    """

    dt: float
    steps: int
    rows: np.ndarray
    free: np.ndarray
    push: np.ndarray
    dense: np.ndarray
    reach: np.ndarray
    beta: np.ndarray
    loss: np.ndarray
    dense_loss: np.ndarray
    nodes: np.ndarray
    parts: dict

    def tables(self, drive, first: int, count: int) -> np.ndarray:
        """Return a row of coefficients for each of some steps.

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
        start = (first + np.arange(count)) * self.dt
        a = drive.values((start[:, None] + self.nodes).ravel()).reshape(count, -1)
        p = self.parts
        moved = a @ p["z"]
        # the quadratic form is a product and a sum, because an einsum of three factors takes four times as long
        rest = np.stack(
            [
                ((a @ p["work"]) * a).sum(axis=1),
                ((a @ p["lost"]) * a).sum(axis=1),
                drive.values(start + self.dt),
            ],
            axis=1,
        )
        return np.concatenate(
            [
                moved,
                *(a @ p[key] for key in ("v", "wz", "wv", "wf", "dz", "dv", "df")),
                rest,
                moved @ self.rows.T,
            ],
            axis=1,
        )


def make_propagator(modes: ModalBasis, drive, steps_per_cycle: int, rows=None) -> Propagator:
    """Return the propagator of equal steps of the period of a drive.

    Steps of large omega dt take up to MAX_GAUSS_POINTS Gauss points; where these do not suffice, a
    short step is doubled. The last few propagators are cached, because the runs that estimate
    errors use the same ones again.

    Parameters
    ----------
    modes : ModalBasis
    drive
    steps_per_cycle : int
    rows : array_like, optional
        (p, n) ports, slide per coordinate; the interfaces by default.

    Returns
    -------
    Propagator
    """
    if rows is None and modes.omega.size <= MAX_CACHED_COORDINATES:
        return _make_for_interfaces(_Basis(modes), drive.period, steps_per_cycle)
    return _make(
        modes,
        drive.period,
        steps_per_cycle,
        np.array(modes.interfaces if rows is None else rows, float),
    )


class _Basis:
    """ModalBasis that is compared and hashed by its numbers, as a key of the cache."""

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
def _make_for_interfaces(basis: _Basis, period: float, steps_per_cycle: int) -> Propagator:
    return _make(basis.modes, period, steps_per_cycle, np.array(basis.modes.interfaces, float))


def _make(modes: ModalBasis, period: float, steps_per_cycle: int, rows) -> Propagator:
    dt = period / steps_per_cycle
    fastest = max(bound_fastest_rate(modes), 2 * np.pi / period)
    n = modes.omega.size
    coupled = modes.damping is not None
    if fastest * dt > MAX_RATE_TIME:
        (at_end, push, parts, quadratic), nodes = _integrate_by_doubling(
            modes, dt, fastest, 2 * np.pi / period
        )
    else:
        # two more Gauss points for each radian of the fastest motion
        nodes, weight = _gauss_rule(
            dt,
            int(
                np.clip(
                    MIN_GAUSS_POINTS + 2 * np.ceil(fastest * dt), MIN_GAUSS_POINTS, MAX_GAUSS_POINTS
                )
            ),
        )
        at_end = [part[0] for part in free_motion(modes, np.array([dt]))]
        inside = free_motion(modes, nodes)
        push = _motion_per_acceleration(modes, dt, nodes, weight)
        parts, quadratic = _drive_weights(modes, dt, nodes, weight, inside)
    if coupled:
        block = np.block([[at_end[0], at_end[1]], [at_end[2], at_end[3]]])
        dense = np.concatenate([block, np.concatenate(push)], axis=1)
        reach = rows @ (block - np.eye(2 * n))[:n]
        beta = rows @ push[0] @ rows.T / modes.mass
        free = np.zeros((4, n))
        loss = np.zeros((6, n))
        short = np.zeros((2, n))
    else:
        dense = np.zeros((0, 0))
        short = np.array(push)
        free = np.array(at_end)
        loss = quadratic
        reach = np.concatenate([rows * (at_end[0] - 1), rows * at_end[1]], axis=1)
        beta = (rows * push[0]) @ rows.T / modes.mass
    return Propagator(
        dt,
        steps_per_cycle,
        rows,
        free,
        short,
        np.ascontiguousarray(dense),
        np.ascontiguousarray(reach),
        np.ascontiguousarray(beta),
        loss,
        quadratic if coupled else np.zeros((0, 0)),
        nodes,
        parts,
    )


def bound_fastest_rate(modes: ModalBasis) -> float:
    """Return an upper bound [1/s] of the rates at which modes oscillate or decay."""
    if modes.damping is None:
        return float(np.max(modes.omega * np.maximum(1.0, 2 * modes.zeta), initial=0.0))
    return max(float(modes.omega.max(initial=0.0)), float(np.linalg.norm(modes.damping, 2)))


def _gauss_rule(dt: float, count: int) -> tuple:
    """Return Gauss points and weights on [0, dt]."""
    x, w = np.polynomial.legendre.leggauss(count)
    return dt * (1 + x) / 2, dt * w / 2


def _integrate_by_doubling(modes: ModalBasis, dt: float, fastest: float, slowest: float) -> tuple:
    """Compute a step that is long compared to the periods of the modes, by doubling.

    fastest, slowest [1/s]: rates of the modes and of the drive. Returns (blocks at the end, push,
    parts, quadratic form of the loss) and the nodes.
    """
    times = max(0, int(np.ceil(np.log2(fastest * dt / SHORT_STEP_RATE_TIME))))
    count = int(
        np.clip(
            MIN_GAUSS_POINTS + 2 * np.ceil(max(SHORT_STEP_RATE_TIME, slowest * dt)),
            MIN_GAUSS_POINTS,
            MAX_GAUSS_POINTS,
        )
    )
    whole = replace(modes, damping=modes.damping_matrix)
    n = modes.omega.size
    nodes, weight = _gauss_rule(dt, count)
    h = dt / 2**times
    shrink = 1 / 2**times
    near = nodes * shrink
    light = weight * shrink
    step = doubling.make_short_step(
        np.diag(modes.omega**2),
        modes.damping_matrix,
        _motion_per_acceleration(whole, h, near, light),
        *_drive_weights(whole, h, near, light, free_motion(whole, near)),
    )
    halves = _lagrange_polynomials(nodes, nodes / 2), _lagrange_polynomials(nodes, (dt + nodes) / 2)
    for _ in range(times):
        step = doubling.double_step(step, halves)
    parts, quadratic = doubling.split_step(step)
    flow = step.change + np.eye(2 * n)
    blocks = [flow[:n, :n], flow[:n, n:], flow[n:, :n], flow[n:, n:]]
    push = (step.push[:n], step.push[n:])
    if modes.damping is None:
        blocks = [np.diag(part) for part in blocks]
        push = tuple(np.diag(part) for part in push)
        pairs = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))
        quadratic = np.stack(
            [
                (1 + (i != k)) * np.diag(quadratic[i * n : (i + 1) * n, k * n : (k + 1) * n])
                for i, k in pairs
            ]
        )
    return (blocks, push, parts, quadratic), nodes


def free_motion(modes: ModalBasis, times) -> tuple:
    """Return the blocks zz, zv, vz, vv of the free motion after `times` (k,).

    Each has the shape (k, n), or (k, n, n) where damping couples the coordinates.
    """
    times = np.asarray(times, float)
    if modes.damping is None:
        return _free_motion_uncoupled(modes.omega, modes.zeta, times[:, None])
    n = modes.omega.size
    scale = max(float(modes.omega.max()), 1 / float(times.max()))
    # rates are divided by `scale`, so that all entries of the matrix have a similar size
    a = np.block(
        [[np.zeros((n, n)), scale * np.eye(n)], [-np.diag(modes.omega**2) / scale, -modes.damping]]
    )
    e = matrix_exponentials(a * times[:, None, None])
    return e[:, :n, :n], e[:, :n, n:] / scale, e[:, n:, :n] * scale, e[:, n:, n:]


def _free_motion_uncoupled(omega, zeta, t) -> tuple:
    """Return the blocks zz, zv, vz, vv of uncoupled coordinates (n,) after times t (k, 1).

    The closed form holds for any damping ratio.
    """
    decay = zeta * omega
    root = omega * np.sqrt(np.abs(zeta**2 - 1))
    x = root * t
    small = x < 1e-3
    under = np.where(small | (zeta < 1), x, 0.0)
    over = np.where(~small & (zeta > 1), x, 0.0)
    sign = np.where(zeta < 1, -1.0, 1.0)
    square = sign * x * x
    fade = np.exp(-decay * t)
    c = fade * np.cos(under)
    s = fade * np.sinc(under / np.pi)
    c = np.where(small, fade * (1 + square / 2 * (1 + square / 12)), c)
    s = np.where(small, fade * (1 + square / 6 * (1 + square / 20)), s)
    slow = np.exp(-decay * t + over)
    fast = np.exp(-decay * t - over)
    c = np.where(over > 0, (slow + fast) / 2, c)
    s = np.where(over > 0, (slow - fast) / (2 * np.where(over > 0, over, 1.0)), s)
    zv = t * s
    return c + decay * zv, zv, -(omega**2) * zv, c - decay * zv


def matrix_exponentials(a) -> np.ndarray:
    """Return the matrix exponentials (k, m, m) of matrices a (k, m, m), by scaling and squaring.

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
    """Return the motion (z, z') after dt [s] per constant modal acceleration.

    Each has the shape (n,), or (n, n) where damping couples the coordinates. The first one is the
    integral of zv, which avoids cancellation in a short step.
    """
    return np.tensordot(weight, free_motion(modes, nodes)[1], 1), free_motion(
        modes, np.array([dt])
    )[1][0]


def _drive_weights(modes: ModalBasis, dt, nodes, weight, inside) -> tuple:
    """Return weights of the drive at the Gauss points, and the quadratic form of the viscous loss.

    `tables` multiplies the weights by the drive.
    """
    n = modes.omega.size
    base = modes.base
    mass = modes.mass
    m = nodes.size
    _, zv, vz, vv = inside
    coupled = modes.damping is not None
    back = free_motion(modes, dt - nodes)

    def times_base(part):
        return part @ base if coupled else part * base

    def base_times(part):
        return np.einsum("i,kij->kj", base, part) if coupled else part * base

    # velocity at point k per drive at point j: -int_0^tau_k E_vv(tau_k - s) base l_j(s) ds
    inner = np.empty((m, m, n))
    share = (1 + np.polynomial.legendre.leggauss(m)[0]) / 2
    for k, tau in enumerate(nodes):
        reply = times_base(free_motion(modes, tau * (1 - share))[3])
        spread = _lagrange_polynomials(nodes, tau * share) * (weight * tau / dt)[:, None]
        inner[k] = -spread.T @ reply
    if coupled:
        d = (modes.damping + modes.damping.T) / 2
        damped = np.einsum("ij,klj->kli", d, inner)
    else:
        d = 2 * modes.zeta * modes.omega
        damped = inner * d
    parts = {
        "z": -weight[:, None] * times_base(back[1]),
        "v": -weight[:, None] * times_base(back[3]),
        "wz": -mass * weight[:, None] * base_times(vz),
        "wv": -mass * weight[:, None] * base_times(vv),
        "wf": -mass * weight[:, None] * base_times(zv),
        "work": -mass * weight[:, None] * (inner @ base),
        "lost": mass * np.einsum("k,kji,kli->jl", weight, damped, inner),
    }
    for key, part in (("dz", vz), ("dv", vv), ("df", zv)):
        rule = "k,kji,kil->jl" if coupled else "k,kjl,kl->jl"
        parts[key] = 2 * mass * np.einsum(rule, weight, damped, part)
    if coupled:
        whole = np.concatenate([vz, vv, zv], axis=2)
        return parts, mass * np.einsum("k,kai,ab,kbj->ij", weight, whole, d, whole)
    pairs = (vz * vz, 2 * vz * vv, vv * vv, 2 * vz * zv, 2 * vv * zv, zv * zv)
    return parts, np.stack([mass * d * (weight @ pair) for pair in pairs])


def _lagrange_polynomials(nodes, at) -> np.ndarray:
    """Return the Lagrange polynomials (k, m) of the nodes (m,) at the points `at` (k,)."""
    gap = nodes[:, None] - nodes
    np.fill_diagonal(gap, 1.0)
    scale = 1 / np.prod(gap / np.ptp(nodes), axis=1)
    apart = (at[:, None] - nodes) / np.ptp(nodes)
    hit = np.abs(apart) < 1e-15
    raw = scale / np.where(hit, 1.0, apart)
    out = raw / raw.sum(axis=1, keepdims=True)
    touched = hit.any(axis=1)
    out[touched] = hit[touched]
    return out
