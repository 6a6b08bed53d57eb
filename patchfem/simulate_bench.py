"""The law bench: a prescribed slide in, the loop out; over one point or over a patch, with or without its shear."""

from dataclasses import dataclass
from itertools import pairwise
from time import perf_counter

import numpy as np

from .core import Missing, PatchfemError
from .friction.law import Bonds
from .response.measures import harmonic, interface_loop, ledger_measures, step_harmonic
from .simulate_acting import acting
from .simulate_load import load_at, refined, varies
from .simulate_slide import lateral_corners, path_of, peak_speed

MOST_WORK = 2e11  # strip-point products of a direct quadrature beyond which a bench is refused


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


def law_for(scene, patch=None):
    """The NumPy law object of a bench; only an averaged law looks at the patch."""
    from .friction.local import Coulomb, ElasticPlastic, Rate
    from .friction.quadrature import Quadrature
    from .friction.recursion import Recursion

    f = scene.friction
    if f.law == "coulomb":
        return Coulomb(f.kinetic, f.static)
    if f.law == "elastic-plastic":
        return ElasticPlastic(f.static, f.bond_length)
    if f.law == "tanh":
        return Rate(f.static, f.reference_speed)
    if f.law == "convolution":
        from .simulate_convolution import law_on

        return law_on(scene, patch)
    law = bonds_of(scene)
    engine = scene.accuracy.quadrature
    if engine == "recursion" or (engine == "auto" and law.reading == "stretch" and law.order == 1):
        return Recursion(law)
    if engine == "direct":
        return Quadrature(law, 0.0)
    tail = scene.accuracy.tail if scene.accuracy.tail is not None else 1e-3 * scene.accuracy.tolerance
    return Quadrature(law, tail)


def bonds_of(scene) -> Bonds:
    """Bond parameters of a bench scene; v_h defaults to 1e-3 of the peak speed."""
    f = acting(scene).friction
    ratio = f.kinetic / f.static if f.static > 0 else 1.0
    return Bonds(f.static, f.bond_length, f.order, f.reading, ratio, f.rest_growth, f.slip_growth,
                 f.rest_speed or 1e-3 * peak_speed(scene), f.initial_bonds, f.breakaway)


def run(scene, patch, steps: int, frames: int = 0, say=None, path=None) -> BenchRun:
    """Slide the interface of a scene along its path with `steps` per cycle, or along `path` in the form of `path_of`;
    patch None for [normal]."""
    begin, sideways, more = perf_counter(), lateral_corners(scene) is not None, {}
    if sideways:
        from .simulate_plane import refuse, run_plane

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


def ledger_of(work, stored, losses) -> np.ndarray:
    """(4, k): work, stored, dissipated and created energy [J] of samples, from the (gain, loss) (k, 2) [J] of every
    step over the points that create energy and those that lose it."""
    created, dissipated = np.cumsum(losses, axis=0).T
    created = created if created[-1] > 1e-13 * dissipated[-1] else 0 * created  # round-off
    return np.stack([work, stored, dissipated, created])


def _split(losses) -> tuple:
    """(created, dissipated) of the energy that places lose, some of it below zero."""
    return -np.minimum(losses, 0.0).sum(), np.maximum(losses, 0.0).sum()


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


def _frame_numbers(count: int, frames: int) -> np.ndarray:
    """Samples of the frames; the first sample is the pressed state, which is a frame of its own."""
    at = np.linspace(0, count - 1, frames + 1).round().astype(int)[1:]
    return np.unique(at[at > 0]) if frames else np.zeros(0, int)


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
        from .simulate_plan import shape_side

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


def _refuse_costly(scene, law, samples: int, points: int, slide) -> None:
    if not hasattr(law, "weights"):
        return
    reach = 25 * scene.friction.bond_length
    per_step = max(float(np.abs(np.diff(slide)).mean()), 1e-300)
    strips = min(samples, 2 * reach / per_step + 64)
    if 6 * strips * samples * points > MOST_WORK:
        raise Missing(f"{scene.path}: the direct quadrature would form {6 * strips * samples * points:.1e} products, "
                      f"more than {MOST_WORK:.0e}; lower accuracy.steps_per_cycle or slide.cycles")


def _with_shear(scene, patch, time, slide, frames, say):
    from .simulate_plan import shape_side

    if shape_side(scene.contact) == "lower":
        raise PatchfemError(f"{scene.path}: {scene.contact.gives_way} with the pressure on the lower piece: not "
                            "yet built; put the shapes on the upper piece")
    if scene.friction.law == "nonlocal":
        return _points(scene, patch, time, slide, frames, say)
    return _elements(scene, patch, time, slide, frames)


def _elements(scene, patch, time, slide, frames):
    """Coulomb and elastic-plastic points behind the pieces' shear: the exact set of parallel elements."""
    from .contact.slip import jenkins_set

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


def element_fields(patch, found, states, length: float) -> tuple:
    """(traction, irreversible local slip), both (f, m), of a Jenkins set in states [(slide, stretch), ...]."""
    m, weight = patch.x.size, patch.pieces.interface.weight
    tau, local = np.zeros((len(states), m)), np.zeros((len(states), m))
    for i, (slide, stretch) in enumerate(states):
        force = np.zeros(m)
        force[found.points] = found.share @ stretch
        tau[i] = force / weight
        local[i] = slide - patch.giving @ force
        local[i, found.points] -= length * force[found.points] / found.limit
    return tau, local


def point_fields(patch, law: Bonds, shear, states) -> tuple:
    """(traction, irreversible local slip), both (f, m), of bond points in states [(slide, bonds (4, a)), ...]."""
    m = patch.x.size
    index = np.arange(m) if shear is None else shear.points
    tau, local = np.zeros((len(states), m)), np.zeros((len(states), m))
    for i, (slide, bonds) in enumerate(states):
        tau[i, index] = law.static / law.length * bonds[1]
        local[i] = slide
        stretch = np.divide(bonds[1], bonds[0], out=np.zeros(index.size), where=bonds[0] > 0)
        local[i, index] = bonds[3] - stretch
    return tau, local


def _points(scene, patch, time, slide, frames, say):
    """Bond points behind the shear modes of the pieces, by the compiled hub along the given slide."""
    from .compiled import load_kernels
    from .simulate_march import GOAL, points_model
    from .simulate_patch import shear_of

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
        from .core import NotConverged

        raise NotConverged(f"{scene.path}: {bad} steps of the bench missed the force residual; raise "
                           "accuracy.steps_per_cycle")
    work = np.concatenate([[0.0], np.cumsum(forces[:-1, 1] * np.diff(slide))])
    tau, local = point_fields(patch, law, shear, states)
    load = np.full(time.size, patch.pressure.load)
    losses = np.zeros((time.size, 2))
    losses[1:, 1] = burnt[:-1, 0]
    return forces[:, 0], load, forces[:, 2], ledger_of(work, burnt[:, 1], losses), at, tau, local
