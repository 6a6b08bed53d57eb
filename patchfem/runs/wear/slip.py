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
from ...response.rows import AMPLITUDE
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
    - is_closed: whether the first sample follows the last one.
    """

    slide: np.ndarray
    slip: np.ndarray
    force: np.ndarray
    load: np.ndarray
    is_closed: bool = False


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


class _Motion(NamedTuple):
    """Motion of a bench or a rig.

    - window: histories of its last cycles.
    - slide (k,): relative displacement [m] during the whole run.
    - values: measures by name.
    - frames: _NodeFrames of the last cycle, or None if no frames were asked for.
    - outcome: outcome of a motion without periodic cycle, else None.
    """

    window: object
    slide: np.ndarray
    values: Values
    frames: _NodeFrames | None
    outcome: Outcome | None = None


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
    """Return whether all points of a patch, or of each of its strips, slip by equal distances.

    This holds if the patch has no partial slip and its pressure moves with the upper piece. A pressure that rests on the
    lower piece passes over the points of the upper one, so that they do not slip alike.
    """
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
        Number of frames per cycle from which the path is computed, if the nodes do not slip alike.
    """
    follow = _follow_slide if model.rig is None else _follow_rig
    motion = follow(model, patch, 0 if slips_uniformly(model) else frames)
    load = patch.pressure.load
    cycle = _select_last_cycle(model, motion.window, load)

    # The slip follows from the histories if it is uniform, else from the frames of the cycle.
    if motion.frames is not None:
        path, error = _integrate_node_slip(model, patch, motion.frames)
    elif strips_slide_independently(model):
        path, error = _integrate_strip_slip(model, patch, motion.window)
    else:
        path, error = _integrate_uniform_slip(model, cycle, load)
        path = np.full(nodal_areas(model.patch, patch.pieces.interface).shape, path)
    if model.rig is not None:
        error += _slip_amplitude_change(motion.values, cycle)
    outcome = check_pieces_overlap(motion.outcome, model.patch, patch, motion.slide)
    return CycleSlip(path, error, motion.values, outcome)


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


def _follow_slide(model, patch, frames: int) -> _Motion:
    """Compute the motion of a bench.

    `frames` is the number of frames in each cycle, 0 for histories only.
    """
    cycles = max(1, round(model.slide.cycles or 1))
    run = bench.run_bench(model, patch, steps_per_cycle(model), frames * cycles)
    if not frames:
        return _Motion(run, run.slide, run.values, None)
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
    return _Motion(run, run.slide, run.values, _NodeFrames(slide, load, local, tau, False))


def _follow_rig(model, patch, frames: int) -> _Motion:
    """Compute the motion of a rig.

    `frames` is the number of frames in the last cycle, 0 for histories only.
    """
    settings = numerics.choose_numerics(model)
    solution = solve.solve_rig(model, settings, patch, frames)
    response = solution.response

    # A motion without bound has no slip path (the caller stops the wear).
    amplitude = Measure(solution.values[AMPLITUDE], "m", 0.0)
    outcome, _ = judge_outcome(
        solution, {AMPLITUDE: amplitude}, model.accuracy.tolerance, model.rig.drive.signal
    )
    node_frames = None
    if frames:
        frame_fields = fields.collect_interface_fields(model, settings, patch, solution)
        in_cycle = {name: values[1:] for name, values in frame_fields.items()}
        # Over grooves the load varies with the lift.
        loads = np.full(response.time.size, patch.pressure.load)
        if model.grooves is not None:
            loads = response.extra.get("normal_load", loads)
        node_frames = _NodeFrames(
            slide=in_cycle["holder_slide"],
            load=np.interp(in_cycle["time"], response.time, loads),
            slip=in_cycle["slip"],
            shear_stress=in_cycle["shear_stress"],
            is_closed=True,
        )
    outcome = outcome if outcome in UNBOUNDED_OUTCOMES else None
    return _Motion(solution.window, response.slide, solution.values, node_frames, outcome)


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

    `window` has the histories of the last cycles. `load` is the constant load [N] of a rig. Over grooves the window has
    the vertical force.
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


