"""Fields of the interface during the last cycle of a run of a rig.

In: the Solution with its snapshots, and the Patch. Out: pressure, gap, shear stress and slip at the
interface nodes by name.
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


def collect_interface_fields(model, numerics, patch, solution) -> dict:
    """Collect the fields of the interface at the output frames of the last cycle.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    patch : Patch
    solution : Solution
    """
    sigma = patch.pressure.sigma_n
    f = model.friction
    window = solution.window
    # Strips that slide independently have no common shear stress.
    if model.patch.mesh.can_gather_points or (model.partial_slip and patch.strips is not None):
        return collect_rest_frame(patch)
    if model.rig.friction.load_varies:
        return _collect_varying_load_fields(patch, solution)
    if not solution.snapshots:
        n_samples = len(window.time)
        first = max(0, n_samples - 1 - n_samples // numerics.window)
        at = np.linspace(first, n_samples - 1, N_FRAMES).round().astype(int)
        tau = np.outer(window.force[at] / patch.pressure.load, sigma)
        if f is not None and law_has_trait(f.law, "averaged"):
            tau = averaged_law.distribute_slip_force(model, patch, window.force[at])
        slip = np.repeat(window.slip[at][:, None], sigma.size, axis=1)
        return make_interface_frames(patch, window.time[at], tau, slip, window.slide[at])

    snapshots = solution.snapshots
    if model.partial_slip and model.grooves is not None:
        tau, local = bench_shear.compute_groove_fields(
            patch, solution.contact, [(s["slide"], s["nodes"]) for s in snapshots]
        )
        return make_interface_frames(
            patch,
            np.array([s["time"] for s in snapshots]),
            tau,
            local,
            np.array([s["slide"] for s in snapshots]),
        )
    time = np.array([s["time"] for s in snapshots])
    shear = bool(model.partial_slip)
    rule = SlipRule()
    has_node_bonds = numerics.per_point and model.grooves is None and not needs_bond_list(f)
    if law_has_trait(f.law, "bonds") and (shear or has_node_bonds):
        moments = [(s["slide"], s["bonds"]) for s in snapshots]
        tau, local = fields.point_fields(patch, model.bonds, solution.contact.reduction, moments)
    elif shear:
        length = (
            0.0 if solution.contact.reduction is None else record.make_law(f).element(1.0).length
        )
        states = [(s["slide"], s["stretch"]) for s in snapshots]
        tau, local = fields.element_fields(patch, solution.contact.reduction, states, length)
        rule = SlipRule(f.static * sigma)
    else:
        tau = np.array([s["force"] / patch.pressure.load * sigma for s in snapshots])
        local = np.array([np.full(sigma.size, s["slip"]) for s in snapshots])
    slide = np.array([s["slide"] for s in snapshots])
    return make_interface_frames(patch, time, tau, local, slide, rule)


def _collect_varying_load_fields(patch, solution) -> dict:
    """Collect the fields of an interface under varying normal load at the output frames.

    The first frame is the initial state. The status is 0 for open, 1 for stick and 2 for slip.
    """
    law = solution.contact.law
    sets = solution.contact.sets
    weight = patch.pieces.interface.weight
    snapshots = solution.snapshots
    time = np.array([0.0] + [state["time"] for state in snapshots])
    slide = np.array([0.0] + [state["slide"] for state in snapshots])
    nodal = np.stack([patch.pressure.sigma_n * weight] + [state["nodal"] for state in snapshots])
    lift = np.array([0.0] + [state["heave"] for state in snapshots])[:, None]
    turn = np.array([0.0] + [state["turn"] for state in snapshots])[:, None]
    gap = np.maximum(sets.opening + lift + turn * sets.x + nodal @ sets.c, 0.0)
    gap[nodal > 0] = 0.0
    gap[0] = patch.pressure.gap
    tau = np.zeros_like(nodal)
    local = np.zeros_like(nodal)
    for k, state in enumerate(snapshots, 1):
        tau[k], stretch = _compute_nodal_friction(law, state, nodal[k])
        local[k] = slide[k] - stretch - state["bend"]
    return {
        "time": time,
        "normal_stress": nodal / weight,
        "gap": gap,
        "shear_stress": tau / weight,
        "slip": local,
        "status": compute_status(nodal > 0, tau, local),
        "holder_slide": slide,
    }


def _compute_nodal_friction(law, snapshot, nodal) -> tuple:
    """Return friction forces (m,) [N] and elastic stretches (m,) [m] at the interface nodes."""
    top, bottom, _ = snapshot["memory"]
    if law.kind == varying_load.LawKind.PLASTIC:
        return law.static * top, law.length * np.divide(
            top, bottom, out=np.zeros_like(top), where=bottom > 0
        )
    if law.kind == varying_load.LawKind.POINTS:
        return law.static / law.length * bottom, np.divide(
            bottom, top, out=np.zeros_like(top), where=top > 0
        )
    total = nodal.sum()
    return (snapshot["force"] / total * nodal if total > 0 else 0 * nodal), np.zeros_like(nodal)
