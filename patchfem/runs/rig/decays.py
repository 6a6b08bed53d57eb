"""Decay curve of a released rig: frequency and damping ratio over amplitude, with errors.

In: the Solution of a release and its coarse runs. Out: a `DecayCurve` whose errors include those
due to coarse runs and to the mesh.

As long as no node of either mesh slips, both meshes have the same decay, and both omit the
dissipation by micro-slip. Therefore the mesh error is computed from static hysteresis loops at the
same amplitudes (`partial_slip.mesh_correction`).
"""

from dataclasses import replace

import numpy as np

from ...convergence import MAX_CONVERGENCE_ORDER, convergence_error
from ...core import NotConverged, PatchfemError
from ...event_driven import quasi_static
from ...event_driven.cases import UndrivenRig
from ...measures.decay_curve import (
    MIN_HALF_CYCLE_RATIO,
    DecayCurve,
    fit_decay_curve,
    locate_reversals,
    make_half_cycles,
)
from ...partial_slip.mesh_correction import spread_elements
from ..patch import faces
from . import engines, joints
from .evaluation import Solution

CONTACTS_WITHOUT_STATIC_CURVE = (
    "the contact slides on grooves",
    "the normal load changes",
    "the bands of the face slide independently of one another",
)
UNKNOWN_LOOP_REASON = (
    "the hysteresis loop of this friction law is not known without a computation in time"
)
NO_STATIC_CURVE_REASON = "no static curve of the mode was found at these amplitudes"
MAX_DECAY_POINT_ERROR = 0.5  # Largest relative error at which a point of a decay curve is accepted.
# Number of amplitudes per decade at which the mesh error is computed.
MESH_AMPLITUDES_PER_DECADE = 16
# Largest ratio of two amplitudes whose changes by the mesh are pooled; it spans about a node's slip and the next one's
MAX_POOLED_RATIO = 1.6
# Half the width of a 95 % interval in standard deviations, which the root mean square of the changes estimates; it
# contained 98 % of the errors of damping and frequency on 98 random meshes, compared with 1281 nodes
ERROR_TO_CHANGE = 2.0


def compute_decay_curve(solution: Solution, coarser) -> DecayCurve | None:
    """Compute the decay curve of a released rig with error estimates; None if it has no points.

    The errors are those of the evaluation plus the changes in the coarse runs at the same
    amplitude. They are infinite outside the range of a coarse run. Points with a relative error
    above MAX_DECAY_POINT_ERROR are removed. `coarser` are pairs of a coarse run and its reference run, None for this run.
    """
    curve = _measure_decay_curve(solution)
    if not curve.time.size:
        return None
    for run, beside in coarser:
        reference = curve if beside is None else _measure_decay_curve(beside)
        curve = curve.add_change(_measure_decay_curve(run), reference)
    known = (curve.frequency_error <= MAX_DECAY_POINT_ERROR * curve.frequency) & (
        curve.damping_error <= MAX_DECAY_POINT_ERROR * np.abs(curve.damping)
    )
    return curve.select(known) if known.any() else None


def _measure_decay_curve(run: Solution) -> DecayCurve:
    """Measure the decay curve of a run from its half cycles while they decrease.

    After the last slip, the curve is that of the strongest mode of the free vibration, because the
    reversals of a sum of several modes belong to none of them.
    """
    motion = run.run.response
    mode = run.tail
    reversals = locate_reversals(motion.time, motion.output, motion.output_rate)
    half_cycles = fit_decay_curve(make_half_cycles(*reversals))
    if mode is None:
        return half_cycles
    time = np.arange(mode.begin, mode.end, 0.5 / mode.frequency)
    rate = 2 * np.pi * mode.frequency * mode.damping / np.sqrt(1 - mode.damping**2)
    amplitude = mode.displacement * np.exp(-rate * (time - mode.begin))
    zero = np.zeros(time.size)
    ringing = DecayCurve(time, amplitude, zero + mode.frequency, zero, zero + mode.damping, zero)
    ringing = ringing.select(amplitude > MIN_HALF_CYCLE_RATIO * np.abs(motion.output).max())
    slipping = half_cycles.select(half_cycles.time < mode.begin)
    return DecayCurve(*map(np.concatenate, zip(slipping, ringing)))


