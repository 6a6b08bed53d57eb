"""Slip path of every interface node in one cycle of a converged bench or rig.

In: a model and its worn patch. Out: `CycleSlip` with the path, its error and the outcome.
"""

from math import ceil, sqrt
from typing import NamedTuple

import numpy as np

from ...core import Measure, Outcome
from ...response.outcome import judge_outcome
from ..bench import bench
from ..bench.closed import integrate_steps
from ..bench.engine import steps_per_cycle
from ..patch.press import areas
from ..results.travel import outcome_on_piece
from ..rig import fields, numerics, solve

UNBOUNDED_OUTCOMES = (
    Outcome.GROWS,
    Outcome.EXCEEDS_TRAVEL,
    Outcome.LEAVES_GROOVES,
    Outcome.NOT_CONVERGED,
)
LEAST_FRAMES, MOST_FRAMES = 64, 800


class CycleSlip(NamedTuple):
    """Slip of the interface in one cycle of a motion.

    - path: slip path of each node (m,), of strips (s, m) [m]. With form 'energy' it is friction
      work per area over pressure, and over grooves it is along their flanks.
    - miss: relative error due to the number of frames and to differences between the cycles of the
      window.
    - values: measures of the motion by name.
    - outcome: reason why no cycle is periodic, else None.
    """

    path: np.ndarray
    miss: float
    values: dict
    outcome: Outcome | None


def frames_for(tolerance: float) -> int:
    """Return the frames per cycle with which the slip path has an error of tolerance/100.

    A reversal between two of k frames of a sine hides up to (pi/k)^2/2 of the amplitude.
    """
    return int(np.clip(ceil(np.pi / sqrt(0.02 * tolerance)), LEAST_FRAMES, MOST_FRAMES))


def slips_uniformly(model, per_point: bool = False) -> bool:
    """Return whether all points of the patch, or of each of its strips, have the same slip."""
    return (
        not model.partial_slip
        and model.side == "upper"
        and (model.patch.interface.strips is not None or not per_point)
    )


def strips_slide_independently(model) -> bool:
    """Return whether strips slide independently, which changes with wear."""
    return model.rig is not None and model.rig.friction.strips_slide_apart


def slip_of_cycle(model, patch, frames: int) -> CycleSlip:
    """Return the slip of one converged cycle of a model on a patch.

    frames: number of frames of the interface from which it is computed.
    """
    return _bench(model, patch, frames) if model.rig is None else _rig(model, patch, frames)


def _bench(model, patch, frames: int) -> CycleSlip:
    """Return the slip of the last cycle of a bench."""
    cycles = max(1, round(model.slide.cycles or 1))
    steps = steps_per_cycle(model)
    shaped = not slips_uniformly(model)
    found = bench.run(model, patch, steps, frames * cycles if shaped else 0)
    outcome = outcome_on_piece(None, model.patch, patch, found.slide)
    if shaped:
        last = found.frames >= found.first
        local = found.local[last]
        tau = found.tau[last]
        slide = found.slide[found.frames[last]]
        if found.first == 0:
            local, tau = (
                np.concatenate([np.zeros((1, part.shape[1])), part]) for part in (local, tau)
            )
            slide = np.append(0.0, slide)
            if model.grooves is not None:  # at the start the load rests on the flank of a groove
                tau[0] = model.grooves.slope(0.0) * patch.pressure.sigma_n
        if model.grooves is not None:
            local, tau = slip_path(
                model, patch, slide, np.full(slide.size, patch.pressure.load), local, tau
            )
        return _read(model, patch, local, tau, False, found.values, outcome)
    last = [part[found.first :] for part in (found.slide, found.slip, found.force, found.load)]
    return _uniform_slip(model, patch, last, last[-1][0], found.values, outcome)


