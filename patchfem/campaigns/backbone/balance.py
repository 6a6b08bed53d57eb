"""Backbone of a mode from periodic motions that a negative damping or a force at the output sustains.

The motion is found by harmonic balance; under rigid friction it is exact from reversal to reversal, and without
friction it is an eigenvector. A negative damping of all coordinates gives frequency and damping ratio (extended
periodic motion: Krack, Comput. Struct. 154, 59, 2015). A force at the output in phase with the velocity there gives
the force of a test in phase resonance.
"""

import numpy as np

from ...core import NotConverged, PatchfemError
from ...dynamics import limit_cycles
from ...dynamics.harmonic.backbone import FreeSolution, find_free_motions, make_free_balance
from ...dynamics.harmonic.forces import LawGroup
from ...response.errors import convergence_error
from .joint import MIN_AMPLITUDE_OVER_GROSS_SLIP, JointMode
from .records import ROUND_OFF_ERROR, Curve, make_curve

# Numbers of harmonics that are tried in turn, each with four times the samples of the previous one.
HARMONIC_COUNTS = (9, 19, 39)
# Number of fixed-point steps to the damping that sustains the motion of a linear rig. They converge slowly where a force at
# the output moves other modes; where no force holds the phase resonance, the damping grows beyond 1 or changes without end.
N_DAMPING_ITERATIONS = 200
# A force holds the mode if the shape of the free motion has at least MIN_MODE_ENERGY_FRACTION of the kinetic energy of the
# motion under the force, else it holds another mode; and if this shape moves the output by what it moves in all, within
# MAX_OUTPUT_MOTION_DEVIATION of it. At an antiresonance other modes cancel most of the motion of the mode at the output.
MIN_MODE_ENERGY_FRACTION = 0.5
MAX_OUTPUT_MOTION_DEVIATION = 0.6
# Reason why a mode has no curve
NO_FREE_MOTION = "no free motion of these amplitudes was found"
# Reason why an overdamped mode has no curve
NO_OSCILLATION = "the mode does not oscillate at these amplitudes: its damping ratio is above 1"


def compute_balance_curve(
    joint: JointMode, amplitudes, counts: tuple[int, ...] = HARMONIC_COUNTS
) -> Curve:
    """Compute the backbone of a mode from periodic motions at amplitudes (k,) [m] of the output.

    Raises NotConverged or PatchfemError if there is no curve.

    Parameters
    ----------
    joint : JointMode
        Mode and joint of the backbone.
    amplitudes : (k,) array
        At the output [m], increasing.
    counts : tuple of int
        Numbers of harmonics that are tried in turn; with a single one the errors of the harmonics are not estimated.

    Returns
    -------
    Curve
        Frequency, damping ratio, loss and force with their errors, at the amplitudes at which the mode oscillates.
    """
    if joint.is_linear:
        return compute_constant_curve(joint, amplitudes)
    joint.require_steady_loops("balance")
    if joint.is_rigid:
        return _compute_rigid_curve(joint, amplitudes)

    # more harmonics until frequency and damping change by less than the tolerance
    laws = joint.steady_laws()
    tolerance = joint.model.accuracy.tolerance
    harmonics = counts[0]
    values, motions = tabulate_free_motions(laws, joint, amplitudes, harmonics)
    error = np.zeros_like(values)
    for harmonics in counts[1:]:
        # Beyond the last motion that few harmonics find, more harmonics find none.
        count = 1 + int(np.isfinite(values[0]).nonzero()[0].max(initial=-1))
        if not count:
            raise NotConverged(NO_FREE_MOTION)
        amplitudes = amplitudes[:count]
        better, motions = tabulate_free_motions(laws, joint, amplitudes, harmonics)
        error = convergence_error(better - values[:, :count]) + ROUND_OFF_ERROR * np.abs(better)
        values = better
        known = np.isfinite(error[0])
        if (error[:2] <= tolerance * np.abs(values[:2]))[:, known].all():
            break

    error += joint.spatial_discretization_errors(
        lambda mode, group: tabulate_free_motions(group, mode, amplitudes, counts[0])[0]
    )
    known = np.isfinite(values + error).all(axis=0)
    if not known.any():
        raise NotConverged(NO_FREE_MOTION)
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
    """Find the free motions of a mode at given amplitudes, each sustained by a negative damping.

    Parameters
    ----------
    group : LawGroup
        Laws of the interfaces on one mesh.
    joint : JointMode
        Mode and joint of the backbone.
    amplitudes : (k,) array
        Increasing, at the output [m].
    harmonics : int
        Number of harmonics of the motion.

    Returns
    -------
    values : (3, k) array
        Frequency [Hz], damping ratio and loss [J]; NaN if no motion is found.
    motions : list of FreeSolution or None
        Motion at each amplitude; None if no motion is found.
    """
    motions = _find_motions(group, joint, amplitudes, harmonics)
    values = np.full((3, len(amplitudes)), np.nan)
    for column, found in enumerate(motions):
        if found is not None:
            motion = found.motion
            values[:, column] = motion.omega / (2 * np.pi), motion.zeta, motion.loss
    return values, motions


