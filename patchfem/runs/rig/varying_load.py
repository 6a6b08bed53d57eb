"""A scene whose contact pushes and turns the modes as well as it rubs, or whose load is prescribed in time."""

import numpy as np

from ...dynamics.march import varying_load as march
from ...model.model import Model


def rubbing_of(model: Model):
    """The dynamics.march.varying_load.Rubbing of the law of a model."""
    f = model.friction
    if f.law == "coulomb":
        return march.coulomb(f.static, f.kinetic)
    if f.law == "tanh":
        return march.rate(f.static, f.reference_speed)
    if f.law == "elastic-plastic":
        return march.plastic(f.static, f.bond_length)
    return march.bonds(model.bonds)


def model_of(model: Model, patch, count: int | None = None):
    """The VaryingLoadModel of a rig whose load changes; patch: the solved Patch or None under [normal]; count: how many
    shear modes stand for pieces that give way, None: by the tolerance."""
    load, sets = (model.point.at, None) if patch is None else (None, march.sets_of(patch, model.patch.spring))
    law, shear = rubbing_of(model), None
    if model.soft:
        weight = patch.pieces.interface.weight
        shear = march.shear_of(patch.giving, law, patch.pressure.sigma_n * weight, weight, count,
                                model.accuracy.tolerance)
    return march.model_of(model.rig.modes, law, sets, load, shear)


def frames_of(model: Model, patch, raw) -> dict:
    """Interface frames (f, x) of a run, the pressed state first; status 0 open, 1 stick, 2 slip."""
    law, sets, weight = raw.contact.law, raw.contact.sets, patch.pieces.interface.weight
    shots = raw.snapshots
    time, slide = (np.array([0.0] + [shot[key] for shot in shots]) for key in ("time", "slide"))
    nodal = np.stack([patch.pressure.sigma_n * weight] + [shot["nodal"] for shot in shots])
    lift = np.array([0.0] + [shot["heave"] for shot in shots])[:, None]
    turn = np.array([0.0] + [shot["turn"] for shot in shots])[:, None]
    gap = np.maximum(sets.opening + lift + turn * sets.x + nodal @ sets.c, 0.0)
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
    top, bottom, _ = shot["memory"]
    if law.kind == march.PLASTIC:
        return law.static * top, law.length * np.divide(top, bottom, out=np.zeros_like(top), where=bottom > 0)
    if law.kind == march.POINTS:
        return law.static / law.length * bottom, np.divide(bottom, top, out=np.zeros_like(top), where=top > 0)
    total = nodal.sum()
    return (shot["force"] / total * nodal if total > 0 else 0 * nodal), np.zeros_like(nodal)