def make_laws_on_mesh(model, patch, meshed=()) -> UndrivenRig:
    """Return a rig without its drive, with friction laws discretized on one of the meshes of its patches.

    Parameters
    ----------
    model : Model
        Rig with its interfaces.
    patch : Patch or None
        Patch of [contact].
    meshed : tuple
        Indices of the interfaces whose patches have a coarser mesh.

    Raises
    ------
    PatchfemError
        If a law has no steady loop.
    """
    settings = engines.choose_numerics(with_automatic_method(model))
    return joints.make_undriven_rig(model, settings.vary_space(meshed=meshed), patch)


def make_laws_on_coarse_meshes(model, coarse, stiffer=None) -> list[UndrivenRig]:
    """Return rigs without a drive, each with one patch on its coarser mesh.

    Parameters
    ----------
    model : Model
        Rig with its interfaces.
    coarse : Patch or None
        Patch of [contact] on a coarser mesh.
    stiffer : joint.FreeRig, optional
        Rig and patch with a stiffer joint, whose laws are added to the list.
    """
    laws = [] if coarse is None else [make_laws_on_mesh(model, coarse)]
    if stiffer is not None:
        laws.append(make_laws_on_mesh(stiffer.model, stiffer.patches[0]))
    for numbers in faces.group_interfaces_with_coarse_mesh(model):
        laws.append(make_laws_on_mesh(model, None, numbers))
    return laws


def with_automatic_method(model):
    """Return a copy of a model with accuracy.method = "auto"."""
    return replace(model, accuracy=model.accuracy.model_copy(update={"method": "auto"}))


def compute_static_curve(
    laws: UndrivenRig, mode_index: int, amplitudes, rtol: float | None = None
) -> np.ndarray:
    """Compute amplitude, frequency, damping ratio and loss of a mode from quasi-static cycles.

    Parameters
    ----------
    laws : UndrivenRig
        Modes and friction laws of the interfaces.
    mode_index : int
        Index of the mode.
    amplitudes : (k,)
        Amplitudes of the output [m].
    rtol : float, optional
        Tolerance of a step, for loops without a closed form.

    Returns
    -------
    (5, k) array
        Amplitude [m], frequency [Hz], damping ratio [1], energy that friction dissipates per cycle [J], and the force at
        the output that replaces the energy of a cycle [N].
    """
    motions = quasi_static.find_static_motions(
        laws, mode_index, amplitudes, laws.modes.output, rtol
    )
    return tabulate_static_motions(laws.modes, motions)


def tabulate_static_motions(modes, motions) -> np.ndarray:
    """Return amplitude [m], frequency [Hz], damping ratio, loss [J] and force [N] of quasi-static motions, (5, k)."""
    amplitude = [abs(float(modes.output @ motion.z)) for motion in motions]
    frequency = [motion.omega / (2 * np.pi) for motion in motions]
    damping = [motion.zeta for motion in motions]
    loss = [motion.loss for motion in motions]
    # The work pi F a of a force in phase with the velocity is the energy 2 pi zeta m omega^2 z z lost in a cycle.
    force = [
        2 * motion.zeta * modes.mass * motion.omega**2 * float(motion.z @ motion.z) / size
        for motion, size in zip(motions, amplitude)
    ]
    return np.array([amplitude, frequency, damping, loss, force])


def estimate_mesh_error(fine, coarse, compute, amplitudes) -> np.ndarray:
    """Estimate the mesh error of quantities that depend on the friction laws of patches.

    The change on a coarser mesh is extrapolated at second order. At a displacement at which no node slips, a coarser mesh
    changes nothing. Therefore the change counts as at least that when the elements are spread over the yield displacements
    between the nodes (`partial_slip.mesh_correction`). Both changes pass through zero from node to node, so that the error
    follows from their root mean square at the amplitudes nearby.

    Parameters
    ----------
    fine : UndrivenRig
        Laws on the mesh of the run.
    coarse : list of UndrivenRig
        Laws with a coarser mesh of one patch each.
    compute : callable
        Function that computes the quantities (r, k) at the amplitudes from an UndrivenRig.
    amplitudes : (k,)
        Amplitudes [m].

    Returns
    -------
    (r, k) array
        Errors of the quantities, in their units.
    """
    best = compute(fine)
    changes = (compute(other) - best for other in coarse)
    by_meshes = sum(convergence_error(change, order=MAX_CONVERGENCE_ORDER) for change in changes)

    def spread(stiffness, yields) -> tuple[np.ndarray, np.ndarray]:
        """Spread elements (e,) at the nodes uniformly over ranges around their yield displacements [m]."""
        order = np.argsort(yields, kind="stable")
        return spread_elements(stiffness[order], yields[order])

    change = np.fmax(np.abs(compute(fine.with_elements(spread)) - best), by_meshes)

    # Root mean square over the known changes within a ratio of amplitudes
    distance = np.abs(np.subtract.outer(np.log(amplitudes), np.log(amplitudes)))
    is_near = np.where(distance <= np.log(MAX_POOLED_RATIO), 1.0, 0.0)
    known = np.isfinite(change)
    squares = np.where(known, change, 0.0) ** 2 @ is_near / np.maximum(known @ is_near, 1)
    return np.where(known, ERROR_TO_CHANGE * np.sqrt(squares), np.nan)


