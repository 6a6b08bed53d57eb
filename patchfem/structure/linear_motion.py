"""Motion of a rig without friction under any drive, by exact steps of its linear equations.

In: modes, a drive and the state at the start. Out: `Steps`, block by block, with the states at Gauss points of each step.

In a step of length h the state x = (z, z') obeys x' = A x + b a(t). With the drive a(t) interpolated by a polynomial at
the N_NODES Gauss points of the step, the solution is exact: x(t + s) = exp(A s) x + sum_j g_j(s) a_j. No step contains an
instant at which the formula of the drive changes, and none is longer than a phase of its fastest vibration, so that the
polynomials of the drive, of the motion, and the Gauss rule for works have errors near round-off.
"""

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss

from ..core import InitialState, ModalBasis
from .drive_sizes import find_max_frequency_ratio
from .exponentials import exponential

N_NODES = 8  # Gauss points of a step; the polynomial of a sine over a phase of .4 rad has an error of 1e-13
BLOCK_STEPS = 2048  # steps that are computed together
SAME_LENGTH_TOL = 1e-9  # relative difference of the lengths of steps that count as equal
GAUSS_RULE = leggauss(N_NODES)  # points and weights between -1 and 1
NODES = (GAUSS_RULE[0] + 1) / 2  # Gauss points as fractions of a step
WEIGHTS = GAUSS_RULE[1] / 2  # weights of the Gauss points, whose sum is 1
POINTS = np.concatenate([[0.0], NODES, [1.0]])  # start, Gauss points and end of a step


class Steps(NamedTuple):
    """Successive steps of a linear motion.

    - times (k + 1,): ends of the steps [s].
    - states (k + 1, 2n): modal coordinates [m] and rates [m/s] at these times.
    - node_times (k, q), node_states (k, q, 2n): the same at the Gauss points of each step.
    - node_drive (k, q): drive signal at the Gauss points [m s-2].
    """

    times: np.ndarray
    states: np.ndarray
    node_times: np.ndarray
    node_states: np.ndarray
    node_drive: np.ndarray

    @property
    def lengths(self) -> np.ndarray:
        """Lengths (k,) of the steps [s]."""
        return np.diff(self.times)

    @property
    def points(self) -> np.ndarray:
        """States (k, q + 2, 2n) at the start, the Gauss points and the end of each step."""
        return np.concatenate(
            [self.states[:-1, None], self.node_states, self.states[1:, None]], axis=1
        )

    @property
    def point_drive(self) -> np.ndarray:
        """Drive signal (k, q + 2) at the start, the Gauss points and the end of each step [m s-2].

        At the ends it is that of the polynomial, so that it is the limit from inside the step where the drive jumps.
        """
        ends = self.node_drive @ interpolate(NODES, np.array([0.0, 1.0])).T
        return np.column_stack([ends[:, 0], self.node_drive, ends[:, 1]])

    def evaluate(self, times) -> np.ndarray:
        """Return the states (m, 2n) at times (m,) [s] inside the steps."""
        if not times.size:
            return np.zeros((0, self.states.shape[1]))
        step = np.clip(np.searchsorted(self.times, times, "right") - 1, 0, self.times.size - 2)
        fractions = (times - self.times[step]) / self.lengths[step]
        return np.einsum("mp,mpx->mx", interpolate(POINTS, fractions), self.points[step])


def interpolate(nodes, places) -> np.ndarray:
    """Return the matrix (m, p) that interpolates a polynomial from its values at p nodes to m places."""
    factors = places[:, None, None] - nodes
    scale = nodes[:, None] - nodes + np.eye(nodes.size)
    factors = np.where(np.eye(nodes.size, dtype=bool), 1.0, factors / scale)
    return factors.prod(axis=2)


class StepMaps(NamedTuple):
    """Linear maps of steps of l lengths: from the state at the start, and from the drive at the Gauss points.

    - free (l, q + 1, 2n, 2n): exp(A s) at the Gauss points and at the end of the step.
    - forced (l, q + 1, q, 2n): g_j at the same instants, for a drive that is 1 at one Gauss point and 0 at the others.
    """

    free: np.ndarray
    forced: np.ndarray


