"""The law bench: a prescribed slide in, the loop out; over one point or over a patch, with or without its shear."""

from dataclasses import dataclass
from itertools import pairwise
from time import perf_counter

import numpy as np

from ...core import PatchfemError
from ...model.law import acting, bonds_of
from ...model.load import load_at, refined, varies
from ...model.slide import lateral_corners, path_of
from ...response.measures import harmonic, interface_loop, ledger_measures, step_harmonic
from ..fields import element_fields, point_fields
from .law import law_for
from .ledger import _frame_numbers, _refuse_costly, _split, ledger_of


@dataclass(frozen=True, eq=False, slots=True)
class BenchRun:
    """One pass over the path. time, slide, rate, force, load, slip: (k,); ledger: work, stored, dissipated and created
    energy (4, k) [J], all but the stored one running sums; tau, local: frames (f, m) of traction [Pa] and local slip
    [m] at samples `frames`; values by measure name. lateral, lateral_force, yaw_moment: (k,) of a slide in two
    directions, else None."""

    time: np.ndarray
    slide: np.ndarray
    rate: np.ndarray
    force: np.ndarray
    load: np.ndarray
    slip: np.ndarray
    ledger: np.ndarray
    frames: np.ndarray
    tau: np.ndarray
    local: np.ndarray
    values: dict
    seconds: float
    lateral: np.ndarray | None = None
    lateral_force: np.ndarray | None = None
    yaw_moment: np.ndarray | None = None


def run(scene, patch, steps: int, frames: int = 0, say=None, path=None) -> BenchRun:
    """Slide the interface of a scene along its path with `steps` per cycle, or along `path` in the form of `path_of`;
    patch None for [normal]."""
    begin, sideways, more = perf_counter(), lateral_corners(scene) is not None, {}
    if sideways:
        from .two_directions import refuse, run_plane

        refuse(scene)
    scene = acting(scene)
    time, slide, first, omega = path_of(scene, steps) if path is None else path
    if varies(scene):
        start = time[first]
        time, slide = refined(scene, time, slide, steps)
        first = int(np.searchsorted(time, start))
    if sideways:
        out, more = run_plane(scene, patch, time, slide, frames)
    elif scene.contact is not None and scene.contact.gives_way:
        out = _with_shear(scene, patch, time, slide, frames, say)
    else:
        out = _rigid(scene, patch, time, slide, frames)
    force, load, slip, ledger, at, tau, local = out
    values = _values(scene, time, slide, force, load, slip, ledger, first, omega)
    span = time[-1]  # endless where a slide is endlessly slow
    rate = np.gradient(slide, time / span) / span if time.size > 2 else np.zeros(time.size)
    return BenchRun(time, slide, rate, force, load, slip, ledger, at, tau, local, values, perf_counter() - begin,
                    **more)


def _values(scene, time, slide, force, load, slip, ledger, first, omega) -> dict:
    # over the load that is applied: what slides off the pressure is friction lost
    applied = load if varies(scene) else np.full_like(load, load[0])
    ratio = np.divide(force, applied, out=np.zeros_like(force), where=applied > 1e-3 * applied.max(initial=0.0))
    work, stored, dissipated, created = ledger
    power = np.abs(np.diff(work)).sum()
    miss = abs(work[-1] - (stored[-1] - stored[0]) - dissipated[-1] + created[-1])
    out = {"normal_load": float(scene.normal.load if varies(scene) else load[0]),
           "friction_force_peak": float(np.abs(force).max()),
           "friction_ratio_end": float(ratio[-1]), "friction_ratio_peak": float(np.abs(ratio).max()),
           "slip_amplitude": float(slip[first:].max() - slip[first:].min()) / 2,
           "energy_balance": float(miss / (power + np.abs(stored).max())) if power > 0 else 0.0,
           **ledger_measures(ledger)}
    if omega:
        t, q, f = time[first:], slide[first:], force[first:]
        weight = np.zeros(t.size)
        weight[1:] += np.diff(t) / 2
        weight[:-1] += np.diff(t) / 2
        means = np.divide(np.diff(work[first:]), np.diff(q), out=(f[1:] + f[:-1]) / 2, where=np.diff(q) != 0)
        out |= interface_loop(q, harmonic(t, weight, q - q.mean(), omega), step_harmonic(t, means, omega),
                              work[-1] - work[first], 0.0)
        out["drift_per_cycle"] = float(q[-1] - q[0])
    return out


