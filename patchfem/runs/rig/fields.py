"""Frames of the interface in the last cycle of a coupled run.

In: the Solution of a run with its snapshots, and the pressed patch. Out: pressure, gap, shear
stress and slip at the nodes of the interface by name.
"""

import numpy as np

from ...dynamics.march import varying_load
from ...effects import law_has_trait, needs_bond_list
from ...friction import record
from ...slip import fields
from ..bench import averaged_law
from ..bench import shear as bench_shear
from ..results.result import (
    N_FRAMES,
    SlipRule,
    collect_rest_frame,
    compute_status,
    make_interface_frames,
)


def collect_frames(model, numerics, patch, raw) -> dict:
    """Collect the fields of an interface in the frames of the last cycle.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    patch : Patch
    raw : Solution
    """
    sigma = patch.pressure.sigma_n
    f = model.friction
    # strips that slide independently have no common shear stress
    if model.patch.mesh.can_gather_points or (model.partial_slip and patch.strips is not None):
        return collect_rest_frame(patch)
    if model.rig.friction.load_varies:
        return _collect_varying_load_frames(patch, raw)
    if not raw.snapshots:
        at = (
            np.linspace(
                max(0, len(raw.window.time) - 1 - len(raw.window.time) // numerics.window),
                len(raw.window.time) - 1,
                N_FRAMES,
            )
            .round()
            .astype(int)
        )
        tau = np.outer(raw.window.force[at] / patch.pressure.load, sigma)
        if f is not None and law_has_trait(f.law, "averaged"):
            tau = averaged_law.distribute_slip_force(model, patch, raw.window.force[at])
        slip = np.repeat(raw.window.slip[at][:, None], sigma.size, axis=1)
        return make_interface_frames(patch, raw.window.time[at], tau, slip, raw.window.slide[at])

    shots = raw.snapshots
    if model.partial_slip and model.grooves is not None:
        tau, local = bench_shear.compute_groove_fields(
            patch, raw.contact, [(s["slide"], s["nodes"]) for s in shots]
        )
        return make_interface_frames(
            patch,
            np.array([s["time"] for s in shots]),
            tau,
            local,
            np.array([s["slide"] for s in shots]),
        )
    time = np.array([s["time"] for s in shots])
    shear = bool(model.partial_slip)
    rule = SlipRule()
    pointed = numerics.per_point and model.grooves is None and not needs_bond_list(f)
    if law_has_trait(f.law, "bonds") and (shear or pointed):
        moments = [(s["slide"], s["bonds"]) for s in shots]
        tau, local = fields.point_fields(patch, model.bonds, raw.contact.reduction, moments)
    elif shear:
        length = 0.0 if raw.contact.reduction is None else record.make_law(f).element(1.0).length
        states = [(s["slide"], s["stretch"]) for s in shots]
        tau, local = fields.element_fields(patch, raw.contact.reduction, states, length)
        rule = SlipRule(f.static * sigma)
    else:
        tau = np.array([s["force"] / patch.pressure.load * sigma for s in shots])
        local = np.array([np.full(sigma.size, s["slip"]) for s in shots])
    slide = np.array([s["slide"] for s in shots])
    return make_interface_frames(patch, time, tau, local, slide, rule)


def _collect_varying_load_frames(patch, raw) -> dict:
    """Collect the interface fields of a run with varying normal load in the frames of a cycle.

    The first frame is the pressed state.
    """
    law = raw.contact.law
    sets = raw.contact.sets
    weight = patch.pieces.interface.weight
    shots = raw.snapshots
    time, slide = (np.array([0.0] + [shot[key] for shot in shots]) for key in ("time", "slide"))
    nodal = np.stack([patch.pressure.sigma_n * weight] + [shot["nodal"] for shot in shots])
    lift = np.array([0.0] + [shot["heave"] for shot in shots])[:, None]
    turn = np.array([0.0] + [shot["turn"] for shot in shots])[:, None]
    gap = np.maximum(sets.opening + lift + turn * sets.x + nodal @ sets.c, 0.0)
    gap[nodal > 0] = 0.0
    gap[0] = patch.pressure.gap
    tau = np.zeros_like(nodal)
    local = np.zeros_like(nodal)
    for k, shot in enumerate(shots, 1):
        tau[k], stretch = _compute_nodal_friction(law, shot, nodal[k])
        local[k] = slide[k] - stretch - shot["bend"]
    return {
        "time": time,
        "normal_stress": nodal / weight,
        "gap": gap,
        "shear_stress": tau / weight,
        "slip": local,
        "status": compute_status(nodal > 0, tau, local),
        "holder_slide": slide,
    }


def _compute_nodal_friction(law, shot, nodal) -> tuple:
    """Return friction forces (m,) [N] and elastic stretches (m,) [m] at the interface nodes."""
    top, bottom, _ = shot["memory"]
    if law.kind == varying_load.LawKind.PLASTIC:
        return law.static * top, law.length * np.divide(
            top, bottom, out=np.zeros_like(top), where=bottom > 0
        )
    if law.kind == varying_load.LawKind.POINTS:
        return law.static / law.length * bottom, np.divide(
            bottom, top, out=np.zeros_like(top), where=top > 0
        )
    total = nodal.sum()
    return (shot["force"] / total * nodal if total > 0 else 0 * nodal), np.zeros_like(nodal)