def add_mesh_errors(
    curve: DecayCurve, model, patches, stiffer=None, *, has_mesh_run: bool
) -> tuple[DecayCurve, tuple[str, ...]]:
    """Return a decay curve whose errors include that of the mesh of its patches, and a note if this error is unknown.

    Below the slip of the first node, two meshes have the same decay, so that static loops give the error (module
    docstring). It is interpolated where no static motion is found.

    Parameters
    ----------
    curve : DecayCurve
        Curve of a mode whose interfaces stick at its end.
    model : Model
        Rig with its interfaces.
    patches : sequence of Patch or None
        Patch of [contact], and the same on a coarser mesh.
    stiffer : joint.FreeRig, optional
        Rig and patch with a stiffer joint, if a joint was subtracted from the modes.
    has_mesh_run : bool
        Whether the errors of the curve include the change on a coarser mesh.
    """
    friction = model.rig.friction
    if not (model.partial_slip or friction.has_partial_slip):
        return curve, ()
    patch, coarse = patches[:2]
    low, high = np.log10([curve.amplitude.min(), curve.amplitude.max()])
    at = np.logspace(low, high, 2 + int(MESH_AMPLITUDES_PER_DECADE * (high - low)))

    reason = ""
    moves = (model.grooves is not None, friction.load_varies, friction.bands_slide_apart)
    if any(moves):
        reason = CONTACTS_WITHOUT_STATIC_CURVE[moves.index(True)]
    else:
        # Loops on the run's mesh and on coarser ones, where both have a static motion
        try:
            fine = make_laws_on_mesh(model, patch)
            mode_index = _find_nearest_mode(model.rig.modes, fine, curve.frequency[-1])
            others = make_laws_on_coarse_meshes(model, coarse, stiffer)
            errors = estimate_mesh_error(
                fine, others, lambda laws: compute_static_curve(laws, mode_index, at)[1:3], at
            )
            known = np.isfinite(errors).all(axis=0)
            reason = "" if known.any() else NO_STATIC_CURVE_REASON
        except NotConverged as error:
            reason = str(error)
        except PatchfemError:
            reason = UNKNOWN_LOOP_REASON

    if reason:
        lacks = "no error of the mesh"
        if has_mesh_run:
            lacks = (
                "the change on a coarser mesh, but not the energy that is lost in slip too small "
                "for either mesh to resolve"
            )
        return curve, (f"the errors of the decay curve include {lacks}, because {reason}",)

    # The columns are interpolated linearly over the logarithm of the amplitude
    places = np.log(at)
    own = np.log(curve.amplitude)
    errors = [np.interp(places, places[known], row[known]) for row in errors]
    frequency_error, damping_error = [np.interp(own, places, row) for row in errors]
    curve = curve._replace(
        frequency_error=np.fmax(curve.frequency_error, frequency_error),
        damping_error=np.fmax(curve.damping_error, damping_error),
    )
    return curve, ()


def _find_nearest_mode(modes, laws, frequency: float) -> int:
    """Return the index of that mode of a rig with stuck interfaces whose natural frequency is nearest to `frequency`.

    `modes` are those of the structure alone. Stuck modes that do not move the output are
    skipped. `laws` are the friction laws of the interfaces with their stiffness in stick, and `frequency` is in [Hz].
    """
    distances = np.full(modes.omega.size, np.inf)
    for k in range(modes.omega.size):
        omega, shape = modes.compute_stuck_mode(laws.rows, laws.stiffness, k)
        if modes.output @ shape:
            distances[k] = abs(omega / (2 * np.pi) - frequency)
    return int(np.argmin(distances))
