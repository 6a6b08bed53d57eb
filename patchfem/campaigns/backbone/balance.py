"""Backbone of a mode from periodic motions that a negative damping or a force at the output sustains.

The motion is found by harmonic balance; under rigid friction it is exact from reversal to reversal, and without
friction it is an eigenvector. A negative damping of all coordinates gives frequency and damping ratio (extended
periodic motion: Krack, Comput. Struct. 154, 59, 2015). A force at the output in phase with the velocity there gives
the force of a test in phase resonance.
"""

from typing import NamedTuple

import numpy as np

from ...core import NotConverged, PatchfemError
from ...dynamics import limit_cycles
from ...dynamics.harmonic.backbone import FreeBalance, FreeMotion
from ...dynamics.harmonic.forces import LawGroup
from ...dynamics.harmonic.harmonic import pack_harmonics
from ...dynamics.harmonic.laws import evaluate_series
from ...dynamics.harmonic.point import find_peak, make_balance
from ...response.errors import convergence_error
from .joint import MIN_AMPLITUDE_FACTOR, JointMode
from .records import AMPLITUDE_TOL, ROUND_OFF_ERROR, Curve, make_curve

# Numbers of harmonics that are tried in turn, each with four times the samples of the previous one.
HARMONIC_COUNTS = (9, 19, 39)
# Largest number of samples per cycle: more take too long, and 39 harmonics need fewer.
MAX_SAMPLES = 65536
N_SAMPLES = 4096  # Number of samples per cycle from which the largest displacement is determined.
MAX_STEPS = 8  # Largest number of secant steps to the motion of the requested output amplitude.
# Smallest slope of log(output) with respect to log(modal amplitude) at which a secant step is
# taken.
MIN_SLOPE = 0.1
# Number of fixed-point steps to the damping that sustains the motion of a linear rig; they converge fast.
N_LINEAR_STEPS = 8
NO_MOTION = "no free motion of these amplitudes was found"
NO_OSCILLATION = "the mode does not oscillate at these amplitudes: its damping ratio is above 1"


def compute_balance_curve(joint: JointMode, amplitudes) -> Curve:
    """Compute the backbone of a mode from periodic motions at amplitudes (k,) [m] of the output.

    Raises NotConverged or PatchfemError if there is no curve.
    """
    if joint.is_linear:
        return compute_constant_curve(joint, amplitudes)
    joint.require_steady_loops("balance")
    if joint.is_rigid:
        return _compute_rigid_curve(joint, amplitudes)

    # more harmonics until frequency and damping change by less than the tolerance
    laws = joint.steady_laws()
    tolerance = joint.model.accuracy.tolerance
    values, _ = tabulate_free_motions(laws, joint, amplitudes, HARMONIC_COUNTS[0])
    for harmonics in HARMONIC_COUNTS[1:]:
        # Beyond the last motion that few harmonics find, more harmonics find none.
        count = 1 + int(np.isfinite(values[0]).nonzero()[0].max(initial=-1))
        if not count:
            raise NotConverged(NO_MOTION)
        amplitudes = amplitudes[:count]
        better, motions = tabulate_free_motions(laws, joint, amplitudes, harmonics)
        error = convergence_error(better - values[:, :count]) + ROUND_OFF_ERROR * np.abs(better)
        values = better
        known = np.isfinite(error[0])
        if (error[:2] <= tolerance * np.abs(values[:2]))[:, known].all():
            break

    error += joint.spatial_discretization_errors(
        lambda mode, group: tabulate_free_motions(group, mode, amplitudes, HARMONIC_COUNTS[0])[0]
    )
    known = np.isfinite(values + error).all(axis=0)
    if not known.any():
        raise NotConverged(NO_MOTION)
    oscillates = known & (values[1] < 1)
    if not oscillates.any():
        raise NotConverged(NO_OSCILLATION)

    # The force is proportional to the damping ratio and to the square of the frequency.
    forces = np.full((2, amplitudes.size), np.nan)
    if joint.has_force:
        forces = find_forces(laws, joint, amplitudes, harmonics, motions)
    relative_error = error[1] / np.maximum(np.abs(values[1]), 1e-300) + 2 * error[0] / values[0]
    error = np.vstack([error, np.abs(forces[0]) * (relative_error + ROUND_OFF_ERROR)])
    return make_curve(amplitudes, np.vstack([values, forces]), error).at(oscillates)


