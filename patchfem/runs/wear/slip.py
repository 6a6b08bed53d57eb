"""Slip path of every interface node in a converged cycle of a bench or a rig.

In: a model and its worn patch. Out: `CycleSlip` with the path, its error and the outcome.
"""

from math import ceil, sqrt
from typing import NamedTuple

import numpy as np

from ...core import Measure, Outcome
from ...response.outcome import judge_outcome
from ..bench import bench
from ..bench.closed_form import integrate_steps
from ..bench.engine import steps_per_cycle
from ..patch.press import nodal_areas
from ..results.travel import judge_outcome_on_piece
from ..rig import fields, numerics, solve

UNBOUNDED_OUTCOMES = (
    Outcome.GROWS,
    Outcome.EXCEEDS_TRAVEL,
    Outcome.LEAVES_GROOVES,
    Outcome.NOT_CONVERGED,
)
MIN_FRAMES = 64  # Smallest number of interface frames per cycle.
MAX_FRAMES = 800  # Largest number of interface frames per cycle.
# Ratio of the error due to reversals between samples to the mean change without two of three samples.
THINNING_FACTOR = 1.5


class CycleSlip(NamedTuple):
    """Slip path of the interface nodes in one cycle of a motion.

    - path: slip path of each node (m,), of strips (s, m) [m]. With form 'energy' it is friction
      work per area over pressure, and over grooves it is along their flanks.
    - error: relative error due to the number of frames and to differences between the cycles of the
      window.
    - values: measures of the motion by name.
    - outcome: reason why no cycle is periodic, else None.
    """

    path: np.ndarray
    error: float
    values: dict | None = None
    outcome: Outcome | None = None


def count_frames(tolerance: float) -> int:
    """Return the frames per cycle with which a slip path is accurate to tolerance/100.

    A reversal between two of k frames of a sinusoid hides up to (pi/k)^2/2 of the amplitude.
    """
    return int(np.clip(ceil(np.pi / sqrt(0.02 * tolerance)), MIN_FRAMES, MAX_FRAMES))


def slips_uniformly(model, per_point: bool = False) -> bool:
    """Return whether all points of a patch, or of each of its strips, slip equally."""
    return (
        not model.partial_slip
        and model.side == "upper"
        and (model.patch.interface.strips is not None or not per_point)
    )


def strips_slide_independently(model) -> bool:
    """Return whether strips slide independently, so that wear changes their motion."""
    return model.rig is not None and model.rig.friction.strips_slide_apart


def compute_cycle_slip(model, patch, frames: int) -> CycleSlip:
    """Compute the slip path of the interface nodes in one periodic cycle of a model.

    Parameters
    ----------
    model : Model
    patch : Patch
    frames : int
        Number of frames of the interface from which the path is computed.
    """
    if model.rig is None:
        return _compute_bench_slip(model, patch, frames)
    return _compute_rig_slip(model, patch, frames)


class _CycleHistories(NamedTuple):
    """Displacement, slip, forces and load of one cycle at k samples.

    - slide, slip: [m].
    - force, load: [N].
    """

    slide: np.ndarray
    slip: np.ndarray
    force: np.ndarray
    load: np.ndarray


class Frames(NamedTuple):
    """Slip and shear stress of the interface nodes in f frames of a cycle.

    - slip, tau (f, m): local slip [m] and shear stress [Pa].
    - is_closed: whether the last frame is followed by the first one.
    """

    slip: np.ndarray
    tau: np.ndarray
    is_closed: bool


