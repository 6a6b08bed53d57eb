"""Slip path of each interface node in one periodic cycle of a bench or a rig.

In: a model and its worn patch. Out: `CycleSlip` with the path, its error and the outcome of the
motion.
"""

from math import ceil, sqrt
from typing import NamedTuple

import numpy as np

from ...core import Measure, Outcome
from ...response.outcome import judge_outcome
from ..bench import bench
from ..bench.engine import steps_per_cycle
from ..bench.slides import integrate_steps
from ..patch.press import nodal_areas
from ..results.travel import check_pieces_overlap
from ..rig import fields, numerics, solve

UNBOUNDED_OUTCOMES = (
    Outcome.GROWS,
    Outcome.EXCEEDS_TRAVEL,
    Outcome.LEAVES_GROOVES,
    Outcome.NOT_CONVERGED,
)
MIN_FRAMES = 64  # Smallest number of interface frames per cycle.
MAX_FRAMES = 800  # Largest number of interface frames per cycle.
# Ratio of the error due to reversals between samples to the mean change of the path if only every
# third sample is used.
REVERSAL_ERROR_FACTOR = 1.5


class CycleSlip(NamedTuple):
    """Slip path of the interface nodes in one cycle of a motion.

    - path: slip path [m] of each node (m,), (s, m) for strips. With form 'energy' it is the
      friction work per area divided by the pressure; over grooves it is the path along their
      flanks.
    - error: relative error due to the finite number of frames and to differences between cycles.
    - values: measures of the motion by name.
    - outcome: outcome of a motion without periodic cycle, else None.
    """

    path: np.ndarray
    error: float
    values: dict | None = None
    outcome: Outcome | None = None


def choose_frame_count(tolerance: float) -> int:
    """Return the number of frames per cycle for a slip path accurate to tolerance/100.

    A reversal between two of k frames of a sinusoid hides up to (pi/k)^2/2 of the amplitude.
    """
    return int(np.clip(ceil(np.pi / sqrt(0.02 * tolerance)), MIN_FRAMES, MAX_FRAMES))


def slips_uniformly(model, per_point: bool = False) -> bool:
    """Return whether all points of a patch, or of each of its strips, slip by equal distances."""
    return (
        not model.partial_slip
        and model.side == "upper"
        and (model.patch.interface.strips is not None or not per_point)
    )


def strips_slide_independently(model) -> bool:
    """Return whether the strips slide independently, so that their motion depends on the wear."""
    return model.rig is not None and model.rig.friction.strips_slide_apart


def compute_cycle_slip(model, patch, frames: int) -> CycleSlip:
    """Compute the slip path of the interface nodes in one periodic cycle of a model.

    Parameters
    ----------
    model : Model
        Model at the present wear.
    patch : Patch
        Patch at the present wear.
    frames : int
        Number of frames per cycle from which the path is computed.
    """
    if model.rig is None:
        return _compute_bench_slip(model, patch, frames)
    return _compute_rig_slip(model, patch, frames)


class _CycleHistories(NamedTuple):
    """Displacement, slip, forces and load at the k samples of one cycle.

    - slide, slip: relative displacement and slip [m].
    - force, load: friction force and normal load [N].
    """

    slide: np.ndarray
    slip: np.ndarray
    force: np.ndarray
    load: np.ndarray


class Frames(NamedTuple):
    """Slip and shear stress of the interface nodes in f frames of a cycle.

    - slip, tau (f, m): slip [m] and shear stress [Pa] at the nodes.
    - is_closed: whether the first frame follows the last one.
    """

    slip: np.ndarray
    tau: np.ndarray
    is_closed: bool