def tabulate_free_motions(
    group: LawGroup, joint: JointMode, amplitudes, harmonics: int
) -> tuple[np.ndarray, list]:
    """Find the motions that a negative damping sustains.

    Parameters
    ----------
    group : LawGroup
    joint : JointMode
    amplitudes : (k,) array
        Increasing, at the output [m].
    harmonics : int

    Returns
    -------
    values : (3, k) array
        Frequency [Hz], damping ratio and loss [J]; NaN if no motion is found.
    motions : list of Solution or None
    """
    motions = FreeMotionSolver(group, joint, amplitudes[-1], harmonics).solve(amplitudes)
    values = np.full((3, len(amplitudes)), np.nan)
    for column, motion in enumerate(motions):
        if motion is not None:
            free = motion.free
            work = (np.conj(free.slides) * free.forces).imag
            loss = np.pi * float(np.sum(np.arange(harmonics + 1) * work))
            values[:, column] = free.omega / (2 * np.pi), free.zeta, loss
    return values, motions


def find_forces(
    group: LawGroup, joint: JointMode, amplitudes, harmonics: int, motions: list
) -> np.ndarray:
    """Find the forces at the output that hold the phase resonance, from the motions of `tabulate_free_motions`.

    Returns
    -------
    (2, k) array
        Force [N] and its frequency [Hz]; NaN if no force holds the motion.
    """
    modes = joint.modes
    reach = abs(float(modes.output @ joint.shape))
    excitation = np.outer(modes.output, modes.output) / reach**2
    solver = FreeMotionSolver(group, joint, amplitudes[-1], harmonics, excitation)
    motions = solver.solve(amplitudes, motions)
    out = np.full((2, len(amplitudes)), np.nan)
    for column, motion in enumerate(motions):
        if motion is not None:
            # the excitation 2 zeta omega m E z' with E = output output^T/reach^2, as a force at the output
            free = motion.free
            output = abs(free.modal[1] @ modes.output)
            force = 2 * free.zeta * free.omega**2 * modes.mass * output / reach**2
            out[:, column] = force, free.omega / (2 * np.pi)
    return out


class Solution(NamedTuple):
    """Motion at an amplitude with its unknowns (N,), and amplitude at the output / that of the coordinate."""

    free: FreeMotion
    unknowns: np.ndarray
    reach: float


