"""Backbone of a mode from periodic motions sustained by negative damping (Krack 2015).

The motion is found by harmonic balance; under rigid friction it is exact from reversal to reversal.
"""

from typing import NamedTuple

import numpy as np

from ...core import NotConverged, PatchfemError
from ...dynamics import limit_cycles
from ...dynamics.harmonic.backbone import FreeBalance
from ...dynamics.harmonic.forces import LawGroup
from ...dynamics.harmonic.harmonic import pack_harmonics
from ...dynamics.harmonic.laws import evaluate_series
from ...dynamics.harmonic.point import find_peak, make_balance
from ...formatting import format_length
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


class FreeMotion(NamedTuple):
    """Periodic free motion of a mode at a given amplitude, computed by harmonic balance.

    free: a `harmonic.backbone.FreeMotion`; unknowns: (N,); reach: amplitude at the output / amplitude of
    the coordinate.
    """

    free: object
    unknowns: np.ndarray
    reach: float


def compute_balance_curve(joint: JointMode, amplitudes) -> Curve:
    """Compute the backbone of a mode by harmonic balance, or exactly under rigid friction."""
    joint.require_steady_loops("balance")
    if joint.is_rigid:
        return _compute_rigid_curve(joint, amplitudes)
    laws = joint.steady_laws()
    tolerance = joint.model.accuracy.tolerance
    values = _tabulate_free_motions(laws, joint, amplitudes, HARMONIC_COUNTS[0])
    for harmonics in HARMONIC_COUNTS[1:]:
        count = 1 + int(np.isfinite(values[0]).nonzero()[0].max(initial=-1))
        if not count:
            raise NotConverged("no free motion of these amplitudes was found")
        better = _tabulate_free_motions(laws, joint, amplitudes, harmonics, count)
        error = convergence_error(better - values) + ROUND_OFF_ERROR * np.abs(better)
        values = better
        known = np.isfinite(error[0])
        if (error[:2] <= tolerance * np.abs(values[:2]))[:, known].all():
            break
    error += joint.spatial_discretization_errors(
        lambda mode, group: _tabulate_free_motions(group, mode, amplitudes, HARMONIC_COUNTS[0])
    )
    known = np.isfinite(values + error).all(axis=0)
    if not known.any():
        raise NotConverged("no free motion of these amplitudes was found")
    oscillates = known & (values[1] < 1)
    if not oscillates.any():
        raise NotConverged(
            "the mode does not oscillate at these amplitudes: its damping ratio is above 1"
        )
    return make_curve(amplitudes, values, error).at(oscillates)


def _tabulate_free_motions(
    group: LawGroup, joint: JointMode, amplitudes, harmonics: int, count=None
) -> np.ndarray:
    """Return frequency [Hz], damping ratio and energy loss [J] (3, k) of free motions.

    They are NaN if no motion is found, and for all amplitudes after the first `count`.

    Parameters
    ----------
    group : LawGroup
    joint : JointMode
    amplitudes : (k,) array
        At the output [m].
    harmonics : int
    count : int, optional
        Number of amplitudes for which motions are computed; by default all.
    """
    order = np.arange(harmonics + 1)
    out = np.full((3, len(amplitudes)), np.nan)
    motions = find_free_motions(group, joint, amplitudes[:count], harmonics)
    for column, motion in enumerate(motions):
        if motion is not None:
            work = (np.conj(motion.slides) * motion.forces).imag
            loss = np.pi * float(np.sum(order * work))
            out[:, column] = motion.omega / (2 * np.pi), motion.zeta, loss
    return out


def find_free_motions(
    group: LawGroup, joint: JointMode, amplitudes, harmonics: int, amplitude_tol=ROUND_OFF_ERROR
) -> list:
    """Find the free motions at amplitudes (k,) [m] of the output by harmonic balance.

    The search starts from the motion at the amplitude before. If there is none, for example after a
    fold of the curve, it starts from the sticking mode, for the first motion also via a small
    amplitude. Motions that are still missing are then searched for from the motion at the next
    larger amplitude.

    Parameters
    ----------
    group : LawGroup
        Steady loops of the laws.
    joint : JointMode
    amplitudes : (k,) array
        Increasing [m].
    harmonics : int
    amplitude_tol : float
        Largest relative difference of the amplitude of a motion from the requested one. A larger
        tolerance saves most of the time.

    Returns
    -------
    list of FreeMotion or None
        `dynamics.harmonic.backbone.FreeMotion`; None if no motion is found.
    """
    search = _FreeMotionSearch(group, joint, amplitudes, harmonics, amplitude_tol)
    out: list = [None] * len(amplitudes)
    for k, amplitude in enumerate(amplitudes):
        before = out[k - 1] if k else None
        out[k] = search.solve_from_neighbour(before, amplitude)
        if out[k] is None:
            out[k] = search.solve_from_stuck_mode(amplitude, is_first=not any(out))
    for k in range(len(amplitudes) - 2, -1, -1):
        out[k] = out[k] or search.solve_from_neighbour(out[k + 1], amplitudes[k])
    return [motion and motion.free for motion in out]