def _compute_bench_slip(model, patch, frames: int) -> CycleSlip:
    """Compute the slip path of the interface nodes in the last cycle of a bench."""
    cycles = max(1, round(model.slide.cycles or 1))
    is_uniform = slips_uniformly(model)
    run = bench.run_bench(
        model, patch, steps_per_cycle(model), 0 if is_uniform else frames * cycles
    )
    outcome = check_pieces_overlap(None, model.patch, patch, run.slide)

    # Pieces that do not deform in shear slip alike at all nodes: one path for all.
    if is_uniform:
        cycle = _select_last_bench_cycle(run)
        slip = _compute_uniform_slip(model, patch, cycle, cycle.load[0])
        return slip._replace(values=run.values, outcome=outcome)

    is_last = run.frames >= run.first
    local = run.local[is_last]
    tau = run.tau[is_last]
    slide = run.slide[run.frames[is_last]]

    # A path that is not cyclic begins at rest, before its first frame.
    if run.first == 0:
        start = np.zeros((1, patch.x.size))
        local = np.concatenate([start, local])
        tau = np.concatenate([start, tau])
        slide = np.append(0.0, slide)
        if model.grooves is not None:  # At the start the load rests on the flank of a groove.
            tau[0] = model.grooves.slope(0.0) * patch.pressure.sigma_n
    if model.grooves is not None:
        load = np.full(slide.size, patch.pressure.load)
        local, tau = compute_flank_slip(model, patch, slide, load, local, tau)

    slip = compute_frame_slip(model, patch, Frames(local, tau, is_closed=False))
    return slip._replace(values=run.values, outcome=outcome)


def _compute_rig_slip(model, patch, frames: int) -> CycleSlip:
    """Compute the slip path of the interface nodes in the last cycle of a rig."""
    settings = numerics.choose_numerics(model)
    pressed_load = patch.pressure.load
    is_uniform = slips_uniformly(model, settings.per_point and model.grooves is None)
    solution = solve.solve_rig(model, settings, patch, 0 if is_uniform else frames)

    # A motion without bound has no slip path (the caller stops the wear).
    amplitude = Measure(solution.values["relative_displacement_amplitude"], "m", 0.0)
    outcome, _ = judge_outcome(
        solution,
        {"relative_displacement_amplitude": amplitude},
        model.accuracy.tolerance,
        model.rig.drive.signal,
    )
    outcome = check_pieces_overlap(
        outcome if outcome in UNBOUNDED_OUTCOMES else None,
        model.patch,
        patch,
        solution.response.slide,
    )

    # The slip follows from the histories if it is uniform, else from the frames of the cycle.
    cycle = _select_last_rig_cycle(model, solution.window, pressed_load)
    if strips_slide_independently(model) and is_uniform:
        slip = _compute_strip_slip(model, patch, solution.window)
    elif is_uniform:
        slip = _compute_uniform_slip(model, patch, cycle, pressed_load)
    else:
        frame_fields = fields.collect_interface_fields(model, settings, patch, solution)
        frame_fields = {name: values[1:] for name, values in frame_fields.items()}
        local = frame_fields["slip"]
        tau = frame_fields["shear_stress"]

        # The load on the flanks varies with the lift of the rig.
        if model.grooves is not None:
            response = solution.response
            constant = np.full(response.time.size, pressed_load)
            load = np.interp(
                frame_fields["time"],
                response.time,
                response.extra.get("normal_load", constant),
            )
            local, tau = compute_flank_slip(
                model, patch, frame_fields["holder_slide"], load, local, tau
            )
        slip = compute_frame_slip(model, patch, Frames(local, tau, is_closed=True))

    error = slip.error + _slip_amplitude_change(solution.values, cycle)
    return slip._replace(error=error, values=solution.values, outcome=outcome)


def _slip_amplitude_change(values: dict, cycle: _CycleHistories) -> float:
    """Return the relative difference between the slip amplitudes of the last cycle and the window.

    A mode that still beats causes this difference.
    """
    amplitude = float(np.ptp(cycle.slip)) / 2
    window_amplitude = values.get("slip_amplitude")
    if window_amplitude is None or amplitude <= 0:
        return 0.0
    return abs(window_amplitude / amplitude - 1)


def compute_point_slip_path(model, window, values: dict) -> tuple[float, float]:
    """Return the slip path [m] per cycle of a single point under [normal], and its relative error.

    The path is weighted with the load. The error comes from differences between cycles.

    Parameters
    ----------
    model : Model
        Model of a bench or a rig with [normal].
    window
        Histories of a bench or a rig.
    values : dict
        Measures by name.
    """
    beat_error = 0.0
    if model.rig is None:
        cycle = _select_last_bench_cycle(window)
    else:
        cycle = _select_last_rig_cycle(model, window, model.point.load)
        beat_error = _slip_amplitude_change(values, cycle)
    slip = _compute_uniform_slip(model, None, cycle, cycle.load[0])
    return float(slip.path[0]), slip.error + beat_error