def _compute_bench_slip(model, patch, frames: int) -> CycleSlip:
    """Return the slip path of the nodes in the last cycle of a bench."""
    cycles = max(1, round(model.slide.cycles or 1))
    is_uniform = slips_uniformly(model)
    run = bench.run_bench(
        model, patch, steps_per_cycle(model), 0 if is_uniform else frames * cycles
    )
    outcome = judge_outcome_on_piece(None, model.patch, patch, run.slide)
    if is_uniform:
        cycle = _last_bench_cycle(run)
        slip = _uniform_slip(model, patch, cycle, cycle.load[0])
        return slip._replace(values=run.values, outcome=outcome)
    is_last = run.frames >= run.first
    local = run.local[is_last]
    tau = run.tau[is_last]
    slide = run.slide[run.frames[is_last]]
    if run.first == 0:
        start = np.zeros((1, patch.x.size))
        local = np.concatenate([start, local])
        tau = np.concatenate([start, tau])
        slide = np.append(0.0, slide)
        if model.grooves is not None:  # At the start the load rests on the flank of a groove.
            tau[0] = model.grooves.slope(0.0) * patch.pressure.sigma_n
    if model.grooves is not None:
        load = np.full(slide.size, patch.pressure.load)
        local, tau = flank_slip_path(model, patch, slide, load, local, tau)
    slip = compute_frame_slip(model, patch, Frames(local, tau, is_closed=False))
    return slip._replace(values=run.values, outcome=outcome)


def _compute_rig_slip(model, patch, frames: int) -> CycleSlip:
    """Return the slip path of the nodes in the last cycle of a rig."""
    chosen = numerics.choose_numerics(model)
    is_uniform = slips_uniformly(model, chosen.per_point and model.grooves is None)
    solution = solve.solve(model, chosen, patch, 0 if is_uniform else frames)
    amplitude = Measure(solution.values["relative_displacement_amplitude"], "m", 0.0)
    outcome, _ = judge_outcome(
        solution,
        {"relative_displacement_amplitude": amplitude},
        model.accuracy.tolerance,
        model.rig.drive.signal,
    )
    outcome = judge_outcome_on_piece(
        outcome if outcome in UNBOUNDED_OUTCOMES else None,
        model.patch,
        patch,
        solution.response.slide,
    )
    cycle = _last_rig_cycle(model, solution.window, patch.pressure.load)
    if strips_slide_independently(model) and is_uniform:
        slip = _compute_strip_slip(model, patch, solution.window)
    elif is_uniform:
        slip = _uniform_slip(model, patch, cycle, patch.pressure.load)
    else:
        frame_fields = fields.collect_frames(model, chosen, patch, solution)
        frame_fields = {name: values[1:] for name, values in frame_fields.items()}
        local = frame_fields["slip"]
        tau = frame_fields["shear_stress"]
        if model.grooves is not None:
            response = solution.response
            constant = np.full(response.time.size, patch.pressure.load)
            load = np.interp(
                frame_fields["time"],
                response.time,
                response.extra.get("normal_load", constant),
            )
            local, tau = flank_slip_path(
                model, patch, frame_fields["holder_slide"], load, local, tau
            )
        slip = compute_frame_slip(model, patch, Frames(local, tau, is_closed=True))
    error = slip.error + _beat_error(solution.values, cycle)
    return slip._replace(error=error, values=solution.values, outcome=outcome)


def _beat_error(values: dict, cycle: _CycleHistories) -> float:
    """Return the relative difference of the slip amplitudes in the last cycle and in the window.

    A mode that still beats causes this difference.
    """
    amplitude = float(np.ptp(cycle.slip)) / 2
    window_amplitude = values.get("slip_amplitude")
    if window_amplitude is None or amplitude <= 0:
        return 0.0
    return abs(window_amplitude / amplitude - 1)


def slip_path_of_point(model, window, values: dict) -> tuple[float, float]:
    """Return the slip path [m] per cycle of a single point under [normal], and its error.

    It is weighted with the load if that changes. The error comes from differences between the
    cycles.

    Parameters
    ----------
    model : Model
    window
        Histories of a bench or a rig.
    values : dict
        Measures by name.
    """
    beat_error = 0.0
    if model.rig is None:
        cycle = _last_bench_cycle(window)
    else:
        cycle = _last_rig_cycle(model, window, model.point.load)
        beat_error = _beat_error(values, cycle)
    slip = _uniform_slip(model, None, cycle, cycle.load[0])
    return float(slip.path[0]), slip.error + beat_error


