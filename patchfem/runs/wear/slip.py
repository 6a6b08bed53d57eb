"""Slip path of every interface point in one cycle of a converged bench or rig."""

from math import ceil, sqrt
from typing import NamedTuple

import numpy as np

from ...core import Measure, Outcome
from ...response.outcome import settle
from ..bench import bench
from ..bench.closed import integrate_steps
from ..bench.engine import steps_of
from ..patch.press import areas
from ..results.travel import outcome_on_piece
from ..rig import engines, fields, numerics

UNBOUNDED = (Outcome.GROWS, Outcome.EXCEEDS_TRAVEL, Outcome.LEAVES_GROOVES, Outcome.NOT_CONVERGED)
LEAST_FRAMES, MOST_FRAMES = 64, 800


class Rubbed(NamedTuple):
    """What one cycle of a motion does to the interface.

    path (m,), of strips (s, m) [m]: slip path of each node, or with form 'energy' its friction work per area over its
    pressure, along the flanks of grooves where there are any; miss: its relative error by the frames it is read from,
    and by what the cycles of the window still differ; values: measures of the motion; outcome: why no cycle repeats,
    else None.
    """

    path: np.ndarray
    miss: float
    values: dict
    outcome: Outcome | None


def frames_for(tolerance: float) -> int:
    """Frames of a cycle from which its slip path has an error of a hundredth of the tolerance.

    A reversal between two of k frames of a sine hides up to (pi/k)^2/2 of the amplitude.
    """
    return int(np.clip(ceil(np.pi / sqrt(0.02 * tolerance)), LEAST_FRAMES, MOST_FRAMES))


def even(model, per_point: bool = False) -> bool:
    """Whether every point of the patch, or of each of its strips, slides alike."""
    return (
        not model.partial_slip
        and model.side == "upper"
        and (model.patch.interface.strips is not None or not per_point)
    )


def apart(model) -> bool:
    """Whether strips slide each by themselves, as wear then changes."""
    return model.rig is not None and model.rig.friction.strips_slide_apart


def rubbed(model, patch, frames: int) -> Rubbed:
    """One converged cycle of a model on a patch; frames: how many of the interface it is read from."""
    return _bench(model, patch, frames) if model.rig is None else _rig(model, patch, frames)


def _bench(model, patch, frames: int) -> Rubbed:
    cycles = max(1, round(model.slide.cycles or 1))
    steps = steps_of(model)
    shaped = not even(model)
    found = bench.run(model, patch, steps, frames * cycles if shaped else 0)
    outcome = outcome_on_piece(None, model.patch, patch, found.slide)
    if shaped:
        last = found.frames >= found.first
        local, tau, slide = found.local[last], found.tau[last], found.slide[found.frames[last]]
        if found.first == 0:
            local, tau = (
                np.concatenate([np.zeros((1, part.shape[1])), part]) for part in (local, tau)
            )
            slide = np.append(0.0, slide)
            if model.grooves is not None:  # it stands on its flank
                tau[0] = model.grooves.slope(0.0) * patch.pressure.sigma_n
        if model.grooves is not None:
            local, tau = slip_path_of(
                model, patch, slide, np.full(slide.size, patch.pressure.load), local, tau
            )
        return _read(model, patch, local, tau, False, found.values, outcome)
    last = [part[found.first :] for part in (found.slide, found.slip, found.force, found.load)]
    return _alike(model, patch, last, last[-1][0], found.values, outcome)