def _select_last_bench_cycle(run) -> _CycleHistories:
    """Return the histories of the last cycle of a bench."""
    histories = (run.slide, run.slip, run.force, run.load)
    return _CycleHistories(*(history[run.first :] for history in histories))


def _select_last_rig_cycle(model, window, load: float) -> _CycleHistories:
    """Return the histories of the last cycle of a rig.

    load: constant load [N]; over grooves the vertical force.
    """
    is_last = _is_in_last_cycle(model, window)
    loads = window.extra.get("normal_load", np.full(window.time.size, load))
    histories = (window.slide, window.slip, window.force, loads)
    return _CycleHistories(*(history[is_last] for history in histories))


def _is_in_last_cycle(model, window) -> np.ndarray:
    """Return whether each sample of a window is in its last cycle."""
    period = model.rig.drive.signal.period
    return window.time >= window.time[-1] - period * (1 + 1e-9)


def _compute_strip_slip(model, patch, window) -> CycleSlip:
    """Return the slip path of each strip of a rig with yaw, in the direction of the drive.

    An open strip has the slip of the nearest strip in contact.
    """
    loads = patch.strips.force.sum(axis=1)
    is_last = _is_in_last_cycle(model, window)
    slips = window.extra.get("slips", window.extra["slides"])[is_last]
    weight = np.ones_like(slips)
    if model.wear.uses_friction_work:
        forces = window.extra["forces"][is_last]
        weight = np.abs(forces) / np.where(loads > 0, loads, 1.0)

    def path(samples) -> np.ndarray:
        """Return the slip paths (s,) [m] of the strips from selected samples."""
        columns = zip(slips[samples].T, weight[samples].T)
        return np.array(
            [_integrate_over_path(slip, strip_weight) for slip, strip_weight in columns]
        )

    paths = path(np.arange(len(slips)))
    error = _estimate_reversal_error(path, len(slips), paths, loads)
    nearest = _find_nearest_contact_nodes(patch.strips.offsets, loads > 0)
    return CycleSlip(np.repeat(paths[nearest, None], patch.x.size, axis=1), error)


def _estimate_reversal_error(
    compute_path, count: int, fine_path, weight, is_closed: bool = False
) -> float:
    """Estimate the relative error of a slip path due to reversals between samples.

    A reversal at the distance d <= 1/2 from the nearest sample hides a part f(d) of the path. With
    every third sample it hides f(d), f(1 - d) or f(1 + d), depending on which samples are used. 3/2
    of the mean increase is at least f(d) for any d, both for a sharp reversal, f = c d, and for a
    smooth one, f = c d^2.

    Parameters
    ----------
    compute_path : callable
        Function from sample indices to the slip paths (m,) [m].
    count : int
        Number of samples.
    fine_path, weight : (m,)
        Slip paths from all samples [m], and their weights in the mean.
    is_closed : bool
        Whether the first sample follows the last one.
    """
    total = float(fine_path @ weight)
    if total <= 0:
        return 0.0
    ends = [] if is_closed else [0, count - 1]
    changes = []
    for first in range(3):
        samples = np.unique([*ends, *range(first, count, 3)]).astype(int)
        changes.append(abs(float((fine_path - compute_path(samples)) @ weight)))
    return REVERSAL_ERROR_FACTOR * float(np.mean(changes)) / total


def _compute_uniform_slip(model, patch, cycle: _CycleHistories, load: float) -> CycleSlip:
    """Return the slip path of a cycle with uniform slip at all points."""
    slip = cycle.slip
    # Friction opposes the slip, also in a step with a reversal.
    weight = np.abs(cycle.force) if model.wear.uses_friction_work else cycle.load
    error = 0.0
    if model.grooves is not None:
        weight = wear_force_on_flanks(model, cycle.slide, cycle.force, cycle.load)
    path = _integrate_over_path(slip, weight) / load if load > 0 else 0.0
    if model.grooves is not None and path > 0:
        error = abs(path - _integrate_over_path(slip[::2], weight[::2]) / load) / path
    shape = 1 if patch is None else nodal_areas(model.patch, patch.pieces.interface).shape
    return CycleSlip(np.full(shape, path), error)


def _integrate_over_path(slip, weight) -> float:
    """Integrate a weight over the slip path |ds| by the trapezoidal rule."""
    return float(np.sum(np.abs(np.diff(slip)) * (weight[1:] + weight[:-1]) / 2))


