"""Slip path of each interface node in one periodic cycle of a bench or a rig.

In: a model and its worn patch. Out: `CycleSlip` with the path, its error and the outcome of the motion. A point with
the pressure p wears by L p per cycle with the path L, the integral of w |ds|/p over its slip s: w is the normal
traction (Archard), or the friction traction with form 'energy'. The points are the whole patch, its strips or its nodes.
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
from ..results.patch_rows import Values
from ..results.travel import check_pieces_overlap
from ..rig import fields, numerics, solve

UNBOUNDED_OUTCOMES = (
    Outcome.GROWS,
    Outcome.EXCEEDS_TRAVEL,
    Outcome.LEAVES_GROOVES,
    Outcome.NOT_CONVERGED,
)
MIN_FRAMES = 64  # Smallest number of interface frames per cycle.
MAX_CYCLE_FRAMES = 800  # Largest number of interface frames per cycle.
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
    values: Values | None = None
    outcome: Outcome | None = None


class _Cycle(NamedTuple):
    """Histories of a whole interface at the k samples of one cycle.

    - slide, slip: relative displacement and slip [m].
    - force, load: friction force and normal load [N].
    """

    slide: np.ndarray
    slip: np.ndarray
    force: np.ndarray
    load: np.ndarray


class _NodeFrames(NamedTuple):
    """Motion of the m interface nodes in f frames of one cycle.

    - slide (f,), load (f,): displacement of the holder [m] and vertical force [N].
    - slip, shear_stress (f, m): slip [m] and traction parallel to the interface [Pa].
    - is_closed: whether the first frame follows the last one.
    """

    slide: np.ndarray
    load: np.ndarray
    slip: np.ndarray
    shear_stress: np.ndarray
    is_closed: bool


class _PointSlip(NamedTuple):
    """Slip of p points at the k samples of one cycle.

    - slip (k, p): slip [m].
    - weight (k, p): traction that wears each point, as a fraction of its pressure.
    - is_closed: whether the first sample follows the last one.
    """

    slip: np.ndarray
    weight: np.ndarray
    is_closed: bool = False

    def integrate_path(self, samples) -> np.ndarray:
        """Integrate the paths (p,) [m] over selected samples by the trapezoidal rule."""
        if self.is_closed:
            samples = np.append(samples[-1:], samples)
        weight = self.weight[samples]
        steps = np.abs(np.diff(self.slip[samples], axis=0))
        return (steps * (weight[1:] + weight[:-1]) / 2).sum(axis=0)

    @property
    def path(self) -> np.ndarray:
        """Paths (p,) [m] over all samples."""
        return self.integrate_path(np.arange(len(self.slip)))

    def estimate_reversal_error(self, force) -> float:
        """Estimate the relative error of the path due to reversals between samples.

        A reversal at the distance d <= 1/2 from the nearest sample hides a part f(d) of the path. With
        every third sample it hides f(d), f(1 - d) or f(1 + d), depending on which samples are used. 3/2
        of the mean increase is at least f(d) for any d, both for a sharp reversal, f = c d, and for a
        smooth one, f = c d^2.

        Parameters
        ----------
        force : (p,) ndarray
            Normal forces [N], the weights of the points in the mean.
        """
        path = self.path
        total = float(path @ force)
        if total <= 0:
            return 0.0
        count = len(self.slip)
        ends = [] if self.is_closed else [0, count - 1]
        changes = []
        for first in range(3):
            samples = np.unique([*ends, *range(first, count, 3)]).astype(int)
            changes.append(abs(float((path - self.integrate_path(samples)) @ force)))
        return REVERSAL_ERROR_FACTOR * float(np.mean(changes)) / total


def choose_frame_count(tolerance: float) -> int:
    """Return the number of frames per cycle for a slip path accurate to tolerance/100.

    A reversal between two of k frames of a sinusoid hides up to (pi/k)^2/2 of the amplitude.
    """
    return int(np.clip(ceil(np.pi / sqrt(0.02 * tolerance)), MIN_FRAMES, MAX_CYCLE_FRAMES))


def slips_uniformly(model) -> bool:
    """Return whether all points of a patch, or of each of its strips, slip by equal distances."""
    return not model.partial_slip and model.side == "upper"


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
    follow = _compute_bench_slip if model.rig is None else _compute_rig_slip
    return follow(model, patch, frames)


def compute_point_slip_path(model, window, values: Values) -> tuple[float, float]:
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
    load = None if model.rig is None else model.point.load
    cycle = _select_last_cycle(model, window, load)
    path, error = _integrate_uniform_slip(model, cycle, cycle.load[0])
    if model.rig is not None:
        error += _slip_amplitude_change(values, cycle)
    return path, error


def _compute_bench_slip(model, patch, frames: int) -> CycleSlip:
    """Compute the slip path of the interface nodes in the last cycle of a bench.

    Parameters
    ----------
    model : Model
        Model of a bench.
    patch : Patch
        Solved patch.
    frames : int
        Number of frames per cycle, if the nodes do not slip alike.
    """
    cycles = max(1, round(model.slide.cycles or 1))
    is_uniform = slips_uniformly(model)
    n_frames = 0 if is_uniform else frames * cycles
    run = bench.run_bench(model, patch, steps_per_cycle(model), n_frames)
    outcome = check_pieces_overlap(None, model.patch, patch, run.slide)

    # Pieces that do not deform in shear slip alike at all nodes: one path for all.
    if is_uniform:
        cycle = _select_last_cycle(model, run)
        path, error = _integrate_uniform_slip(model, cycle, cycle.load[0])
        return CycleSlip(_spread_over_nodes(model, patch, path), error, run.values, outcome)

    is_last = run.frames >= run.first
    slide = run.slide[run.frames[is_last]]
    local = run.local[is_last]
    tau = run.tau[is_last]

    # A path that is not cyclic begins at rest, before its first frame. The load then rests on the flank of a groove.
    if run.first == 0:
        slide = np.append(0.0, slide)
        local = np.pad(local, ((1, 0), (0, 0)))
        tau = np.pad(tau, ((1, 0), (0, 0)))
        if model.grooves is not None:
            tau[0] = model.grooves.slope(0.0) * patch.pressure.sigma_n

    load = np.full(slide.size, patch.pressure.load)
    path, error = _integrate_node_slip(model, patch, _NodeFrames(slide, load, local, tau, False))
    return CycleSlip(path, error, run.values, outcome)


def _compute_rig_slip(model, patch, frames: int) -> CycleSlip:
    """Compute the slip path of the interface nodes in the last cycle of a rig.

    Parameters
    ----------
    model : Model
        Model of a rig.
    patch : Patch
        Solved patch.
    frames : int
        Number of frames in the last cycle, if the nodes do not slip alike.
    """
    settings = numerics.choose_numerics(model)
    is_uniform = slips_uniformly(model)
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
    load = patch.pressure.load
    cycle = _select_last_cycle(model, solution.window, load)
    if not is_uniform:
        node_frames = _collect_rig_frames(model, settings, patch, solution)
        path, error = _integrate_node_slip(model, patch, node_frames)
    elif strips_slide_independently(model):
        path, error = _integrate_strip_slip(model, patch, solution.window)
    else:
        path, error = _integrate_uniform_slip(model, cycle, load)
        path = _spread_over_nodes(model, patch, path)
    error += _slip_amplitude_change(solution.values, cycle)
    return CycleSlip(path, error, solution.values, outcome)


def _collect_rig_frames(model, settings, patch, solution) -> _NodeFrames:
    """Return the frames of the last cycle of a rig; over grooves the load varies with the lift."""
    frames = fields.collect_interface_fields(model, settings, patch, solution)
    frames = {name: values[1:] for name, values in frames.items()}
    response = solution.response
    loads = np.full(response.time.size, patch.pressure.load)
    if model.grooves is not None:
        loads = response.extra.get("normal_load", loads)
    load = np.interp(frames["time"], response.time, loads)
    return _NodeFrames(frames["holder_slide"], load, frames["slip"], frames["shear_stress"], True)


def _slip_amplitude_change(values: Values, cycle: _Cycle) -> float:
    """Return the relative difference between the slip amplitudes of the last cycle and the window.

    A mode that still beats causes this difference.
    """
    amplitude = float(np.ptp(cycle.slip)) / 2
    window_amplitude = values.get("slip_amplitude")
    if window_amplitude is None or amplitude <= 0:
        return 0.0
    return abs(window_amplitude / amplitude - 1)


def _select_last_cycle(model, window, load: float | None = None) -> _Cycle:
    """Return the histories of the last cycle of a bench or a rig.

    load: constant load [N] of a rig; over grooves the window has the vertical force.
    """
    if model.rig is None:
        rows = slice(window.first, None)
        loads = window.load
    else:
        rows = _is_in_last_cycle(model, window)
        loads = window.extra.get("normal_load", np.full(window.time.size, load))
    return _Cycle(window.slide[rows], window.slip[rows], window.force[rows], loads[rows])


def _is_in_last_cycle(model, window) -> np.ndarray:
    """Return whether each sample of a window is in its last cycle."""
    period = model.rig.drive.signal.period
    return window.time >= window.time[-1] - period * (1 + 1e-9)


def _compute_wearing_traction(model, slope, normal, friction) -> np.ndarray:
    """Return the traction that wears a point, per unit of relative displacement.

    On flat faces it is the normal traction V, or with form 'energy' |F| of the friction traction F, which opposes the
    slip also in a step with a reversal. On a flank of slope t = dz/dq with the path ds, it is R ds/dq = V + F t of the
    normal traction R on the flank; with form 'energy' it is |f| ds/dq = |F - V t| of the friction f along the flank.

    Parameters
    ----------
    model : Model
        Model with [wear].
    slope : ndarray
        Slope of the flank; 0 for flat faces.
    normal, friction : ndarray
        Vertical and horizontal tractions [Pa], or forces [N].
    """
    if model.wear.uses_friction_work:
        return np.abs(friction - slope * normal)
    return np.maximum(normal + slope * friction, 0.0)


def _slope_of_grooves(model, slide) -> np.ndarray:
    """Return the slope (k,) of the groove flanks at displacements [m]; zero for flat faces."""
    return np.zeros(slide.size) if model.grooves is None else model.grooves.slope(slide)


def _divide_by_pressure(traction, pressure) -> np.ndarray:
    """Return tractions (k, p) as fractions of the pressures (p,) of points; zero for open points."""
    return np.divide(traction, pressure, out=np.zeros(traction.shape), where=pressure > 0)


def _integrate_uniform_slip(model, cycle: _Cycle, load: float) -> tuple[float, float]:
    """Return the path [m] of points that slip alike, and its relative error.

    The samples of the histories contain every reversal. Only the slope of grooves varies between them.
    load: normal load [N] to which the tractions are related.
    """
    slope = _slope_of_grooves(model, cycle.slide)
    traction = _compute_wearing_traction(model, slope, cycle.load, cycle.force)
    weight = _divide_by_pressure(traction[:, None], np.array([load]))
    slip = _PointSlip(cycle.slip[:, None], weight)
    path = float(slip.path[0])
    if model.grooves is None or not path > 0:
        return path, 0.0
    coarse = float(slip.integrate_path(np.arange(0, len(weight), 2))[0])
    return path, abs(path - coarse) / path


def _spread_over_nodes(model, patch, path: float) -> np.ndarray:
    """Return one path [m] at all nodes, (m,) or (s, m)."""
    return np.full(nodal_areas(model.patch, patch.pieces.interface).shape, path)


def _integrate_strip_slip(model, patch, window) -> tuple[np.ndarray, float]:
    """Return the paths (s, m) [m] of the strips of a rig with yaw, and their relative error.

    The slip is that in the direction of the drive. An open strip has the path of the nearest strip in contact.
    """
    loads = patch.strips.force.sum(axis=1)
    is_last = _is_in_last_cycle(model, window)
    slips = window.extra.get("slips", window.extra["slides"])[is_last]
    forces = window.extra["forces"][is_last]
    traction = _compute_wearing_traction(model, 0.0, np.broadcast_to(loads, slips.shape), forces)
    slip = _PointSlip(slips, _divide_by_pressure(traction, loads))
    nearest = _find_nearest_contact(patch.strips.offsets, loads > 0)
    path = np.repeat(slip.path[nearest, None], patch.x.size, axis=1)
    return path, slip.estimate_reversal_error(loads)


def _integrate_node_slip(model, patch, frames: _NodeFrames) -> tuple[np.ndarray, float]:
    """Return the paths (m,) [m] of the nodes from frames of a cycle, and their relative error.

    Each node carries its part of the vertical force, V sigma/N. Over grooves a node slips along the flank by s - e, the
    path s of the holder less the elastic part e, and the tractions are those per length of the flank. An open node has
    the path of the nearest node in contact.

    Parameters
    ----------
    model : Model
        Model with [wear].
    patch : Patch
        Patch at the present wear, whose pressure distributes the load.
    frames : _NodeFrames
        Slip and shear stress of the nodes along the cycle.
    """
    sigma = patch.pressure.sigma_n
    slope = _slope_of_grooves(model, frames.slide)[:, None]
    load_ratio = (
        np.ones(frames.load.size) if model.grooves is None else frames.load / patch.pressure.load
    )
    normal = load_ratio[:, None] * sigma
    traction = _compute_wearing_traction(model, slope, normal, frames.shear_stress)
    local = frames.slip

    if model.grooves is not None:
        # ds/dq, the path along the flank by the relative displacement.
        path_ratio = np.sqrt(1 + slope**2)
        steps = integrate_steps(frames.slide, lambda q: np.hypot(1, model.grooves.slope(q)))
        along_flank = np.append(0.0, np.cumsum(steps))[:, None]
        local = along_flank - (frames.slide[:, None] - local) * path_ratio
        traction = traction / path_ratio

    slip = _PointSlip(local, _divide_by_pressure(traction, sigma), frames.is_closed)
    error = slip.estimate_reversal_error(sigma * patch.pieces.interface.weight)
    return slip.path[_find_nearest_contact(patch.x, sigma > 0)], error


def _find_nearest_contact(x, active) -> np.ndarray:
    """Return for each point the index (p,) of the nearest point in contact.

    A point that comes into contact during a jump of wear has the slip of this point.
    x, active (p,): positions [m], and whether each point is in contact.
    """
    touching = np.flatnonzero(active)
    if not touching.size:
        return np.arange(x.size)
    return touching[np.abs(x[:, None] - x[touching]).argmin(axis=1)]