def _rig(model, patch, frames: int) -> CycleSlip:
    """Return the slip of the last cycle of a rig."""
    chosen = numerics.choose(model)
    shaped = not slips_uniformly(model, chosen.per_point and model.grooves is None)
    found = solve.solve(model, chosen, patch, frames if shaped else 0)
    amplitude = Measure(found.values["relative_displacement_amplitude"], "m", 0.0)
    wanted = {"relative_displacement_amplitude": amplitude}
    settled, _ = judge_outcome(found, wanted, model.accuracy.tolerance, model.rig.drive.signal)
    last = _last_cycle(model, found.window, patch.pressure.load)
    beat = _beat(found.values, last[1])
    outcome = outcome_on_piece(
        settled if settled in UNBOUNDED_OUTCOMES else None, model.patch, patch, found.response.slide
    )
    if shaped:
        slip_frames = fields.collect_frames(model, chosen, patch, found)
        local = slip_frames["slip"][1:]
        tau = slip_frames["shear_stress"][1:]
        if model.grooves is not None:
            slide = slip_frames["holder_slide"][1:]
            time = slip_frames["time"][1:]
            window = found.response
            lifted = np.interp(
                time,
                window.time,
                window.extra.get("normal_load", np.full(window.time.size, patch.pressure.load)),
            )
            local, tau = slip_path(model, patch, slide, lifted, local, tau)
        out = _read(model, patch, local, tau, True, found.values, outcome)
    elif strips_slide_independently(model):
        out = _slip_of_strips(model, patch, found, outcome)
    else:
        out = _uniform_slip(model, patch, last, patch.pressure.load, found.values, outcome)
    return out._replace(miss=out.miss + beat)


def _beat(values: dict, slip) -> float:
    """Return the relative difference between the slip amplitudes of the last cycle and the window.

    It is due to a mode that still beats. slip: (k,) [m] of the last cycle.
    """
    own = float(np.ptp(slip)) / 2
    whole = values.get("slip_amplitude")
    return abs(whole / own - 1) if whole is not None and own > 0 else 0.0


def slip_path_of_point(model, window, values: dict) -> tuple:
    """Return the slip path [m] of one cycle of a point under [normal], and its relative error.

    It is weighted with the load if that changes. The error is that by differences between the
    cycles.

    Parameters
    ----------
    model : Model
    window
        Histories of a bench or a rig.
    values : dict
        Measures by name.
    """
    beat = 0.0
    if model.rig is not None:
        last = _last_cycle(model, window, model.point.load)
        beat = _beat(values, last[1])
    else:
        last = [
            part[window.first :] for part in (window.slide, window.slip, window.force, window.load)
        ]
    found = _uniform_slip(model, None, last, last[-1][0], {}, None)
    return float(found.path[0]), found.miss + beat


def _last_cycle(model, window, load: float) -> list:
    """Return slide [m], slip [m], force [N] and load [N] (k,) of the last cycle of a rig.

    Over grooves the load is the vertical force.
    """
    last = window.time >= window.time[-1] - model.rig.drive.signal.period * (1 + 1e-9)
    loads = window.extra.get("normal_load", np.full(window.time.size, load))
    return [part[last] for part in (window.slide, window.slip, window.force, loads)]


def _slip_of_strips(model, patch, found, outcome) -> CycleSlip:
    """Return the slip of every strip of a rig with yaw, along x.

    An open strip has the slip of the nearest strip in contact. Every third sample shows the error
    by reversals between samples, as in `_read`.
    """
    window = found.window
    loads = patch.strips.force.sum(axis=1)
    last = window.time >= window.time[-1] - model.rig.drive.signal.period * (1 + 1e-9)
    slips = window.extra.get("slips", window.extra["slides"])[last]
    forces = window.extra["forces"][last]
    weight = (
        np.abs(forces) / np.where(loads > 0, loads, 1.0)
        if model.wear.uses_friction_work
        else np.ones_like(slips)
    )

    def path(some) -> np.ndarray:
        """Return the slip path (s,) [m] of the strips from some samples."""
        return np.array(
            [_integrate(slip, heavy) for slip, heavy in zip(slips[some].T, weight[some].T)]
        )

    whole = path(np.arange(len(slips)))
    ends = [0, len(slips) - 1]
    lost = [
        (whole - path(np.unique([*ends, *range(first, len(slips), 3)]))) @ loads
        for first in range(3)
    ]
    total = float(whole @ loads)
    nearest = _nearest(patch.strips.offsets, loads > 0)
    return CycleSlip(
        np.repeat(whole[nearest, None], patch.x.size, axis=1),
        1.5 * float(np.mean(np.abs(lost))) / total if total > 0 else 0.0,
        found.values,
        outcome,
    )