def _new_pace(time) -> np.ndarray:
    """Samples where the length of the time step changes."""
    step = np.diff(time)
    return 1 + np.flatnonzero(np.abs(np.diff(step)) > 1e-6 * np.minimum(step[1:], step[:-1]))


def _rigid(scene, patch, time, slide, frames):
    """Every point follows the slide; the pressure rides on the upper piece or stays on the lower one."""
    law = law_for(scene, patch)
    if patch is None:
        weight, at_rest, lower, x = np.ones(1), np.array([scene.normal.load]), False, np.zeros(1)
    else:
        from ...model.gap import shape_side

        x, weight, at_rest = patch.x, patch.pieces.interface.weight, patch.pressure.sigma_n
        lower = shape_side(scene.contact) == "lower"
    _refuse_costly(scene, law, time.size, weight.size, slide)

    def pressure(q):
        return np.interp(x + q, x, at_rest, left=0.0, right=0.0) if lower else at_rest

    changes = varies(scene)
    loads = load_at(scene, time) if changes else None
    s0 = loads[:1] if changes else pressure(slide[0])
    state = law.start(s0)
    force, load, slip, work, stored = (np.zeros(time.size) for _ in range(5))
    losses = np.zeros((time.size, 2))
    pick = set(_frame_numbers(time.size, frames).tolist())
    tau, local = [], []
    length = (scene.friction.bond_length or 0.0) if scene.friction.law != "convolution" else 0.0
    static = scene.friction.static
    peaks = _ends_of_rest(slide) if scene.friction.law == "coulomb" and scene.friction.kinetic < static else {}
    for k in range(time.size):
        if k:
            dq, dt = slide[k] - slide[k - 1], time[k] - time[k - 1]
            if changes:
                s1 = loads[k:k + 1]
                mean, lost, state = _under_load(law, state, dq, s0, s1, dt)
            else:
                s1 = pressure(slide[k])
                mean, lost, state = law.step(state, dq, s0, s1, dt)
            s0, losses[k] = s1, _split(weight * lost)
            work[k] = work[k - 1] + weight @ mean * dq
        here = law.traction(state)
        if k in peaks:
            here = law.breaking(s0, peaks[k])
        force[k], load[k], stored[k] = weight @ here, weight @ s0, weight @ law.stored(state)
        elastic = length * force[k] / (static * load[k]) if static * load[k] > 0 else 0.0
        slip[k] = slide[k] - min(max(elastic, -length), length)
        if k in pick:
            tau.append(here)
            limit = static * s0
            local.append(slide[k] - length * np.divide(here, limit, out=np.zeros_like(here), where=limit > 0))
    return (force, load, slip, ledger_of(work, stored, losses), np.array(sorted(pick)), np.array(tau),
            np.array(local))


def _ends_of_rest(slide) -> dict:
    """Sample -> sign of the motion that starts there: the first sample of a slide and the last of every rest."""
    moves = np.sign(np.diff(slide))
    ends = np.flatnonzero((moves != 0) & np.append(True, moves[:-1] == 0))
    return {int(k): float(moves[k]) for k in ends}


def _under_load(law, state, dq: float, s0, s1, dt: float) -> tuple:
    """One step while the load goes from s0 to s1: half of its change before the motion, half after (order 1 where
    bonds are let go, else 2). A law without stretch takes the change along with the motion."""
    if dq != 0 and getattr(law, "at_once", False):
        return law.step(state, dq, s0, s1, dt)
    half = (s0 + s1) / 2
    before = law.press(state, s0, half)
    step = law.step(before.state, dq, half, half, dt)
    after = law.press(step.state, half, s1)
    return step.mean, before.dissipated + step.dissipated + after.dissipated, after.state


def _with_shear(scene, patch, time, slide, frames, say):
    from ...model.gap import shape_side

    if shape_side(scene.contact) == "lower":
        raise PatchfemError(f"{scene.path}: {scene.contact.gives_way} with the pressure on the lower piece: not "
                            "yet built; put the shapes on the upper piece")
    if scene.friction.law == "nonlocal":
        return _points(scene, patch, time, slide, frames, say)
    return _elements(scene, patch, time, slide, frames)