def _make_point_slip(
    model, motion: _Cycle | _NodeFrames, slip, friction, pressure, normal
) -> _PointSlip:
    """Return the slip of points with the traction that wears them.

    On flat faces it is the normal traction V, or with form 'energy' |F| of the friction traction F, which opposes the
    slip also in a step with a reversal. On a flank of slope t = dz/dq with the path ds, it is R ds/dq = V + F t of the
    normal traction R on the flank. With form 'energy' it is |f| ds/dq = |F - V t| of the friction f along the flank.

    Parameters
    ----------
    model : Model
        Model with [wear].
    motion : _Cycle or _NodeFrames
        Motion of the whole interface.
    slip : (k, p) ndarray
        Slip of the points [m].
    friction, normal : (k, p) ndarray
        Horizontal and vertical tractions [Pa], or forces [N].
    pressure : (p,) ndarray
        Traction or force to which they are related. An open point, with 0, does not wear.
    """
    slope = 0.0 if model.grooves is None else model.grooves.slope(motion.slide)[:, None]
    if model.wear.uses_friction_work:
        traction = np.abs(friction - slope * normal)
    else:
        traction = np.maximum(normal + slope * friction, 0.0)
    weight = np.divide(traction, pressure, out=np.zeros(slip.shape), where=pressure > 0)
    return _PointSlip(slip, weight, motion.is_closed)


def _integrate_uniform_slip(model, cycle: _Cycle, load: float) -> tuple[float, float]:
    """Return the path [m] of points that slip alike, and its relative error.

    The samples of the histories contain every reversal. Only the slope of grooves varies between them. `model` has
    friction and grooves, `cycle` the histories of the last cycle, and `load` [N] is the normal load to which the
    tractions are related.
    """
    slip, force, loads = (row[:, None] for row in (cycle.slip, cycle.force, cycle.load))
    points = _make_point_slip(model, cycle, slip, force, np.array([load]), loads)
    path = float(points.path[0])
    if model.grooves is None or not path > 0:
        return path, 0.0
    coarse = float(points.integrate_path(np.arange(0, len(slip), 2))[0])
    return path, abs(path - coarse) / path


def _integrate_strip_slip(model, patch, window) -> tuple[np.ndarray, float]:
    """Return the paths (s, m) [m] of the strips of a rig with yaw, and their relative error.

    The slip is that in the direction of the drive. An open strip has the path of the nearest strip in contact. `patch`
    is in strips, and `window` has the histories of the last cycles with those of the strips.
    """
    loads = patch.strips.force.sum(axis=1)
    is_last = _is_in_last_cycle(model, window)
    slips = window.extra.get("slips", window.extra["slides"])[is_last]
    forces = window.extra["forces"][is_last]
    cycle = _select_last_cycle(model, window, patch.pressure.load)
    points = _make_point_slip(model, cycle, slips, forces, loads, loads)
    path = points.path[_find_nearest_contact(patch.strips.offsets, loads > 0)]
    path = np.repeat(path[:, None], patch.x.size, axis=1)
    return path, points.estimate_reversal_error(loads)


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
    normal = np.outer(frames.load / patch.pressure.load, sigma)
    points = _make_point_slip(model, frames, frames.slip, frames.shear_stress, sigma, normal)
    grooves = model.grooves
    if grooves is not None:
        # ds/dq, the path along the flank by the relative displacement.
        path_ratio = np.sqrt(1 + grooves.slope(frames.slide)[:, None] ** 2)
        steps = integrate_steps(frames.slide, lambda q: np.hypot(1, grooves.slope(q)))
        along_flank = np.append(0.0, np.cumsum(steps))[:, None]
        elastic = frames.slide[:, None] - frames.slip
        points = _PointSlip(
            along_flank - elastic * path_ratio, points.weight / path_ratio, points.is_closed
        )
    error = points.estimate_reversal_error(sigma * patch.pieces.interface.weight)
    return points.path[_find_nearest_contact(patch.x, sigma > 0)], error


def _find_nearest_contact(x, active) -> np.ndarray:
    """Return for each point the index (p,) of the nearest point in contact.

    A point that comes into contact during a jump of wear has the slip of this point.
    x, active (p,): positions [m], and whether each point is in contact.
    """
    touching = np.flatnonzero(active)
    if not touching.size:
        return np.arange(x.size)
    return touching[np.abs(x[:, None] - x[touching]).argmin(axis=1)]
