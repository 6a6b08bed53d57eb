"""Quasi-static backbone of a mode, from the friction loops of its contact."""

import numpy as np

from ...core import NotConverged, PatchfemError
from ...event_driven import quasi_static
from ...friction.protocol import SteadyLoop
from ...friction.record import steady_loop
from ...measures.errors import add_errors
from ...runs.rig import decays
from ...runs.rig.rig import estimate_slide_errors
from .balance import compute_constant_curve
from .bench_loops import LOOP_MEASURES, compute_steady_loop
from .joint import JointMode
from .records import EQUAL_AMPLITUDE_TOL, ROUND_OFF_ERROR, Curve, make_curve

ROUGH_RTOL = (
    1e-8  # step tolerance of the friction loops whose differences from the fine ones are the errors
)


def compute_static_curve(joint: JointMode, amplitudes) -> Curve:
    """Compute the quasi-static backbone of the mode of a joint at amplitudes (k,) [m].

    It follows from the steady friction loops of the contact. Loops without a closed form are computed on a bench, that
    is, under a prescribed slide. Raises NotConverged or PatchfemError if there is no curve.
    """
    if joint.is_linear:
        return compute_constant_curve(joint, amplitudes)
    joint.require_steady_loops("static curve")
    if joint.is_rigid:
        raise PatchfemError(
            "rigid friction has no finite stiffness, so a static curve cannot be computed for the "
            "mode of the sticking contact"
        )

    # A closed form comes first, then the laws of a free motion, then a march on a bench, which is the slowest.
    curve = _compute_in_closed_form(joint, amplitudes)
    if curve is not None:
        return curve
    try:
        laws = joint.steady_laws()
    except PatchfemError:
        if len(joint.model.rig.friction.interfaces) > 1 or joint.model.rig.springs.is_nonlinear:
            raise
        return _compute_from_bench_loops(joint, amplitudes)

    # The error of the steps is the change with larger ones.
    best = decays.compute_static_curve(laws, joint.mode, amplitudes)
    has_amplitude = np.abs(best[0] / amplitudes - 1) < EQUAL_AMPLITUDE_TOL
    best[0] = np.where(has_amplitude, amplitudes, best[0])
    rough = decays.compute_static_curve(laws, joint.mode, amplitudes, ROUGH_RTOL)
    error = np.abs(best - rough) + ROUND_OFF_ERROR * np.abs(best)
    error += joint.spatial_discretization_errors(
        lambda _, group: decays.compute_static_curve(group, joint.mode, amplitudes),
        amplitudes,
    )
    return _select_rising_part(best, error)


def _select_rising_part(best, error) -> Curve:
    """Return the part of a quasi-static curve on which the inertia force increases.

    Beyond this part no equilibrium is stable.

    Parameters
    ----------
    best, error : (5, k) array
        Amplitude [m], frequency [Hz], damping ratio, loss [J] and force [N], and their errors.
    """
    force = best[1] ** 2 * best[0]
    rises = np.isfinite(best + error).all(axis=0) & (np.diff(force, prepend=0.0) > 0)
    count = rises.size if rises.all() else int(np.argmin(rises))
    if not count:
        raise NotConverged(
            "no inertia force of the mode holds the rig in equilibrium at these "
            "amplitudes; use --method balance"
        )
    return make_curve(best[0], best[1:], error[1:]).at(slice(count))


def _compute_in_closed_form(joint: JointMode, amplitudes) -> Curve | None:
    """Compute the curve of a joint with one interface at amplitudes (k,) [m] in closed form.

    It is None if the law has no closed form.
    """
    # The law alone gives the loop of an interface: nothing in series with it yields, and no spring is nonlinear.
    model = joint.model
    modes = joint.modes
    is_soft = (
        model.partial_slip or model.rig.friction.has_partial_slip or model.rig.springs.is_nonlinear
    )
    if model.friction is None or is_soft or len(model.rig.friction.interfaces) > 1:
        return None

    # Slides of the contact are sought that give the amplitudes of the output. The rows of `best` are amplitude, frequency,
    # damping ratio, loss and force.
    load = joint.friction_limit / model.friction.static
    slides = joint.slides(amplitudes)
    # Largest number of corrections of the displacement until the amplitude is the requested one.
    for _ in range(60):
        loops = [steady_loop(model.friction, load, float(slide)) for slide in slides]
        if None in loops:
            return None
        best = _compute_from_loops(joint, slides, loops)
        has_amplitude = np.abs(best[0] / amplitudes - 1) < EQUAL_AMPLITUDE_TOL
        if has_amplitude.all():
            break
        # The deflection shape differs from the stuck mode shape, so that the output amplitude is missed.
        slides = slides * amplitudes / best[0]

    # Amplitudes that are not met have no point.
    best = np.where(has_amplitude, best, np.nan)
    best[0] = amplitudes
    relative = ROUND_OFF_ERROR + (EQUAL_AMPLITUDE_TOL if modes.omega.size > 1 else 0.0)
    return _select_rising_part(best, relative * np.abs(best))


def _compute_from_loops(joint: JointMode, slides, loops: list[SteadyLoop]) -> np.ndarray:
    """Compute amplitude, frequency, damping, loss and force (5, k) from hysteresis loops.

    The loops have displacement amplitudes `slides` (k,) [m], and `joint` is the mode.
    """
    modes = joint.modes
    statics = quasi_static.find_static_motions_from_loops(
        modes, modes.interfaces[0], joint.mode, slides, loops
    )
    return decays.tabulate_static_motions(modes, statics)


def _compute_from_bench_loops(joint: JointMode, amplitudes) -> Curve:
    """Compute the curve of a joint at amplitudes (k,) [m] from steady loops on a bench.

    On a bench the slide of the contact is prescribed, here as a sine with the frequency of the mode.
    """
    slides = joint.slides(amplitudes)
    patches = [joint.patch]
    if joint.coarse is not None:
        patches.append(joint.coarse)
    frequency = joint.stuck_mode.omega / (2 * np.pi)

    loops = []
    loops_with_force_error = []
    loops_with_area_error = []
    for slide in slides:
        steady = compute_steady_loop(joint.model, joint.patch, float(slide), frequency)
        errors = estimate_slide_errors(steady.model, patches, steady.run, steady.steps)
        # Relative error that is added to the estimated errors of a computed friction loop.
        measures = add_errors(steady.run.values, errors, min_relative_error=1e-10)
        stiffness, area = (steady.run.values[name] for name in LOOP_MEASURES)
        errors = [measures[name].error for name in LOOP_MEASURES]
        stiffness_error, area_error = np.add(errors, steady.change)
        loop = SteadyLoop(stiffness * slide, area)
        loops.append(loop)
        loops_with_force_error.append(loop._replace(force=loop.force + stiffness_error * slide))
        loops_with_area_error.append(loop._replace(area=loop.area + area_error))

    # The error is the sum of the changes by an error of the force and one of the area.
    best = _compute_from_loops(joint, slides, loops)
    error = ROUND_OFF_ERROR * np.abs(best)
    for moved in (loops_with_force_error, loops_with_area_error):
        error += np.abs(_compute_from_loops(joint, slides, moved) - best)

    if joint.stiffer is not None:
        # The stiffness of the joint that is subtracted from bolted modes has an error of its own.
        stiffer = joint.with_modes(joint.stiffer.model.rig.modes, joint.stiffness)
        error += np.abs(_compute_from_loops(stiffer, slides, loops) - best)
    return _select_rising_part(best, error)
