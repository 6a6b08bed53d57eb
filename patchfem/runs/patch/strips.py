"""Contact of a patch that is divided into strips over its width, under a holder that may roll.

In: a `PatchModel` with strips and its condensed pieces. Out: the contact of all strips, its length
and its stiffness.
"""

import numpy as np

from ...contact import edges, stiffness
from ...contact.asperity_laws import SmoothAsperities
from ...contact.strip_compliance import StripCompliance
from ...contact.strips import (
    HolderLoads,
    StripLayout,
    StripModel,
    press_strips,
    split_into_strips,
    strip_offsets,
    strips_stiffness,
)
from ...core import Compliance, ContactState, frozen_array
from .edge_values import EdgeValues
from .skin import MIN_RELATIVE_PRESSURE, cut_off_negligible_pressure, make_skin_law


def solve_strip_contact(patch_model, pieces: Compliance, gap, added=None, warm_start=None) -> tuple:
    """Solve the contact of two pieces that are divided over their width into strips.

    The strips do not interact: each one has the compliance of its fraction of the width.

    Parameters
    ----------
    patch_model : PatchModel
    pieces : Compliance
    gap : (m,) or (s, m)
        Unloaded gap [m].
    added, warm_start
        See `StripCompliance`.

    Returns
    -------
    tuple
        ContactState averaged over the width, smooth skin or None, and StripsState.
    """
    count, roll, offset = patch_model.interface.strips
    loading = patch_model.loading
    skin = None if patch_model.interface.skin is None else make_skin_law(patch_model)
    strip = split_into_strips(pieces, count)
    offsets = strip_offsets(patch_model.pieces.width, count)
    layout = StripLayout(pieces.interface.x, strip.weight, offsets)
    strips = StripModel(StripCompliance(strip.normal, added, warm_start), layout, skin)
    roll_moment = None if offset is None else loading.load * offset
    loads = HolderLoads(roll_moment=roll_moment)
    if loading.approach is None:
        loads = HolderLoads(loading.load, loading.moment, roll_moment, loading.rotational_stiffness)
    state = press_strips(
        strips, gap, loads, approach=loading.approach, rotation=patch_model.gap.angle, roll=roll
    )
    is_smooth = isinstance(skin, SmoothAsperities)
    pressure = cut_off_negligible_pressure(state.pressure) if is_smooth else state.pressure
    mean_state = ContactState(
        frozen_array(pressure.mean(axis=0)),
        frozen_array(state.gap.min(axis=0)),
        state.delta,
        state.theta,
        state.load,
        state.moment,
        state.outcome,
        state.iterations,
        state.residuals,
    )
    return mean_state, skin if is_smooth else None, state


def strips_rotational_stiffness(state, strip_compliance, x, weight) -> float:
    """Return the rotational stiffness [N m/rad] of strips with a smooth asperity layer.

    It holds at fixed approach.

    Parameters
    ----------
    state : StripsState
    strip_compliance : (m, m)
        Compliance of one strip [m/N].
    x : (m,)
        Positions [m].
    weight : (m,)
        Nodal areas of one strip [m2].
    """
    out = 0.0
    for rate in state.stiffness:
        stiff = rate * weight
        active = stiff > 1e-12 * (state.stiffness.max() * weight.max())
        if active.any():
            out += stiffness.rotational_stiffness(
                strip_compliance + np.diag(1 / np.where(active, stiff, 1.0)), x, active
            )
    return out


def compute_strip_edge_values(patch) -> EdgeValues:
    """Return the contact length and the contact stiffnesses of a patch that is divided into strips."""
    weight = patch.pair.compliance.interface.weight / len(patch.strips.offsets)
    if isinstance(patch.skin, SmoothAsperities):
        return _edge_values_with_skin(patch, weight)
    return _edge_values_between_nodes(patch, weight)


def _edge_values_with_skin(patch, weight) -> EdgeValues:
    """Return contact length and stiffnesses of strips with a smooth asperity layer."""
    state = patch.strips
    x = patch.x
    count = len(state.offsets)
    normal = patch.pair.compliance.normal * count
    tangential = patch.pair.compliance.tangential * count
    peak = state.pressure.max()
    is_loaded = state.pressure > MIN_RELATIVE_PRESSURE * peak
    intervals = []
    for pressure, nodes in zip(state.pressure, is_loaded, strict=True):
        if nodes.any():
            ends = edges.find_pressure_edges(x, pressure, MIN_RELATIVE_PRESSURE, peak)
            intervals.append(edges.contact_intervals(x, nodes, ends))
    ratio = patch.model.interface.skin.tangential_ratio
    first = min(interval[0, 0] for interval in intervals)
    last = max(interval[-1, 1] for interval in intervals)
    return EdgeValues(
        length=float(sum(np.diff(interval).sum() for interval in intervals) / count),
        width=float(last - first),
        normal=strips_stiffness(normal, weight, state),
        tangential=strips_stiffness(tangential, weight, state, np.inf if ratio is None else ratio),
        rotational=strips_rotational_stiffness(state, normal, x, weight),
    )


def _edge_values_between_nodes(patch, weight) -> EdgeValues:
    """Return contact length and stiffnesses of strips whose contact edges lie between nodes."""
    state = patch.strips
    x = patch.x
    count = len(state.offsets)
    normal = patch.pair.compliance.normal * count
    tangential = patch.pair.compliance.tangential * count
    softness = None
    if state.stiffness is not None:
        softness = 1 / (state.stiffness.max() * weight)
        normal = normal + np.diag(softness)
        ratio = patch.model.interface.skin.tangential_ratio
        if ratio is not None:
            tangential = tangential + np.diag(softness / ratio)
    unit = np.ones(x.size)
    stiffnesses = np.zeros(2)
    shear_stiffness = length = 0.0
    first = x[-1]
    last = x[0]
    for force, gap in zip(state.force, state.gap, strict=True):
        if not force.any():
            continue
        pressed = edges.SetFactor(normal, force > 0)
        ends = edges.find_edges(
            pressed, x, force, gap, softness, patch.pair.row, is_quadratic=patch.pair.is_quadratic
        )
        intervals = edges.contact_intervals(x, force, ends)
        length += np.diff(intervals).sum()
        first = min(first, intervals[0, 0])
        last = max(last, intervals[-1, 1])
        stiffnesses += edges.set_stiffness(pressed, np.stack([unit, x], axis=1), ends)
        sheared = edges.SetFactor(tangential, force > 0)
        shear_stiffness += edges.set_stiffness(sheared, unit[:, None], ends)[0]
    normal_stiffness, rotational_stiffness = map(float, stiffnesses)
    return EdgeValues(
        length=float(length / count),
        width=float(last - first),
        normal=normal_stiffness,
        tangential=float(shear_stiffness),
        rotational=rotational_stiffness,
    )