def _last_bench_cycle(run) -> _CycleHistories:
    """Return displacement, slip and forces of the last cycle of a bench."""
    histories = (run.slide, run.slip, run.force, run.load)
    return _CycleHistories(*(history[run.first :] for history in histories))


def _last_rig_cycle(model, window, load: float) -> _CycleHistories:
    """Return displacement, slip and forces of the last cycle of a rig.

    load: constant load [N]; over grooves it is the vertical force.
    """
    is_last = _is_in_last_cycle(model, window)
    loads = window.extra.get("normal_load", np.full(window.time.size, load))
    histories = (window.slide, window.slip, window.force, loads)
    return _CycleHistories(*(history[is_last] for history in histories))


def _is_in_last_cycle(model, window) -> np.ndarray:
    """Return a mask of the samples in the last cycle of a window."""
    period = model.rig.drive.signal.period
    return window.time >= window.time[-1] - period * (1 + 1e-9)


def _compute_strip_slip(model, patch, window) -> CycleSlip:
    """Return the slip path in the drive direction of each strip of a rig with yaw.

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
        """Return the slip path (s,) [m] of the strips from selected samples."""
        columns = zip(slips[samples].T, weight[samples].T)
        return np.array(
            [_integrate_over_path(slip, strip_weight) for slip, strip_weight in columns]
        )

    paths = path(np.arange(len(slips)))
    error = _estimate_reversal_error(path, len(slips), paths, loads)
    nearest = _nearest_contact_nodes(patch.strips.offsets, loads > 0)
    return CycleSlip(np.repeat(paths[nearest, None], patch.x.size, axis=1), error)


def _estimate_reversal_error(
    compute_path, count: int, fine_path, weight, is_closed: bool = False
) -> float:
    """Estimate the relative error of a slip path whose reversals lie between samples.

    A reversal between two samples hides f(d) of the path, d <= 1/2 of their distance. Every third
    sample hides f(d), f(1 - d) or f(1 + d), for the first, second or third choice: 3/2 of the mean
    excess contains f(d) for any d, for a corner f = c d as well as for a smooth reversal f = c d^2.

    Parameters
    ----------
    compute_path : callable
        Function from indices of samples to the slip paths (m,) [m].
    count : int
        Number of samples.
    fine_path, weight : (m,)
        Slip paths from all samples [m], and their weights.
    is_closed : bool
        Whether the last sample is followed by the first one.
    """
    total = float(fine_path @ weight)
    if total <= 0:
        return 0.0
    ends = [] if is_closed else [0, count - 1]
    changes = []
    for first in range(3):
        samples = np.unique([*ends, *range(first, count, 3)]).astype(int)
        changes.append(abs(float((fine_path - compute_path(samples)) @ weight)))
    return THINNING_FACTOR * float(np.mean(changes)) / total


def _uniform_slip(model, patch, cycle: _CycleHistories, load: float) -> CycleSlip:
    """Return the slip path of a cycle in which all points slip by the same distance."""
    slip = cycle.slip
    # Friction opposes the slip, also in a step with a reversal.
    weight = np.abs(cycle.force) if model.wear.uses_friction_work else cycle.load
    error = 0.0
    if model.grooves is not None:
        weight = wearing_force_on_flanks(model, cycle.slide, cycle.force, cycle.load)
    path = _integrate_over_path(slip, weight) / load if load > 0 else 0.0
    if model.grooves is not None and path > 0:
        error = abs(path - _integrate_over_path(slip[::2], weight[::2]) / load) / path
    shape = 1 if patch is None else nodal_areas(model.patch, patch.pieces.interface).shape
    return CycleSlip(np.full(shape, path), error)


def _integrate_over_path(slip, weight) -> float:
    """Integrate a weight over the slip path |ds| by the trapezoidal rule."""
    return float(np.sum(np.abs(np.diff(slip)) * (weight[1:] + weight[:-1]) / 2))


def wearing_force_on_flanks(model, slide, force, load) -> np.ndarray:
    """Return the force (k,) [N] that wears the flanks of grooves per unit of displacement.

    It is R ds/dq = V + F t of the normal force R, or with form 'energy' |f| ds/dq = |F - V t| of
    the friction force f along the flank, with the slope t.

    Parameters
    ----------
    model : Model
    slide : (k,)
        [m].
    force, load : (k,)
        Force F against the slide and vertical force V [N].
    """
    t = model.grooves.slope(slide)
    if model.wear.uses_friction_work:
        return np.abs(force - load * t)
    return np.maximum(load + force * t, 0.0)


def flank_slip_path(model, patch, slide, vertical, local, tau) -> tuple:
    """Return the slip along groove flanks [m] and the stress that wears them [Pa], (f, m) each.

    The slip is s - e, with the path s along the flank and its elastic part e. A point of pressure
    sigma carries V sigma/N, so that its normal stress on the flank is R = (V sigma/N + tau
    t)/sqrt(1 + t^2), and its friction along the flank, used with form 'energy', is |tau - t V
    sigma/N|/sqrt(1 + t^2).

    Parameters
    ----------
    model : Model
    patch : Patch
    slide : (f,)
        Slide of the holder in each frame [m].
    vertical : (f,)
        Vertical force V [N].
    local, tau : (f, m)
        Slip [m] and resultant traction [Pa].
    """
    grooves = model.grooves
    sigma = patch.pressure.sigma_n
    slope = grooves.slope(slide)[:, None]
    # The factor is the ratio of the flank length to the relative displacement.
    stretch = np.sqrt(1 + slope**2)
    carried = (vertical / patch.pressure.load)[:, None] * sigma
    steps = integrate_steps(slide, lambda places: np.hypot(1, grooves.slope(places)))
    path = np.append(0.0, np.cumsum(steps))
    if model.wear.uses_friction_work:
        stress = np.abs(tau - slope * carried)
    else:
        stress = np.maximum(carried + tau * slope, 0.0)
    return path[:, None] - (slide[:, None] - local) * stretch, stress / stretch


def compute_frame_slip(model, patch, frames: Frames) -> CycleSlip:
    """Return the slip path of each node from frames of slip and shear stress.

    Parameters
    ----------
    model : Model
    patch : Patch
    frames : Frames
    """
    count = len(frames.slip)

    def path(indices) -> np.ndarray:
        """Return the slip path (m,) [m] of the nodes from selected frames."""
        return _integrate_path(model, patch, frames, indices)

    paths = path(np.arange(count))
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    return CycleSlip(paths, _estimate_reversal_error(path, count, paths, force, frames.is_closed))


def _integrate_path(model, patch, frames: Frames, indices) -> np.ndarray:
    """Integrate the slip path (m,) [m] of the nodes over selected frames."""
    if frames.is_closed:
        indices = np.append(indices[-1:], indices)
    steps = np.abs(np.diff(frames.slip[indices], axis=0))
    sigma = patch.pressure.sigma_n
    path = steps.sum(axis=0)
    if model.wear.uses_friction_work or model.grooves is not None:
        tau = np.abs(frames.tau[indices])
        work = np.sum(steps * (tau[1:] + tau[:-1]) / 2, axis=0)
        path = np.divide(work, sigma, out=np.zeros_like(work), where=sigma > 0)
    return path[_nearest_contact_nodes(patch.x, sigma > 0)]


def _nearest_contact_nodes(x, active) -> np.ndarray:
    """Return the index (m,) of the nearest node in contact for every node.

    A node that comes into contact during a jump has the slip of this neighbour.
    """
    touching = np.flatnonzero(active)
    if not touching.size:
        return np.arange(x.size)
    return touching[np.abs(x[:, None] - x[touching]).argmin(axis=1)]