def _rig(model, patch, frames: int) -> Rubbed:
    chosen = numerics.choose(model)
    shaped = not even(model, chosen.per_point and model.grooves is None)
    found = engines.ENGINES[chosen.engine].run(
        model, chosen, patch, frames if shaped else 0, None, None
    )
    amplitude = Measure(found.values["relative_displacement_amplitude"], "m", 0.0)
    wanted = {"relative_displacement_amplitude": amplitude}
    settled, _ = settle(found, wanted, model.accuracy.tolerance, model.rig.drive.signal)
    last = _last_cycle(model, found.window, patch.pressure.load)
    beat = _beat(found.values, last[1])
    outcome = outcome_on_piece(
        settled if settled in UNBOUNDED else None, model.patch, patch, found.response.slide
    )
    if shaped:
        slip_frames = fields.fields_of(model, chosen, patch, found)
        local, tau = slip_frames["slip"][1:], slip_frames["shear_stress"][1:]
        if model.grooves is not None:
            slide, time, window = (
                slip_frames["holder_slide"][1:],
                slip_frames["time"][1:],
                found.response,
            )
            lifted = np.interp(
                time,
                window.time,
                window.extra.get("normal_load", np.full(window.time.size, patch.pressure.load)),
            )
            local, tau = slip_path_of(model, patch, slide, lifted, local, tau)
        out = _read(model, patch, local, tau, True, found.values, outcome)
    elif apart(model):
        out = _in_strips(model, patch, found, outcome)
    else:
        out = _alike(model, patch, last, patch.pressure.load, found.values, outcome)
    return out._replace(miss=out.miss + beat)


def _beat(values: dict, slip) -> float:
    """By how much the slip of the last cycle (k,) [m] differs from the amplitude of the whole window, relative: what a
    mode that still beats leaves open."""
    own, whole = float(np.ptp(slip)) / 2, values.get("slip_amplitude")
    return abs(whole / own - 1) if whole is not None and own > 0 else 0.0


def of_point(model, window, values: dict) -> tuple:
    """(slip path [m] of one cycle of one point under [normal], its relative error by what the cycles still differ).

    It is weighted with the load where that changes. window: histories of a bench or a rig; values: measures by name.
    """
    beat = 0.0
    if model.rig is not None:
        last = _last_cycle(model, window, model.point.load)
        beat = _beat(values, last[1])
    else:
        last = [
            part[window.first :] for part in (window.slide, window.slip, window.force, window.load)
        ]
    found = _alike(model, None, last, last[-1][0], {}, None)
    return float(found.path[0]), found.miss + beat


def _last_cycle(model, window, load: float) -> list:
    """Slide [m], slip [m], force [N] and load [N] (k,) of the last cycle of a rig; over grooves the vertical force."""
    last = window.time >= window.time[-1] - model.rig.drive.signal.period * (1 + 1e-9)
    loads = window.extra.get("normal_load", np.full(window.time.size, load))
    return [part[last] for part in (window.slide, window.slip, window.force, loads)]


def _in_strips(model, patch, found, outcome) -> Rubbed:
    """The path of every strip of a rig whose modes yaw, along x; an open strip slides as the nearest that bears.

    Every third sample tells what turns between samples hide, as in `_read`.
    """
    window, loads = found.window, patch.strips.force.sum(axis=1)
    last = window.time >= window.time[-1] - model.rig.drive.signal.period * (1 + 1e-9)
    slips, forces = (
        window.extra.get("slips", window.extra["slides"])[last],
        window.extra["forces"][last],
    )
    weight = (
        np.abs(forces) / np.where(loads > 0, loads, 1.0)
        if model.wear.uses_friction_work
        else np.ones_like(slips)
    )

    def path(some) -> np.ndarray:
        return np.array(
            [_summed(slip, heavy) for slip, heavy in zip(slips[some].T, weight[some].T)]
        )

    whole, ends = path(np.arange(len(slips))), [0, len(slips) - 1]
    lost = [
        (whole - path(np.unique([*ends, *range(first, len(slips), 3)]))) @ loads
        for first in range(3)
    ]
    total, nearest = float(whole @ loads), _nearest(patch.strips.offsets, loads > 0)
    return Rubbed(
        np.repeat(whole[nearest, None], patch.x.size, axis=1),
        1.5 * float(np.mean(np.abs(lost))) / total if total > 0 else 0.0,
        found.values,
        outcome,
    )


