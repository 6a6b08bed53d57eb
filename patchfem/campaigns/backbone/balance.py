"""Backbone of a mode from periodic motions that a negative damping or a force at the output sustains.

The motion is found by shooting (`event_driven.free_motions`), and without friction it is an eigenvector. A negative damping
of all coordinates gives frequency and damping ratio (extended periodic motion: Krack, Comput. Struct. 154, 59, 2015). A
force at the output in phase with the velocity there gives the force of a test in phase resonance.
"""

from dataclasses import replace

import numpy as np

from ...core import NotConverged, PatchfemError
from ...event_driven.cases import UndrivenRig
from ...event_driven.free_motions import RATE_SCALE, ROUGH, FreeMotion, FreeMotions, estimate_errors
from .joint import JointMode
from .records import ROUND_OFF_ERROR, Curve, make_curve

# A force holds the mode if the shape of the free motion has at least MIN_MODE_ENERGY_FRACTION of the kinetic energy of the
# motion under the force, else it holds another mode; and if this shape moves the output by what it moves in all, within
# MAX_OUTPUT_MOTION_DEVIATION of it. At an antiresonance other modes cancel most of the motion of the mode at the output.
MIN_MODE_ENERGY_FRACTION = 0.5
MAX_OUTPUT_MOTION_DEVIATION = 0.6
# Reason why a mode has no curve
NO_FREE_MOTION = "no free motion of these amplitudes was found"
# Reason why a mode under rigid friction has no curve
NO_SLIDING = (
    "at these amplitudes rigid friction stops the motion in each cycle, and only a motion that always slides can be "
    "computed; give larger amplitudes"
)
# Reason why an overdamped mode has no curve
NO_OSCILLATION = "the mode does not oscillate at these amplitudes: its damping ratio is above 1"


def compute_balance_curve(joint: JointMode, amplitudes) -> Curve:
    """Compute the backbone of a mode from periodic motions at amplitudes (k,) [m] of the output.

    Raises NotConverged or PatchfemError if there is no curve.

    Parameters
    ----------
    joint : JointMode
        Mode and joint of the backbone.
    amplitudes : (k,) array
        At the output [m], increasing.

    Returns
    -------
    Curve
        Frequency, damping ratio, loss and force with their errors, at the amplitudes at which the mode oscillates. Under
        rigid friction it begins at the amplitude above which the contact never rests.
    """
    if joint.is_linear:
        return compute_constant_curve(joint, amplitudes)
    joint.require_steady_loops("balance")
    rig = joint.steady_laws()
    if joint.is_rigid and not joint.modes.omega.all():
        raise PatchfemError(
            "with rigid friction the free motion cannot be computed if the rig has a mode of 0 Hz; "
            "use a law with a stiffness, such as elastic-plastic"
        )

    motions = FreeMotions(rig, joint.mode).find(amplitudes)
    sustained, errors = tabulate_motions(motions, has_errors=joint.has_errors)
    values = sustained[:3]
    error = errors[:3] + joint.spatial_discretization_errors(
        lambda mode, laws: tabulate_free_motions(laws, mode, amplitudes),
        amplitudes,
    )
    known = np.isfinite(values + error).all(axis=0)
    if not known.any():
        raise NotConverged(NO_SLIDING if joint.is_rigid else NO_FREE_MOTION)
    oscillates = known & (values[1] < 1)
    if not oscillates.any():
        raise NotConverged(NO_OSCILLATION)

    # The error of the mesh changes the force as it changes the damping and the square of the frequency.
    forces = force_errors = np.full((2, len(amplitudes)), np.nan)
    if joint.has_force:
        forces, force_errors = find_forces(rig, joint, amplitudes, motions)
    spatial = error - errors[:3]
    relative = spatial[1] / np.maximum(np.abs(values[1]), 1e-300) + 2 * spatial[0] / values[0]
    error = np.vstack([error, np.abs(forces[0]) * relative + force_errors[0]])
    return make_curve(amplitudes, np.vstack([values, forces]), error).at(oscillates)