def _uniform_slip(model, patch, last: list, scale: float, values: dict, outcome) -> CycleSlip:
    """Return the slip that is the same at every point, over `scale` [N].

    last: slide, slip, force and load (k,) of the last cycle.
    """
    slide, slip, force, load = last
    # friction opposes the slip, also in a step with a reversal
    weight = np.abs(force) if model.wear.uses_friction_work else load
    miss = 0.0
    if model.grooves is not None:
        weight = along_flanks(model, slide, force, load)
    path = _integrate(slip, weight) / scale if scale > 0 else 0.0
    if model.grooves is not None and path > 0:
        miss = abs(path - _integrate(slip[::2], weight[::2]) / scale) / path
    return CycleSlip(
        np.full(1 if patch is None else areas(model.patch, patch.pieces.interface).shape, path),
        miss,
        values,
        outcome,
    )


def _integrate(slip, weight) -> float:
    """Return the integral of the weight over |slip| by the trapezoidal rule."""
    return float(np.sum(np.abs(np.diff(slip)) * (weight[1:] + weight[:-1]) / 2))


def along_flanks(model, slide, force, load) -> np.ndarray:
    """Return the force per slide (k,) [N] that wears the flanks of grooves.

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


def slip_path(model, patch, slide, vertical, local, tau) -> tuple:
    """Return slip along the flank [m] and wearing stress [Pa] (f, m) of points over grooves.

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
    g = model.grooves
    sigma = patch.pressure.sigma_n
    t = g.slope(slide)[:, None]
    long = np.sqrt(1 + t * t)
    carried = (vertical / patch.pressure.load)[:, None] * sigma
    steps = integrate_steps(slide, lambda q: np.hypot(1, g.slope(q)))
    path = np.append(0.0, np.cumsum(steps))
    if model.wear.uses_friction_work:
        worn = np.abs(tau - t * carried)
    else:
        worn = np.maximum(carried + tau * t, 0.0)
    return path[:, None] - (slide[:, None] - local) * long, worn / long


def _read(model, patch, local, tau, closed: bool, values: dict, outcome) -> CycleSlip:
    """Return the slip path of every node from frames of local slip and shear stress.

    Over grooves, the frames are those of `slip_path`. A reversal between two frames hides f(d)
    of the path, d <= 1/2 of their distance. Every third frame hides f(d), f(1 - d) or f(1 + d), for
    the first, second or third choice: 3/2 of the mean excess contains f(d) for any d, for a corner
    f = c d as well as for a smooth reversal f = c d^2.

    Parameters
    ----------
    model : Model
    patch : Patch
    local, tau : (f, m)
        Local slip [m] and shear stress [Pa].
    closed : bool
        Whether the last frame is followed by the first one.
    values : dict
        Measures by name.
    outcome : Outcome or None
    """
    path = _path(model, patch, local, tau, closed)
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    ends = [] if closed else [0, len(local) - 1]
    thirds = [np.unique([*ends, *range(first, len(local), 3)]).astype(int) for first in range(3)]
    lost = [
        abs(float((path - _path(model, patch, local[at], tau[at], closed)) @ force))
        for at in thirds
    ]
    total = float(path @ force)
    return CycleSlip(
        path, 1.5 * float(np.mean(lost)) / total if total > 0 else 0.0, values, outcome
    )


def _path(model, patch, local, tau, closed: bool) -> np.ndarray:
    """Return the slip path (m,) [m] of the nodes from frames."""
    if closed:
        local, tau = (np.concatenate([part[-1:], part]) for part in (local, tau))
    steps = np.abs(np.diff(local, axis=0))
    sigma = patch.pressure.sigma_n
    path = steps.sum(axis=0)
    if model.wear.uses_friction_work or model.grooves is not None:
        work = np.sum(steps * (np.abs(tau[1:]) + np.abs(tau[:-1])) / 2, axis=0)
        path = np.divide(work, sigma, out=np.zeros_like(work), where=sigma > 0)
    return path[_nearest(patch.x, sigma > 0)]


def _nearest(x, active) -> np.ndarray:
    """Return the index (m,) of the nearest node in contact.

    A node that comes into contact during a jump has the slip of this neighbour.
    """
    touching = np.flatnonzero(active)
    if not touching.size:
        return np.arange(x.size)
    return touching[np.abs(x[:, None] - x[touching]).argmin(axis=1)]
