"""The law bench: a prescribed slide in, the loop out; over one point or over a patch, with or without its shear."""

from dataclasses import dataclass
from itertools import pairwise
from time import perf_counter

import numpy as np

from .core import Missing, PatchfemError
from .friction.law import Bonds
from .response.measures import harmonic, interface_loop, step_harmonic
from .simulate_slide import path_of, peak_speed

MOST_WORK = 2e11  # strip-point products of a direct quadrature beyond which a bench is refused


@dataclass(frozen=True, eq=False, slots=True)
class BenchRun:
    """One pass over the path. time, slide, force, load, slip: (k,); work: (k,) running friction work [J]; tau, local:
    frames (f, m) of traction [Pa] and local slip [m] at samples `frames`; values by measure name."""

    time: np.ndarray
    slide: np.ndarray
    rate: np.ndarray
    force: np.ndarray
    load: np.ndarray
    slip: np.ndarray
    frames: np.ndarray
    tau: np.ndarray
    local: np.ndarray
    values: dict
    seconds: float


def law_for(scene):
    """The NumPy law object of a bench."""
    from .friction.local import Coulomb, ElasticPlastic, Rate
    from .friction.quadrature import Quadrature
    from .friction.recursion import Recursion

    f = scene.friction
    if f.law == "coulomb":
        return Coulomb(f.kinetic)
    if f.law == "elastic-plastic":
        return ElasticPlastic(f.static, f.bond_length)
    if f.law == "tanh":
        return Rate(f.static, f.reference_speed)
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
    f = scene.friction
    ratio = f.kinetic / f.static if f.static > 0 else 1.0
    return Bonds(f.static, f.bond_length, f.order, f.reading, ratio, f.rest_growth, f.slip_growth,
                 f.rest_speed or 1e-3 * peak_speed(scene), f.initial_bonds)


def run(scene, patch, steps: int, frames: int = 0, say=None) -> BenchRun:
    """Slide the interface of a scene along its path with `steps` per cycle; patch None for [normal]."""
    begin = perf_counter()
    time, slide, first, omega = path_of(scene, steps)
    if scene.contact is not None and scene.contact.gives_way:
        out = _with_shear(scene, patch, time, slide, frames, say)
    else:
        out = _rigid(scene, patch, time, slide, frames)
    force, load, slip, work, stored, burnt, at, tau, local = out
    values = _values(scene, time, slide, force, load, slip, work, stored, burnt, first, omega)
    rate = np.gradient(slide, time) if time.size > 2 else np.zeros(time.size)
    return BenchRun(time, slide, rate, force, load, slip, at, tau, local, values, perf_counter() - begin)


def _values(scene, time, slide, force, load, slip, work, stored, burnt, first, omega) -> dict:
    ratio = force / load[0] if load[0] > 0 else np.zeros_like(force)  # over the load that is applied
    power = np.abs(np.diff(work)).sum()
    miss = abs(work[-1] - (stored[-1] - stored[0]) - burnt)
    out = {"normal_load": float(load[0]), "friction_force_peak": float(np.abs(force).max()),
           "friction_ratio_end": float(ratio[-1]), "friction_ratio_peak": float(np.abs(ratio).max()),
           "slip_amplitude": float(slip[first:].max() - slip[first:].min()) / 2,
           "energy_balance": float(miss / (power + np.abs(stored).max())) if power > 0 else 0.0}
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
    law = law_for(scene)
    if patch is None:
        weight, at_rest, lower, x = np.ones(1), np.array([scene.normal.load]), False, np.zeros(1)
    else:
        from .simulate_plan import shape_side

        x, weight, at_rest = patch.x, patch.pieces.interface.weight, patch.pressure.sigma_n
        lower = shape_side(scene.contact) == "lower"
    _refuse_costly(scene, law, time.size, weight.size, slide)

    def pressure(q):
        return np.interp(x + q, x, at_rest, left=0.0, right=0.0) if lower else at_rest

    state, s0 = law.start(pressure(slide[0])), pressure(slide[0])
    force, load, slip, work, stored = (np.zeros(time.size) for _ in range(5))
    pick = set(_frame_numbers(time.size, frames).tolist())
    tau, local, burnt = [], [], 0.0
    length = scene.friction.bond_length or 0.0
    static = scene.friction.static
    for k in range(time.size):
        if k:
            s1 = pressure(slide[k])
            step = law.step(state, slide[k] - slide[k - 1], s0, s1, time[k] - time[k - 1])
            state, s0 = step.state, s1
            work[k] = work[k - 1] + weight @ step.mean * (slide[k] - slide[k - 1])
            burnt += weight @ step.dissipated
        here = law.traction(state)
        force[k], load[k], stored[k] = weight @ here, weight @ s0, weight @ law.stored(state)
        elastic = length * force[k] / (static * load[k]) if static * load[k] > 0 else 0.0
        slip[k] = slide[k] - elastic
        if k in pick:
            tau.append(here)
            limit = static * s0
            local.append(slide[k] - length * np.divide(here, limit, out=np.zeros_like(here), where=limit > 0))
    return force, load, slip, work, stored, burnt, np.array(sorted(pick)), np.array(tau), np.array(local)


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
    pick = set(_frame_numbers(time.size, frames).tolist())
    states, burnt = [], 0.0
    for i in range(time.size):
        if i:
            dq = slide[i] - slide[i - 1]
            end = np.clip(stretch + dq, -limit, limit)
            part = np.divide(end - stretch, dq, out=np.ones(k.size), where=dq != 0)
            work[i] = work[i - 1] + k @ (part * (stretch + end) / 2 + (1 - part) * end) * dq
            burnt += float(k @ (np.abs(end) * np.abs(stretch + dq - end)))
            stretch = end
        force[i], stored[i] = k @ stretch, k @ stretch**2 / 2
        slip[i] = slide[i] - (k * limit) @ stretch / (k @ limit)
        if i in pick:
            states.append((slide[i], stretch))
    tau, local = element_fields(patch, found, states, f.bond_length if f.law == "elastic-plastic" else 0.0)
    load = np.full(time.size, patch.pressure.load)
    return force, load, slip, work, stored, burnt, np.array(sorted(pick)), tau, local


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
    return (forces[:, 0], load, forces[:, 2], work, burnt[:, 1], float(burnt[:-1, 0].sum()), at, tau, local)
