"""A scene whose contact acts on the modes with its whole wrench, or whose load is prescribed in time."""


import numpy as np

from ...core import ModalBasis, PatchfemError
from ...model.law import acting
from ...model.load import load_at


def rubbing_of(scene, speed: float):
    """The dynamics.march.varying_load.Rubbing of [friction]; `speed` [m/s] as in `runs.rig.march.law_of`."""
    from ...dynamics.march import varying_load as wrench
    from ...model.law import law_of

    f = acting(scene).friction
    if f.law == "coulomb":
        return wrench.coulomb(f.static, f.kinetic)
    if f.law == "tanh":
        return wrench.rate(f.static, f.reference_speed)
    if f.law == "elastic-plastic":
        return wrench.plastic(f.static, f.bond_length)
    if f.law != "nonlocal":
        raise PatchfemError(f"{scene.path}: friction.law: '{f.law}' under a load that changes: not yet built")
    return wrench.bonds(law_of(scene, speed))


def atlas_of(scene, patch):
    """The atlas of the patch of a scene, None under [normal]."""
    if patch is None:
        return None
    from ...dynamics.march import varying_load as wrench
    from ...model.load import spring_of

    return wrench.atlas_of(patch, spring_of(scene.contact))


def model_of(scene, modes: ModalBasis, patch, speed: float, count: int | None = None):
    """The WrenchModel of a rig whose load changes; patch: the solved Patch or None for [normal]; count:
    how many shear modes stand for pieces that give way, None: by the tolerance."""
    from ...dynamics.march import varying_load as wrench

    load = None if patch is not None else lambda t: load_at(scene, t)
    law, shear = rubbing_of(scene, speed), None
    if scene.contact is not None and scene.contact.gives_way:
        weight = patch.pieces.interface.weight
        shear = wrench.shear_of(patch.giving, law, patch.pressure.sigma_n * weight, weight, count,
                                scene.accuracy.tolerance)
    return wrench.wrench_model(modes, law, atlas_of(scene, patch), load, shear)


def shear_note(scene, model) -> list:
    """The sentence on the shear modes of a run whose load changes; empty where none stand for the pieces."""
    if model is None or model.reduction is None:
        return []
    kept, nodes = model.reduction.stiffness.size, model.atlas.x.size
    return [f"{scene.contact.gives_way}: the load changes with the motion, so no exact set of elements exists; {kept} "
            f"tangential modes of {nodes} nodes stand for what gives way (accuracy.shear_modes)"]


def frames_of(scene, patch, raw) -> dict:
    """Interface frames (f, x) of a run, the pressed state first; status 0 open, 1 stick, 2 slip."""
    law, atlas, weight = raw.model.law, raw.model.atlas, patch.pieces.interface.weight
    shots = raw.snapshots
    time, slide = (np.array([0.0] + [shot[key] for shot in shots]) for key in ("time", "slide"))
    nodal = np.stack([patch.pressure.sigma_n * weight] + [shot["nodal"] for shot in shots])
    lift = np.array([0.0] + [shot["heave"] for shot in shots])[:, None]
    turn = np.array([0.0] + [shot["turn"] for shot in shots])[:, None]
    gap = np.maximum(atlas.opening + lift + turn * atlas.x + nodal @ atlas.c, 0.0)
    gap[nodal > 0] = 0.0
    gap[0] = patch.pressure.gap
    tau, local = np.zeros_like(nodal), np.zeros_like(nodal)
    for k, shot in enumerate(shots, 1):
        tau[k], stretch = _shear(law, shot, nodal[k])
        local[k] = slide[k] - stretch - shot["bend"]
    moved = np.abs(np.diff(local, axis=0, prepend=local[:1]))
    moved[:2] = 0.0  # the first moving frame has no frame before it to slip from
    status = np.where(nodal > 0, np.where(moved > 1e-2 * max(moved.max(), 1e-300), 2, 1), 0).astype(np.int8)
    return {"time": time, "normal_stress": nodal / weight, "gap": gap, "shear_stress": tau / weight, "slip": local,
            "status": status, "holder_slide": slide}


def _shear(law, shot, nodal) -> tuple:
    """(friction forces (m,) [N], stretches (m,) [m]) of the nodes in a snapshot."""
    from ...dynamics.march import varying_load as wrench

    top, bottom, _ = shot["memory"]
    if law.kind == wrench.PLASTIC:
        return law.static * top, law.length * np.divide(top, bottom, out=np.zeros_like(top), where=bottom > 0)
    if law.kind == wrench.POINTS:
        return law.static / law.length * bottom, np.divide(bottom, top, out=np.zeros_like(top), where=top > 0)
    total = nodal.sum()
    return (shot["force"] / total * nodal if total > 0 else 0 * nodal), np.zeros_like(nodal)