def _elements(scene, patch, time, slide, frames):
    """Coulomb and elastic-plastic points behind the pieces' shear: the exact set of parallel elements."""
    from ...slip.shear_modes import jenkins_set

    f = scene.friction
    per_node = patch.pressure.sigma_n * patch.pieces.interface.weight
    if f.law == "coulomb" and f.kinetic < f.static:
        raise PatchfemError(f"{scene.path}: friction.kinetic below static with {scene.contact.gives_way}: not yet "
                            "built")
    found = jenkins_set(patch.giving, f.static * per_node,
                        f.bond_length if f.law == "elastic-plastic" else 0.0)
    k, limit = found.stiffness, found.yield_slide
    stretch = np.zeros(k.size)
    force, slip, work, stored = (np.zeros(time.size) for _ in range(4))
    losses = np.zeros((time.size, 2))
    pick = set(_frame_numbers(time.size, frames).tolist())
    states = []
    for i in range(time.size):
        if i:
            dq = slide[i] - slide[i - 1]
            end = np.clip(stretch + dq, -limit, limit)
            part = np.divide(end - stretch, dq, out=np.ones(k.size), where=dq != 0)
            work[i] = work[i - 1] + k @ (part * (stretch + end) / 2 + (1 - part) * end) * dq
            losses[i, 1] = k @ (np.abs(end) * np.abs(stretch + dq - end))
            stretch = end
        force[i], stored[i] = k @ stretch, k @ stretch**2 / 2
        slip[i] = slide[i] - (k * limit) @ stretch / (k @ limit)
        if i in pick:
            states.append((slide[i], stretch))
    tau, local = element_fields(patch, found, states, f.bond_length if f.law == "elastic-plastic" else 0.0)
    load = np.full(time.size, patch.pressure.load)
    return force, load, slip, ledger_of(work, stored, losses), np.array(sorted(pick)), tau, local


def _points(scene, patch, time, slide, frames, say):
    """Bond points behind the shear modes of the pieces, by the compiled hub along the given slide."""
    from ...compiled import load_kernels
    from ...dynamics.march.march import GOAL
    from ...dynamics.march.models import points_model
    from ..patch.press import shear_of

    law = bonds_of(scene)
    if law.reading != "stretch" or law.order != 1:
        raise PatchfemError(f"{scene.path}: {scene.contact.gives_way} with order = {law.order:g}: not yet built; "
                            "use order = 1")
    weight, sigma = patch.pieces.interface.weight, patch.pressure.sigma_n
    shear = shear_of(patch, law, scene.accuracy.shear_modes, scene.accuracy.tolerance)
    model = points_model(law, weight, sigma, shear)
    hub = load_kernels(say)
    contact, work_arrays = model.build(hub)
    at = _frame_numbers(time.size, frames)
    edges = np.unique(np.concatenate([[0], at, _new_pace(time), [time.size - 1]]))
    forces, burnt = np.zeros((time.size, 3)), np.zeros((time.size, 2))
    states, bad = [], 0
    for a, b in pairwise(edges):
        bad += hub.follow_path(slide[a:b + 1].copy(), float(time[b] - time[a]) / float(b - a), model.kind, contact,
                               work_arrays, GOAL * model.limit, burnt[a:b + 1], forces[a:b + 1])
        if b in at:
            states.append((slide[b], contact.bonds.copy()))
    if bad:
        from ...core import NotConverged

        raise NotConverged(f"{scene.path}: {bad} steps of the bench missed the force residual; raise "
                           "accuracy.steps_per_cycle")
    work = np.concatenate([[0.0], np.cumsum(forces[:-1, 1] * np.diff(slide))])
    tau, local = point_fields(patch, law, shear, states)
    load = np.full(time.size, patch.pressure.load)
    losses = np.zeros((time.size, 2))
    losses[1:, 1] = burnt[:-1, 0]
    return forces[:, 0], load, forces[:, 2], ledger_of(work, burnt[:, 1], losses), at, tau, local