def wear_force_on_flanks(model, slide, force, load) -> np.ndarray:
    """Return the force (k,) [N] that wears groove flanks, per unit of relative displacement.

    With the slope t of the flank, it is R ds/dq = V + F t of the normal force R on the flank; with
    form 'energy' it is |f| ds/dq = |F - V t| of the friction force f along the flank.

    Parameters
    ----------
    model : Model
        Model with grooves and [wear].
    slide : (k,)
        Relative displacement [m].
    force, load : (k,)
        Horizontal force F and vertical force V [N].
    """
    t = model.grooves.slope(slide)
    if model.wear.uses_friction_work:
        return np.abs(force - load * t)
    return np.maximum(load + force * t, 0.0)


def compute_flank_slip(model, patch, slide, vertical, local, tau) -> tuple:
    """Return the slip along groove flanks [m] and the stress that wears them [Pa], (f, m) each.

    The slip is s - e with the path s along the flank and its elastic part e. A point with pressure
    sigma carries the vertical stress V sigma/N. Its normal stress on the flank is R = (V sigma/N +
    tau t)/sqrt(1 + t^2); its friction along the flank, which form 'energy' uses, is |tau - t V
    sigma/N|/sqrt(1 + t^2).

    Parameters
    ----------
    model : Model
        Model with grooves and [wear].
    patch : Patch
        Patch at the present wear, whose pressure distributes the load.
    slide : (f,)
        Displacement of the holder [m] in each frame.
    vertical : (f,)
        Vertical force V [N].
    local, tau : (f, m)
        Slip [m] and traction parallel to the interface [Pa].
    """
    grooves = model.grooves
    sigma = patch.pressure.sigma_n
    slope = grooves.slope(slide)[:, None]
    # Ratio of the path along the flank to the relative displacement.
    path_ratio = np.sqrt(1 + slope**2)
    vertical_stress = (vertical / patch.pressure.load)[:, None] * sigma
    steps = integrate_steps(slide, lambda places: np.hypot(1, grooves.slope(places)))
    path = np.append(0.0, np.cumsum(steps))
    if model.wear.uses_friction_work:
        stress = np.abs(tau - slope * vertical_stress)
    else:
        stress = np.maximum(vertical_stress + tau * slope, 0.0)
    return path[:, None] - (slide[:, None] - local) * path_ratio, stress / path_ratio


def compute_frame_slip(model, patch, frames: Frames) -> CycleSlip:
    """Compute the slip path of each node from frames of slip and shear stress.

    Parameters
    ----------
    model : Model
        Model with [wear], whose form decides.
    patch : Patch
        Patch at the present wear.
    frames : Frames
        Slip and shear stress of the nodes along the cycle.
    """
    count = len(frames.slip)

    def path(indices) -> np.ndarray:
        """Return the slip paths (m,) [m] of the nodes from selected frames."""
        return _integrate_node_paths(model, patch, frames, indices)

    paths = path(np.arange(count))
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    return CycleSlip(paths, _estimate_reversal_error(path, count, paths, force, frames.is_closed))


def _integrate_node_paths(model, patch, frames: Frames, indices) -> np.ndarray:
    """Integrate the slip paths (m,) [m] of the nodes over selected frames."""
    if frames.is_closed:
        indices = np.append(indices[-1:], indices)
    steps = np.abs(np.diff(frames.slip[indices], axis=0))
    sigma = patch.pressure.sigma_n
    path = steps.sum(axis=0)
    if model.wear.uses_friction_work or model.grooves is not None:
        tau = np.abs(frames.tau[indices])
        work = np.sum(steps * (tau[1:] + tau[:-1]) / 2, axis=0)
        path = np.divide(work, sigma, out=np.zeros_like(work), where=sigma > 0)
    return path[_find_nearest_contact_nodes(patch.x, sigma > 0)]


def _find_nearest_contact_nodes(x, active) -> np.ndarray:
    """Return for each node the index (m,) of the nearest node in contact.

    A node that comes into contact during a jump has the slip of this node.
    """
    touching = np.flatnonzero(active)
    if not touching.size:
        return np.arange(x.size)
    return touching[np.abs(x[:, None] - x[touching]).argmin(axis=1)]