def _alike(model, patch, last: list, scale: float, values: dict, outcome) -> Rubbed:
    """The path of a slide that is the same at every point: its length under `scale` [N], from slide, slip, force and
    load (k,) of the last cycle."""
    slide, slip, force, load = last
    # friction opposes the slip, also where a step reverses it
    weight = np.abs(force) if model.wear.uses_friction_work else load
    miss = 0.0
    if model.grooves is not None:
        weight = along_flanks(model, slide, force, load)
    path = _summed(slip, weight) / scale if scale > 0 else 0.0
    if model.grooves is not None and path > 0:
        miss = abs(path - _summed(slip[::2], weight[::2]) / scale) / path
    return Rubbed(
        np.full(1 if patch is None else areas(model.patch, patch.pieces.interface).shape, path),
        miss,
        values,
        outcome,
    )


def _summed(slip, weight) -> float:
    return float(np.sum(np.abs(np.diff(slip)) * (weight[1:] + weight[:-1]) / 2))


def along_flanks(model, slide, force, load) -> np.ndarray:
    """What wears per slide on the flanks of grooves (k,) [N]: R ds/dq = V + F t of the normal force R, with form
    'energy' |f| ds/dq = |F - V t| of the friction f along them.

    slide [m], force F against the slide [N] and vertical force V [N] (k,).
    """
    t = model.grooves.slope(slide)
    if model.wear.uses_friction_work:
        return np.abs(force - load * t)
    return np.maximum(load + force * t, 0.0)


def slip_path_of(model, patch, slide, vertical, local, tau) -> tuple:
    """(slip along the flank (f, m) [m], what wears there (f, m) [Pa]) of points of pieces that give way, from frames of
    the holder's slide (f,) [m], the vertical force V (f,) [N], irreversible slip and resultant traction (f, m).

    The slip is s - e, s the path along the flank and e what is elastic of it. A point of pressure sigma carries V
    sigma/N, so its normal stress on the flank is R = (V sigma/N + tau t)/sqrt(1 + t^2) and its friction along it, with
    form 'energy', |tau - t V sigma/N|/sqrt(1 + t^2).
    """
    g, sigma = model.grooves, patch.pressure.sigma_n
    t = g.slope(slide)[:, None]
    long, carried = np.sqrt(1 + t * t), (vertical / patch.pressure.load)[:, None] * sigma
    steps = integrate_steps(slide, lambda q: np.hypot(1, g.slope(q)))
    path = np.append(0.0, np.cumsum(steps))
    if model.wear.uses_friction_work:
        worn = np.abs(tau - t * carried)
    else:
        worn = np.maximum(carried + tau * t, 0.0)
    return path[:, None] - (slide[:, None] - local) * long, worn / long


def _read(model, patch, local, tau, closed: bool, values: dict, outcome) -> Rubbed:
    """The path of every node from frames (f, m) of local slip [m] and shear stress [Pa], over grooves those of
    `slip_path_of`; closed: the last frame is followed by the first.

    A reversal between two frames hides f(d) of the path, d <= 1/2 of their distance. Every third frame hides f(d),
    f(1 - d) or f(1 + d), from the first, the second or the third: in the mean so much more that 3/2 of it hold f(d)
    wherever d lies, of a corner f = c d as of a smooth turn f = c d^2.
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
    return Rubbed(path, 1.5 * float(np.mean(lost)) / total if total > 0 else 0.0, values, outcome)


def _path(model, patch, local, tau, closed: bool) -> np.ndarray:
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
    """Number (m,) of the nearest node in contact; one that comes into contact during a jump slides as its neighbour."""
    touching = np.flatnonzero(active)
    if not touching.size:
        return np.arange(x.size)
    return touching[np.abs(x[:, None] - x[touching]).argmin(axis=1)]