class FreeMotionSolver:
    """Solver for the periodic motions of a mode by harmonic balance.

    Parameters
    ----------
    group : LawGroup
        Steady loops of the laws.
    joint : JointMode
    max_amplitude : float
        Largest amplitude at the output [m].
    harmonics : int
    excitation : (n, n) array, optional
        Excitation in place of the negative damping of all coordinates, as in `FreeBalance`.
    """

    def __init__(
        self,
        group: LawGroup,
        joint: JointMode,
        max_amplitude: float,
        harmonics: int,
        excitation: np.ndarray | None = None,
    ):
        modes = joint.modes
        omega, shape = modes.compute_stuck_mode(group.rows, group.stiffness(), joint.mode)
        self.output = modes.output
        self.reach = abs(float(modes.output @ shape))
        widest = np.abs(group.rows @ shape) * max_amplitude / self.reach
        samples = group.samples or group.samples_for(harmonics, widest)
        samples = min(samples * (harmonics // HARMONIC_COUNTS[0]) ** 2, MAX_SAMPLES)
        balance = make_balance(modes, group, samples)
        self.equations = FreeBalance(balance, joint.mode, harmonics, omega, excitation)

        # the stuck mode as initial guess, and an amplitude at which it is nearly exact
        balance = self.equations.balance
        faces = np.zeros((balance.lift.shape[1], harmonics + 1), complex)
        faces[:, 1] = balance.faces @ shape
        self.stuck = np.append(pack_harmonics(faces), [1.0, 0.0])
        self.small = MIN_AMPLITUDE_FACTOR * float(joint.slip_amplitude) / self.reach

    def solve(self, amplitudes, starts: list | None = None) -> list[Solution | None]:
        """Solve for the motions at increasing amplitudes (k,) [m] of the output; None where none is found.

        A search starts from the similar motion in `starts`, else from the motion at the amplitude before. If there is
        none, for example after a fold of the curve, it starts from the sticking mode, for the first motion also via a
        small amplitude. Motions that are still missing are then searched for from the motion at the next larger
        amplitude.
        """
        out: list[Solution | None] = [None] * len(amplitudes)
        for k, amplitude in enumerate(amplitudes):
            neighbours = [starts[k]] if starts else []
            neighbours.append(out[k - 1] if k else None)
            for neighbour in neighbours:
                out[k] = out[k] or self._solve_from_neighbour(neighbour, amplitude)
            out[k] = out[k] or self._solve_from_stuck_mode(amplitude, is_first=not any(out))
        for k in range(len(amplitudes) - 2, -1, -1):
            out[k] = out[k] or self._solve_from_neighbour(out[k + 1], amplitudes[k])
        return out

    def _solve_from_neighbour(
        self, neighbour: Solution | None, amplitude: float
    ) -> Solution | None:
        """Solve at an amplitude [m] with a similar motion as initial guess; None if this fails."""
        if neighbour is None:
            return None
        here = amplitude / neighbour.reach
        try:
            return self._solve_at_output_amplitude(neighbour.unknowns, here, amplitude)
        except NotConverged:
            # The amplitudes are too far apart for a single step.
            pass
        try:
            start = neighbour.free.amplitude
            x = self.equations.follow_to_amplitude(neighbour.unknowns, start, here)
            return self._solve_at_output_amplitude(x, here, amplitude)
        except NotConverged:
            return None

    def _solve_from_stuck_mode(self, amplitude: float, *, is_first: bool) -> Solution | None:
        """Solve at an amplitude [m] with the stuck mode as initial guess; None if this fails.

        is_first: whether a search via a small amplitude is tried as well.
        """
        here = amplitude / self.reach
        solve = self.equations.solve
        try:
            try:
                x = solve(self.stuck, here)[0]
            except NotConverged:
                if not (is_first and self.small < here):
                    raise
                x = solve(self.stuck, self.small)[0]
                x = self.equations.follow_to_amplitude(x, self.small, here)
            return self._solve_at_output_amplitude(x, here, amplitude)
        except NotConverged:
            return None

    def _solve_at_output_amplitude(self, x, here: float, amplitude: float) -> Solution:
        """Solve for the motion at an amplitude of the output by secant steps.

        The steps end at the round-off error. If they lead no further, a difference up to AMPLITUDE_TOL is accepted.

        Parameters
        ----------
        x : (N,) array
            Unknowns near the amplitude of the coordinate.
        here : float
            Amplitude of the coordinate [m].
        amplitude : float
            Requested amplitude at the output [m].

        Raises
        ------
        NotConverged
            If no motion with this amplitude is found.
        """
        slope = 1.0
        before = None
        best = None
        best_distance = np.inf
        for _ in range(MAX_STEPS):
            try:
                x, free = self.equations.solve(x, here)
            except NotConverged:
                if best is None:
                    raise
                break
            largest = half_peak_to_peak(free.modal @ self.output)
            distance = float(np.log(largest / amplitude))
            if best is not None and abs(distance) >= best_distance:
                break
            if abs(distance) < AMPLITUDE_TOL:
                best_distance = abs(distance)
                best = Solution(free, x, amplitude / here)
            if abs(distance) < ROUND_OFF_ERROR:
                break

            # secant step in logarithms; near a turning point of the amplitude the slope is useless
            if before is not None:
                last_here, last_distance = before
                slope = (distance - last_distance) / np.log(here / last_here)
            slope = slope if slope > MIN_SLOPE else 1.0
            before = (here, distance)
            here *= np.exp(-distance / slope)
        if best is None:
            raise NotConverged(NO_MOTION)
        return best


def half_peak_to_peak(harmonics) -> float:
    """Return half the peak-to-peak value of a motion given by its harmonics (H + 1,)."""
    motion = evaluate_series(harmonics, N_SAMPLES)
    return (find_peak(motion) + find_peak(-motion)) / 2


def _compute_rigid_curve(joint: JointMode, amplitudes) -> Curve:
    """Compute the backbone of a mode under rigid friction in closed form.

    It begins at the amplitude above which the motion does not stop within a cycle.
    """
    model = joint.model
    modes = joint.modes
    if model.rig.springs.is_nonlinear or not modes.omega.all():
        raise PatchfemError(
            "with rigid friction the free motion cannot be computed if the rig has a nonlinear "
            "spring or a mode of 0 Hz"
        )
    static = joint.friction_limit
    friction = model.friction
    kinetic = static
    if friction.kinetic is not None:
        kinetic = static * friction.kinetic / friction.static
    row = modes.interfaces[0]
    motions = limit_cycles.trace_relay_backbone(
        modes, row, (kinetic, static), amplitudes, joint.mode
    )
    known = np.array([motion is not None for motion in motions])
    if not known.any():
        raise NotConverged(
            "at these amplitudes rigid friction stops the motion in each cycle, and only a motion "
            "that always slides can be computed; give larger amplitudes"
        )
    amplitude = np.asarray(amplitudes)[known]
    cycles, ratios = zip(*filter(None, motions))
    omega = np.array([cycle.omega for cycle in cycles])
    frequency = omega / (2 * np.pi)
    damping = np.array(ratios)
    relative_error = np.array([cycle.error / cycle.amplitude for cycle in cycles])
    # The damping of the structure does not depend on the amplitude, so that only the frictional
    # damping has an error.
    structure_rate = modes.damping_matrix[joint.mode, joint.mode]
    friction_damping = damping - structure_rate / (4 * np.pi * frequency)
    damping_error = relative_error * np.abs(friction_damping) + ROUND_OFF_ERROR * np.abs(damping)

    # The force of one mode follows from the first harmonic; half the range has the third one as well, which is
    # 4 F/(3 pi) of the square wave of friction over the dynamic stiffness 8 m omega^2.
    loss = force = third = np.full(amplitude.size, np.nan)
    if modes.omega.size == 1:
        slide = amplitude * abs(row[joint.mode] / modes.output[joint.mode])
        loss = 4 * kinetic * slide
        third = kinetic * row[0] ** 2 / (6 * np.pi * modes.mass * omega**2 * slide)
        force = 2 * damping * omega**2 * modes.mass * amplitude / modes.output[0] ** 2
    errors = (
        (relative_error + ROUND_OFF_ERROR) * frequency,
        damping_error,
        np.zeros(amplitude.size),
        (third + relative_error) * np.abs(force),
    )
    return make_curve(amplitude, (frequency, damping, loss, force), errors)


def compute_constant_curve(joint: JointMode, amplitudes) -> Curve:
    """Return frequency and damping of a mode of a linear rig, the same at all amplitudes (k,) [m]."""
    modes = joint.modes
    omega, zeta = _sustain_linear_motion(joint, np.eye(modes.omega.size))
    if omega is None:
        raise NotConverged("the mode does not oscillate: its damping ratio is 1 or more")
    excitation = np.outer(modes.output, modes.output) / joint.reach**2
    forced_omega, forced_zeta = _sustain_linear_motion(joint, excitation)
    force = forced_frequency = np.nan
    if forced_omega is not None:
        force = 2 * forced_zeta * forced_omega**2 * modes.mass / joint.reach**2
        forced_frequency = forced_omega / (2 * np.pi)
    values = [omega / (2 * np.pi), zeta, np.nan, force, forced_frequency]
    rows = np.outer(values, np.ones(amplitudes.size))
    rows[3] *= amplitudes
    return make_curve(amplitudes, rows, ROUND_OFF_ERROR * np.abs(rows))


def _sustain_linear_motion(
    joint: JointMode, excitation: np.ndarray
) -> tuple[float, float] | tuple[None, None]:
    """Return the frequency omega [rad/s] and zeta of a linear motion z'' + (D - 2 zeta omega E) z' + Omega^2 z = 0.

    Both are None if the mode does not oscillate. excitation: E (n, n).
    """
    rate = 0.0
    for _ in range(N_LINEAR_STEPS):
        rate -= 2 * _find_mode_eigenvalue(joint, rate * excitation).real
    omega = abs(_find_mode_eigenvalue(joint, rate * excitation))
    damped = _find_mode_eigenvalue(joint, 0.0 * excitation)
    if not (damped.imag and rate < 2 * omega):
        return None, None
    return omega, rate / (2 * omega)


def _find_mode_eigenvalue(joint: JointMode, negative_damping: np.ndarray) -> complex:
    """Return the eigenvalue of z'' + (D - G) z' + Omega^2 z = 0 that belongs to the mode.

    Its eigenvector has the largest component of the mode. negative_damping: G (n, n) [1/s].
    """
    modes = joint.modes
    n = modes.omega.size
    matrix = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-np.diag(modes.omega**2), negative_damping - modes.damping_matrix],
        ]
    )
    values, vectors = np.linalg.eig(matrix)
    size = np.abs(vectors[joint.mode]) / np.linalg.norm(vectors[:n], axis=0)
    return values[np.argmax(size)]