def _find_motions(
    group: LawGroup, joint: JointMode, amplitudes, harmonics: int, excitation=None, starts=None
) -> list[FreeSolution | None]:
    """Find the free motions of a mode at given amplitudes of the output.

    Parameters
    ----------
    group : LawGroup
        Laws of the interfaces.
    joint : JointMode
        The mode and its contact.
    amplitudes : (k,) array
        Increasing amplitudes of the output [m].
    harmonics : int
        Number of harmonics.
    excitation : (n, n) array, optional
        Matrix E of `make_free_balance`.
    starts : list of (FreeSolution or None), optional
        Similar motions at the same amplitudes, from which the search starts.

    Returns
    -------
    list of (FreeSolution or None)
        None at an amplitude without a motion.
    """
    equations = make_free_balance(
        joint.modes,
        group,
        joint.mode,
        amplitudes[-1],
        harmonics,
        excitation,
        joint.modes.output,
        (harmonics // HARMONIC_COUNTS[0]) ** 2,
    )
    small = MIN_AMPLITUDE_OVER_GROSS_SLIP * joint.slip_amplitude
    return find_free_motions(equations, amplitudes, small, starts)


def find_forces(
    group: LawGroup,
    joint: JointMode,
    amplitudes,
    harmonics: int,
    motions: list[FreeSolution | None],
) -> np.ndarray:
    """Find the forces at the output that hold a mode at its phase resonance, in phase with the velocity.

    Parameters
    ----------
    group : LawGroup
        Laws of the interfaces.
    joint : JointMode
        The mode and its contact.
    amplitudes : (k,) array
        Amplitudes of the output [m].
    harmonics : int
        Number of harmonics.
    motions : list of (FreeSolution or None)
        Free motions at these amplitudes, from `tabulate_free_motions`.

    Returns
    -------
    (2, k) array
        Force [N] and its frequency [Hz]; NaN if no force holds the motion in the shape of the mode.
    """
    modes = joint.modes
    reach = joint.reach
    excitation = np.outer(modes.output, modes.output) / reach**2
    forced_motions = _find_motions(group, joint, amplitudes, harmonics, excitation, motions)
    out = np.full((2, len(amplitudes)), np.nan)
    for column, (free, forced) in enumerate(zip(motions, forced_motions)):
        if free is None or forced is None:
            continue
        motion = forced.motion
        if not _holds_mode(free.motion.modal[1], motion.modal[1], modes.output):
            continue
        # the excitation 2 zeta omega m E z' with E = output output^T/reach^2, as a force at the output
        output = abs(motion.modal[1] @ modes.output)
        force = 2 * motion.zeta * motion.omega**2 * modes.mass * output / reach**2
        out[:, column] = force, motion.omega / (2 * np.pi)
    return out


def _holds_mode(free: np.ndarray, forced: np.ndarray, output: np.ndarray) -> bool:
    """Return whether a motion under a force at the output is that of the mode, from its first harmonic.

    Parameters
    ----------
    free, forced : (n,) complex array
        Modal coordinates of the free motion and of the motion under the force, of equal modal mass.
    output : (n,) array
        Displacement of the output per modal coordinate.
    """
    # The part of the motion under the force that has the shape of the free motion (projection on it)
    part = free * np.vdot(free, forced) / np.vdot(free, free)
    energy = np.vdot(part, part).real / np.vdot(forced, forced).real
    whole = output @ forced
    max_deviation = MAX_OUTPUT_MOTION_DEVIATION * abs(whole)
    return energy >= MIN_MODE_ENERGY_FRACTION and abs(output @ part - whole) <= max_deviation


def _compute_rigid_curve(joint: JointMode, amplitudes) -> Curve:
    """Compute the backbone of a mode under rigid friction (set-valued, without stick stiffness).

    It begins at the amplitude above which the motion does not stop within a cycle.

    Parameters
    ----------
    joint : JointMode
        Mode with a contact of one interface.
    amplitudes : (k,) array
        Amplitudes at the output [m].

    Returns
    -------
    Curve
        Only the amplitudes above which the motion does not stop within a cycle.
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

    # Friction stops the motion in each cycle at the amplitudes that are left out.
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
    """Return the backbone of a mode of a linear rig, the same at all amplitudes (k,) [m].

    `joint` is the mode. The force of phase resonance grows in proportion to the amplitude.
    """
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
    """Return frequency [rad/s] and damping ratio of a mode of a linear rig, sustained by a negative damping.

    The motion is a solution of z'' + (D - 2 zeta omega E) z' + Omega^2 z = 0 with constant amplitude. D and Omega are
    the damping matrix and the natural frequencies of the rig, and `excitation` is the distribution E (n, n) of the
    negative damping. Both results are None if the mode of the `joint` does not oscillate, or if no such motion of it is
    found.
    """
    rate = 0.0
    for _ in range(N_DAMPING_ITERATIONS):
        rate -= 2 * _find_mode_eigenvalue(joint, rate * excitation).real
    sustained = _find_mode_eigenvalue(joint, rate * excitation)
    omega = abs(sustained)
    damped = _find_mode_eigenvalue(joint, 0.0 * excitation)
    # Where the eigenvector of the mode changes with the damping, the steps may not converge.
    is_found = abs(sustained.real) <= ROUND_OFF_ERROR * omega
    if not (damped.imag and rate < 2 * omega and is_found):
        return None, None
    return omega, rate / (2 * omega)


def _find_mode_eigenvalue(joint: JointMode, negative_damping: np.ndarray) -> complex:
    """Return the eigenvalue [1/s] of z'' + (D - G) z' + Omega^2 z = 0 whose eigenvector has the largest component in a mode.

    D and Omega are damping matrix and natural frequencies of the rig, `negative_damping` is G (n, n) [1/s], and `joint`
    tells the mode.
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