class _FreeMotionSearch:
    """Solver for the free motions of a mode; the initial guess is the motion at the next amplitude, or the stuck mode.

    Parameters
    ----------
    group : LawGroup
        Steady loops of the laws.
    joint : JointMode
    amplitudes : (k,) array
        Increasing, at the output [m].
    harmonics : int
    amplitude_tol : float
        See `find_free_motions`.
    """

    def __init__(
        self, group: LawGroup, joint: JointMode, amplitudes, harmonics: int, amplitude_tol: float
    ):
        self.amplitude_tol = amplitude_tol
        modes = joint.modes
        omega, shape = modes.compute_stuck_mode(group.rows, group.stiffness(), joint.mode)
        self.joint = joint
        self.reach = abs(float(modes.output @ shape))
        widest = np.abs(group.rows @ shape) * amplitudes[-1] / self.reach
        samples = group.samples or group.samples_for(harmonics, widest)
        samples = min(samples * (harmonics // HARMONIC_COUNTS[0]) ** 2, MAX_SAMPLES)
        balance = make_balance(modes, group, samples)
        self.equations = FreeBalance(balance, joint.mode, harmonics, omega)
        balance = self.equations.balance
        faces = np.zeros((balance.lift.shape[1], harmonics + 1), complex)
        faces[:, 1] = balance.faces @ shape
        self.first = np.append(pack_harmonics(faces), [1.0, 0.0])
        self.small = MIN_AMPLITUDE_FACTOR * float(joint.slip_amplitude) / self.reach

    def solve_from_neighbour(
        self, neighbour: FreeMotion | None, amplitude: float
    ) -> FreeMotion | None:
        """Solve at an amplitude [m] with a neighbouring motion as initial guess; None if this fails."""
        if neighbour is None:
            return None
        here = amplitude / neighbour.reach
        try:
            return self._solve_at_output_amplitude(neighbour.unknowns, here, amplitude)
        except NotConverged:
            # The amplitudes are too far apart for a single step.
            pass
        try:
            x = self.equations.follow_to_amplitude(
                neighbour.unknowns, neighbour.free.amplitude, here
            )
            return self._solve_at_output_amplitude(x, here, amplitude)
        except NotConverged:
            return None

    def solve_from_stuck_mode(self, amplitude: float, *, is_first: bool) -> FreeMotion | None:
        """Solve at an amplitude [m] with the stuck mode as initial guess; None if this fails.

        is_first: whether a search via a small amplitude is tried as well.
        """
        here = amplitude / self.reach
        try:
            if is_first:
                x = _follow_from_stuck_mode(self.equations, self.first, self.small, here)
            else:
                x = self.equations.solve(self.first, here)[0]
            return self._solve_at_output_amplitude(x, here, amplitude)
        except NotConverged:
            return None

    def _solve_at_output_amplitude(
        self, x, coordinate_amplitude: float, amplitude: float
    ) -> FreeMotion:
        """Solve for the free motion at an amplitude of the output [m] by secant steps.

        The steps end at the tolerance of the amplitude. If they lead no further, a difference up to
        AMPLITUDE_TOL is accepted.

        Parameters
        ----------
        x : (N,) array
            Unknowns near the amplitude of the coordinate.
        coordinate_amplitude : float
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
                x, free = self.equations.solve(x, coordinate_amplitude)
            except NotConverged:
                if best is None:
                    raise
                break
            largest = half_peak_to_peak(free.modal @ self.joint.modes.output)
            distance = float(np.log(largest / amplitude))
            if best is not None and abs(distance) >= best_distance:
                break
            if abs(distance) < max(AMPLITUDE_TOL, self.amplitude_tol):
                best_distance = abs(distance)
                best = FreeMotion(free, x, amplitude / coordinate_amplitude)
            if abs(distance) < self.amplitude_tol:
                break
            if before is not None:
                last_here, last_distance = before
                slope = (distance - last_distance) / np.log(coordinate_amplitude / last_here)
            slope = slope if slope > MIN_SLOPE else 1.0
            before = (coordinate_amplitude, distance)
            coordinate_amplitude *= np.exp(-distance / slope)
        if best is not None:
            return best
        raise NotConverged(
            f"no free motion has an amplitude of {format_length(amplitude, 3)} at the output"
        )


def _follow_from_stuck_mode(equations: FreeBalance, first, small: float, here: float) -> np.ndarray:
    """Solve for the free motion at a coordinate amplitude [m], continued from the stuck mode.

    If this fails, solve first at the amplitude `small` [m] and continue from there.
    """
    try:
        return equations.solve(first, here)[0]
    except NotConverged:
        if not small < here:
            raise
        return equations.follow_to_amplitude(equations.solve(first, small)[0], small, here)


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
    frequency = np.array([cycle.omega / (2 * np.pi) for cycle in cycles])
    damping = np.array(ratios)
    loss = np.full(amplitude.size, np.nan)
    if modes.omega.size == 1:
        loss = 4 * kinetic * amplitude * abs(row[joint.mode] / modes.output[joint.mode])
    relative_error = np.array([cycle.error / cycle.amplitude for cycle in cycles])
    # The damping of the structure does not depend on the amplitude, so that only the frictional
    # damping has an error.
    structure_rate = modes.damping_matrix[joint.mode, joint.mode]
    friction_damping = damping - structure_rate / (4 * np.pi * frequency)
    frequency_error = (relative_error + ROUND_OFF_ERROR) * frequency
    damping_error = relative_error * np.abs(friction_damping) + ROUND_OFF_ERROR * np.abs(damping)
    errors = (frequency_error, damping_error)
    return make_curve(amplitude, (frequency, damping, loss), errors)