def tabulate_motions(
    motions: list[FreeMotion | None], *, has_errors: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Tabulate free motions.

    Parameters
    ----------
    motions : list of (FreeMotion or None)
        (k,) motions of a mode at increasing amplitudes.
    has_errors : bool
        Whether the errors of the steps are estimated from motions with larger steps.

    Returns
    -------
    values : (4, k) array
        Frequency [Hz], damping ratio, loss [J] and force [N]; NaN without a motion in which the contact never rests.
    errors : (4, k) array
        Their errors; those of round-off alone without `has_errors`.
    """
    values = np.full((4, len(motions)), np.nan)
    rough = values.copy()
    distances = np.zeros_like(values)
    for k, motion in enumerate(motions):
        if motion is None or motion.sticks:
            continue
        values[:, k] = _list_values(motion)
        scales = _list_values(motion._replace(rate=RATE_SCALE * motion.omega))
        distances[:, k] = motion.distance * np.abs(scales)
        if has_errors:
            other = replace(motion.shooting.motions, accuracy=ROUGH).solve(motion.amplitude, motion)
            if other is not None:
                rough[:, k] = _list_values(other)
    if not has_errors:
        return values, ROUND_OFF_ERROR * np.abs(values)
    return values, estimate_errors(values, rough, distances)


def _list_values(motion: FreeMotion) -> np.ndarray:
    """Return frequency [Hz], damping ratio, loss [J] and force [N] of a free motion (4,)."""
    return np.array([motion.omega / (2 * np.pi), motion.zeta, motion.loss, motion.force])


def tabulate_free_motions(rig: UndrivenRig, joint: JointMode, amplitudes) -> np.ndarray:
    """Tabulate the free motions of a mode without their errors.

    Parameters
    ----------
    rig : UndrivenRig
        Laws of the interfaces on one mesh.
    joint : JointMode
        The mode and its contact.
    amplitudes : (k,) array
        Amplitudes of the output [m].

    Returns
    -------
    (3, k) array
        Frequency [Hz], damping ratio and loss [J]; NaN without a motion.
    """
    motions = FreeMotions(rig, joint.mode).find(amplitudes)
    return tabulate_motions(motions, has_errors=False)[0][:3]


def find_forces(
    rig: UndrivenRig, joint: JointMode, amplitudes, motions: list[FreeMotion | None]
) -> tuple[np.ndarray, np.ndarray]:
    """Find the forces at the output that hold the phase resonance.

    Parameters
    ----------
    rig : UndrivenRig
        Laws of the interfaces.
    joint : JointMode
        The mode and its contact.
    amplitudes : (k,) array
        Amplitudes of the output [m].
    motions : list of (FreeMotion or None)
        Free motions at these amplitudes.

    Returns
    -------
    values, errors : (2, k) array
        Force [N] and its frequency [Hz], and their errors; NaN if no force holds the motion in the shape of the mode.
    """
    forced = FreeMotions(rig, joint.mode, is_forced=True).find(amplitudes, motions)
    for k, (free, motion) in enumerate(zip(motions, forced)):
        if free is None or motion is None:
            forced[k] = None
        elif not _holds_mode(free.find_shape(), motion.find_shape(), joint.modes.output):
            forced[k] = None
    values, errors = tabulate_motions(forced, has_errors=joint.has_errors)
    return values[[3, 0]], errors[[3, 0]]


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


def compute_constant_curve(joint: JointMode, amplitudes) -> Curve:
    """Return the backbone of a mode of a linear rig, the same at all amplitudes (k,) [m].

    `joint` is the mode. The force of phase resonance grows in proportion to the amplitude.
    """
    modes = joint.modes
    omega, zeta = _sustain_linear_motion(joint, np.eye(modes.omega.size))
    if omega is None:
        raise NotConverged(
            "the mode does not oscillate: its damping ratio is 1 or more; "
            "give the mode less damping"
        )
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
    # Number of fixed-point steps to the damping that sustains the motion of a linear rig. They
    # converge slowly where a force at the output moves other modes; where no force holds the phase
    # resonance, the damping grows beyond 1 or changes without end.
    for _ in range(200):
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
