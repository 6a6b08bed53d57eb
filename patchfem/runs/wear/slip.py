"""Slip path of each interface node in one periodic cycle of a bench or a rig.

In: a model and its worn patch. Out: `CycleSlip` with the path, its error and the outcome of the motion. A point with
the pressure p wears by L p per cycle with the path L, the integral of w |ds|/p over its slip s: w is the normal
traction (Archard), or the friction traction with form 'energy'. The points are the whole patch, its bands or its nodes.
"""

from math import ceil, sqrt
from typing import NamedTuple

import numpy as np

from ... import surface
from ...core import Measure, Outcome
from ...measures.outcome import judge_outcome
from ...measures.rows import AMPLITUDE
from ..bench.slides import integrate_steps
from ..interfaces import bands
from ..results.interfaces import check_pieces_overlap
from ..results.patch_rows import Values
from ..results.result import UNBOUNDED_OUTCOMES
from ..rig import engines, fields, rig, slides

MIN_CYCLE_FRAMES = 64  # Smallest number of interface frames per cycle.
MAX_CYCLE_FRAMES = 800  # Largest number of interface frames per cycle.


class CycleSlip(NamedTuple):
    """Slip path of the interface nodes in one cycle of a motion.

    - path: slip path [m] of each node (m,). With form 'energy' it is the
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
    """Motion of p points at the k samples of one cycle: the whole interface, its bands or its nodes.

    - slide (k,): relative displacement of the holders [m].
    - slip (k, p): slip [m].
    - friction, normal (k, p): horizontal and vertical forces [N], or tractions [Pa].
    - reference (p,): force or traction to which the wear of a point is related; a point with 0 is open and does not wear.
    - is_closed: whether the first sample follows the last one.
    """

    slide: np.ndarray
    slip: np.ndarray
    friction: np.ndarray
    normal: np.ndarray
    reference: np.ndarray
    is_closed: bool = False


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
        """Slip paths (p,) [m] of the points over all samples."""
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
        # Ratio of the error due to reversals between samples to the mean change of the path if only
        # every third sample is used.
        return 1.5 * float(np.mean(changes)) / total


def choose_frame_count(tolerance: float) -> int:
    """Return the number of frames per cycle for a slip path accurate to tolerance/100.

    A frame is an instant at which the slip of all nodes is stored. A reversal between two of k frames of a sinusoid hides
    up to (pi/k)^2/2 of the amplitude.
    """
    return int(np.clip(ceil(np.pi / sqrt(0.02 * tolerance)), MIN_CYCLE_FRAMES, MAX_CYCLE_FRAMES))


def slips_uniformly(model) -> bool:
    """Return whether all points of a patch, or of each of its bands, slip by equal distances.

    This holds if the patch has no partial slip and its pressure moves with the upper piece. A pressure that rests on the
    lower piece passes over the points of the upper one, so that they do not slip alike.
    """
    return not model.partial_slip and model.side == "upper"


def bands_slide_independently(model) -> bool:
    """Return whether bands slide independently, so that their motion depends on the wear."""
    return model.rig is not None and model.rig.friction.bands_slide_apart


def compute_cycle_slip(model, patch, n_cycle_frames: int) -> CycleSlip:
    """Compute the slip path of the interface nodes in one periodic cycle of a model.

    Parameters
    ----------
    model : Model
        Model at the present wear.
    patch : Patch
        Patch at the present wear.
    n_cycle_frames : int
        Number of frames per cycle from which the path is computed, if the nodes do not slip alike.
    """
    n_frames = 0 if slips_uniformly(model) else n_cycle_frames
    if model.rig is None:
        n_frames *= max(1, round(model.slide.cycles or 1))
    settings = engines.choose_numerics(model)
    solution = rig.solve_rig(model, settings, patch, n_frames)
    cycle = _select_last_cycle(model, solution.run.window, patch.pressure.load)

    # The slip follows from the histories if it is uniform, else from the frames of the cycle.
    if n_frames:
        nodes = _collect_nodes(model, settings, patch, solution)
        path, error = _integrate_node_slip(model, patch, nodes)
    elif bands_slide_independently(model):
        path, error = _integrate_band_slip(model, patch, solution.run.window, cycle)
    else:
        path, error = _integrate_uniform_slip(model, cycle)
        path = np.full(patch.pieces.interface.weight.shape, path)
    outcome = None
    if model.rig is not None:
        error += _slip_amplitude_change(solution.values, cycle)
        outcome = _find_unbounded_outcome(model, solution)
    outcome = check_pieces_overlap(outcome, model.patch, patch, solution.run.response.slide)
    return CycleSlip(path, error, solution.values, outcome)


def compute_point_slip_path(model, window, values: Values) -> tuple[float, float]:
    """Return the slip path [m] per cycle of a single point under [normal], and its relative error.

    The path is weighted with the load, relative to its mean. The error comes from differences between cycles.

    Parameters
    ----------
    model : Model
        Model of a bench or a rig with [normal].
    window
        Histories of a bench or a rig.
    values : dict
        Measures by name.
    """
    cycle = _select_last_cycle(model, window, model.point.load)
    path, error = _integrate_uniform_slip(model, cycle)
    if model.rig is not None:
        error += _slip_amplitude_change(values, cycle)
    return path / _count_path_cycles(model, window), error


def _find_unbounded_outcome(model, solution) -> Outcome | None:
    """Return the outcome of a motion of a rig without bound, which has no slip path; None for any other motion."""
    amplitude = Measure(solution.values[AMPLITUDE], "m", 0.0)
    outcome, _ = judge_outcome(
        solution.run,
        {AMPLITUDE: amplitude},
        (model.accuracy.tolerance, 0.0),
        model.rig.drive.signal,
        repeat=model.rig.count_repeat_cycles(model.point),
    )
    return outcome if outcome in UNBOUNDED_OUTCOMES else None


def _collect_nodes(model, settings, patch, solution) -> _Cycle:
    """Return the slip and the tractions of the nodes in the frames of the last cycle.

    Parameters
    ----------
    model : Model
        Model at the present worn depth.
    settings : Numerics
        Settings of the motion.
    patch : Patch
        Patch at the present worn depth.
    solution : Solution
        Motion with its frames.
    """
    response = solution.run.response
    sigma = patch.pressure.sigma_n
    is_rig = model.rig is not None
    if is_rig:
        frames = fields.collect_interface_fields(model, settings, patch, solution)
        in_cycle = np.arange(frames["time"].size) > 0
    else:
        frames = slides.collect_slide_frames(model, patch, response)
        # A path that is not cyclic begins at rest, before its first frame. The load then rests on the flank of a groove.
        in_cycle = np.append(response.first == 0, response.frames >= response.first)
        if model.grooves is not None:
            frames["shear_stress"][0] = model.grooves.slope(0.0) * sigma
    frames = {name: values[in_cycle] for name, values in frames.items()}

    # Over the grooves of a rig the load varies with the lift, and each node carries its part of it.
    shares = np.ones(frames["time"].size)
    if is_rig and model.grooves is not None:
        load = patch.pressure.load
        loads = response.extra.get("normal_load", np.full(response.time.size, load))
        shares = np.interp(frames["time"], response.time, loads) / load
    return _Cycle(
        slide=frames["holder_slide"],
        slip=frames["slip"],
        friction=frames["shear_stress"],
        normal=np.outer(shares, sigma),
        reference=sigma,
        is_closed=is_rig,
    )


def _slip_amplitude_change(values: Values, cycle: _Cycle) -> float:
    """Return the relative difference between the slip amplitudes of the last cycle and of all evaluated cycles.

    `values` has the measures of the evaluated cycles. A mode that still beats causes this difference.
    """
    amplitude = float(np.ptp(cycle.slip)) / 2
    window_amplitude = values.get("slip_amplitude")
    if window_amplitude is None or amplitude <= 0:
        return 0.0
    return abs(window_amplitude / amplitude - 1)


def _select_last_cycle(model, window, load: float) -> _Cycle:
    """Return the motion of a bench or a rig as a whole in its last cycle.

    `window` has the histories of the last cycles. `load` [N] is the load of the patch or point, or its mean. Over grooves
    the window of a rig has the vertical force. Under a load that oscillates, the motion has as many cycles as the load
    and the drive need to repeat.
    """
    rows = slice(None) if model.rig is None else _is_in_last_cycle(model, window)
    loads = window.extra.get("normal_load", np.full(window.time.size, load))
    slip, force, loads = (row[rows, None] for row in (window.slip, window.force, loads))
    return _Cycle(window.slide[rows], slip, force, loads, np.array([load]))


def _is_in_last_cycle(model, window) -> np.ndarray:
    """Return whether each sample of a window is in its last cycle, or in the cycles after which load and drive repeat."""
    period = model.rig.drive.signal.period * _count_path_cycles(model, window)
    return window.time >= window.time[-1] - period * (1 + 1e-9)


def _count_path_cycles(model, window) -> int:
    """Return the number of drive cycles after which the drive and the load of a rig repeat; at most those of the window."""
    if model.rig is None:
        return 1
    repeat = model.rig.count_repeat_cycles(model.point) or 1.0
    n_cycles = round(window.span / model.rig.drive.signal.period)
    return max(1, min(round(repeat), n_cycles))


def _make_point_slip(model, cycle: _Cycle) -> _PointSlip:
    """Return the slip of the points of a cycle with the traction that wears them.

    On flat faces it is the normal traction V, or with form 'energy' |F| of the friction traction F, which opposes the
    slip also in a step with a reversal. On a flank of slope t = dz/dq with the path ds, it is R ds/dq = V + F t of the
    normal traction R on the flank. With form 'energy' it is |f| ds/dq = |F - V t| of the friction f along the flank.
    `model` has [wear], and grooves or not.
    """
    slope = 0.0 if model.grooves is None else model.grooves.slope(cycle.slide)[:, None]
    if model.wear.uses_friction_work:
        traction = np.abs(cycle.friction - slope * cycle.normal)
    else:
        traction = np.maximum(cycle.normal + slope * cycle.friction, 0.0)
    weight = np.divide(
        traction, cycle.reference, out=np.zeros(cycle.slip.shape), where=cycle.reference > 0
    )
    return _PointSlip(cycle.slip, weight, cycle.is_closed)


def _integrate_uniform_slip(model, cycle: _Cycle) -> tuple[float, float]:
    """Return the path [m] of points that slip alike, and its relative error.

    The samples of the histories contain every reversal. Only the slope of grooves and a load that oscillates vary between
    them. `model` has friction, grooves and load, and `cycle` is that of the whole interface.
    """
    points = _make_point_slip(model, cycle)
    path = float(points.path[0])
    if not path > 0 or (model.grooves is None and not model.load_varies):
        return path, 0.0
    coarse = float(points.integrate_path(np.arange(0, len(cycle.slip), 2))[0])
    return path, abs(path - coarse) / path


def _integrate_band_slip(model, patch, window, cycle: _Cycle) -> tuple[np.ndarray, float]:
    """Return the paths (m,) [m] of the cells of a face with yaw, which are those of its bands, and their relative error.

    The slip is that in the direction of the drive. An open band has the path of the nearest band in contact. `window` has
    the histories of the last cycles with those of the bands, and `cycle` is that of the whole interface.
    """
    loads = bands.compute_band_loads(patch)
    is_last = _is_in_last_cycle(model, window)
    slips = window.extra.get("slips", window.extra["slides"])[is_last]
    forces = window.extra["forces"][is_last]
    points = _make_point_slip(model, _Cycle(cycle.slide, slips, forces, loads[None], loads))
    nearest = _find_nearest_contact(np.arange(loads.size, dtype=float), loads > 0)
    path = points.path[nearest][bands.number_bands(patch)]
    return path, points.estimate_reversal_error(loads)


def _integrate_node_slip(model, patch, nodes: _Cycle) -> tuple[np.ndarray, float]:
    """Return the paths (m,) [m] of the nodes of a patch in a cycle, and their relative error.

    Over grooves a node slips along the flank by s - e, the path s of the holder less the elastic part e, and the
    tractions are those per length of the flank. An open node has the path of the nearest node in contact.
    """
    sigma = patch.pressure.sigma_n
    points = _make_point_slip(model, nodes)
    grooves = model.grooves
    if grooves is not None:
        # ds/dq, the path along the flank by the relative displacement.
        path_ratio = np.sqrt(1 + grooves.slope(nodes.slide)[:, None] ** 2)
        steps = integrate_steps(nodes.slide, lambda q: np.hypot(1, grooves.slope(q)))
        along_flank = np.append(0.0, np.cumsum(steps))[:, None]
        elastic = nodes.slide[:, None] - nodes.slip
        points = _PointSlip(
            along_flank - elastic * path_ratio, points.weight / path_ratio, points.is_closed
        )
    error = points.estimate_reversal_error(sigma * patch.pieces.interface.weight)
    if model.patch.area is not None and patch.pressure.load > 0:
        known = np.where(sigma > 0, points.path, np.nan).reshape(patch.shape)
        return surface.areal.fill_nearest(known).ravel(), error
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