class LinearRig:
    """Linear equations of a rig, x' = A x + b a(t), with the maps of its steps.

    Parameters
    ----------
    modes : ModalBasis
        The n modes of the rig.
    max_phase : float
        Largest phase [rad] of the fastest vibration, or of the drive, in a step.
    """

    def __init__(self, modes: ModalBasis, max_phase: float):
        n = modes.omega.size
        self.modes = modes
        self.max_phase = max_phase
        self.powers = np.repeat([0.0, 1.0], n)  # units s^-0 and s^-1 of coordinates and rates
        self.matrix = np.zeros((2 * n, 2 * n))
        self.matrix[:n, n:] = np.eye(n)
        self.matrix[n:, :n] = np.diag(-(modes.omega**2))
        self.matrix[n:, n:] = -modes.damping_matrix
        self.push = np.append(np.zeros(n), -modes.base)
        self._find_maps = lru_cache(4)(self._compute_maps)

    @property
    def fastest_rate(self) -> float:
        """Largest magnitude of an eigenvalue of A [rad/s]."""
        return float(np.abs(np.linalg.eigvals(self.matrix)).max(initial=0.0))

    def _compute_maps(self, lengths: tuple[float, ...]) -> StepMaps:
        """Return the maps of steps of l lengths [s].

        The drive and its derivatives at the start of the step are further states, of which each is the rate of the one
        before, so that one matrix exponential has all maps.
        """
        size = self.matrix.shape[0]
        whole = np.zeros((size + N_NODES, size + N_NODES))
        whole[:size, :size] = self.matrix
        whole[:size, size] = self.push
        chain = np.arange(size, size + N_NODES - 1)
        whole[chain, chain + 1] = 1.0
        powers = np.append(self.powers, 2.0 + np.arange(N_NODES))
        lengths = np.array(lengths)
        maps = exponential(whole, lengths[:, None] * POINTS[1:], powers)

        # The drive sum_k c_k s^k/k! has the derivatives c_k at the start of the step; c_k h^k follows from its values.
        order = np.arange(N_NODES)
        factorials = np.cumprod(np.append(1.0, order[1:]))
        to_derivatives = np.linalg.inv(NODES[:, None] ** order / factorials)
        by_length = to_derivatives / lengths[:, None, None] ** order[:, None]
        forced = maps[..., :size, size:] @ by_length[:, None]
        return StepMaps(maps[..., :size, :size], np.swapaxes(forced, 2, 3))

    def follow(self, drive, start: InitialState, borders) -> Iterator[Steps]:
        """Yield the steps of the motion under a drive, in blocks.

        Parameters
        ----------
        drive : drives.DriveSignal
        start : InitialState
            State at the first border.
        borders : (m,) array
            Rising times [s] between which the steps have equal lengths, from the start to the end of the motion. They
            include those at which the formula of the drive changes.
        """
        fastest = max(self.fastest_rate, 2 * np.pi / drive.period * find_max_frequency_ratio(drive))
        spans = np.diff(borders)
        counts = np.ceil(spans * fastest / self.max_phase - SAME_LENGTH_TOL).astype(int)
        counts = np.maximum(1, counts)
        begins = np.repeat(borders[:-1], counts)
        lengths = np.repeat(spans / counts, counts)
        number = np.arange(lengths.size) - np.repeat(np.cumsum(counts) - counts, counts)
        times = np.append(begins + number * lengths, borders[-1])

        state = np.append(start.z, start.v)
        for first in range(0, lengths.size, BLOCK_STEPS):
            last = min(first + BLOCK_STEPS, lengths.size)
            steps = self._take_steps(drive, state, times[first : last + 1], lengths[first:last])
            state = steps.states[-1]
            yield steps

    def _take_steps(self, drive, state, times, lengths) -> Steps:
        """Follow the motion from a state (2n,) over steps between times (k + 1,) [s], of lengths (k,) [s]."""
        rounded = lengths[0] * np.round(lengths / lengths[0] / SAME_LENGTH_TOL) * SAME_LENGTH_TOL
        different, kind = np.unique(rounded, return_inverse=True)
        maps = self._find_maps(tuple(different.tolist()))
        node_times = times[:-1, None] + lengths[:, None] * NODES
        node_drive = drive.values(node_times.ravel()).reshape(node_times.shape)

        # What the drive adds to the state at the Gauss points and at the end of each step
        forced = np.einsum("ki,kjiy->kjy", node_drive, maps.forced[kind])
        states = np.concatenate([state[None], forced[:, -1]])
        if different.size == 1:
            # x_(k+1) = E x_k + f_k for all k by doubling: after round r each row has the effect of 2^r steps
            power = maps.free[0, -1].T
            distance = 1
            while distance < times.size:
                states[distance:] += states[:-distance] @ power
                power = power @ power
                distance *= 2
        else:
            for k, free in enumerate(maps.free[kind, -1]):
                states[k + 1] += free @ states[k]
        node_states = np.einsum("kx,kjyx->kjy", states[:-1], maps.free[kind, :-1])
        return Steps(times, states, node_times, node_states + forced[:, :-1], node_drive)
