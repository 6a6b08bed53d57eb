"""Patch in strips over its width, pressed by a holder that may roll.

In: a `PatchModel` with strips and its condensed pieces. Out: the contact of all strips, and the
measures that depend on them.
"""

import numpy as np

from ...contact import edges, stiffness
from ...contact.asperity_laws import LinearAsperities, SmoothAsperities
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
from .skin import MIN_RELATIVE_PRESSURE, cut_off_pressure, skin_law


def press_strips_of_patch(
    patch_model, pieces: Compliance, gap, held: tuple, added=None, warm_start=None
) -> tuple:
    """Solve the contact of a pair in strips.

    The Compliance is that of the pieces in full contact over the width; measures of stiffness are
    computed from the strips.

    Parameters
    ----------
    patch_model : PatchModel
    pieces : Compliance
    gap : (m,) or (s, m)
        Unloaded gap [m].
    held : tuple
        Rotation [rad], moment [N m] or None, and rotational stiffness of the holder [N m/rad].
    added, warm_start
        Parameters of `StripCompliance`.

    Returns
    -------
    tuple
        Compliance of all strips, ContactState of the means over the width, smooth skin or None, and
        StripsState.
    """
    (count, roll, offset), interface, (angle, moment, spring) = (
        patch_model.interface.strips,
        pieces.interface,
        held,
    )
    skin = make_asperities(patch_model)
    by = patch_model.loading.approach
    one = split_into_strips(pieces, count)
    layout = StripLayout(interface.x, one.weight, strip_offsets(patch_model.pieces.width, count))
    strips = StripModel(StripCompliance(one.normal, added, warm_start), layout, skin)
    roll_moment = None if offset is None else patch_model.loading.load * offset
    loads = HolderLoads(roll_moment=roll_moment)
    if by is None:
        loads = HolderLoads(patch_model.loading.load, moment, roll_moment, spring)
    state = press_strips(strips, gap, loads, approach=by, rotation=angle, roll=roll)
    mean = (
        cut_off_pressure(state.pressure) if isinstance(skin, SmoothAsperities) else state.pressure
    ).mean(axis=0)
    answer = ContactState(
        frozen_array(mean),
        frozen_array(state.gap.min(axis=0)),
        state.delta,
        state.theta,
        state.load,
        state.moment,
        state.outcome,
        state.iterations,
        state.residuals,
    )
    return pieces, answer, skin if isinstance(skin, SmoothAsperities) else None, state


def make_asperities(patch_model):
    """Return the asperity layer between the strips; None if they are bare."""
    if patch_model.interface.skin is None:
        return None
    if patch_model.interface.skin.law == "linear":
        return LinearAsperities(patch_model.interface.skin.normal_stiffness)

    return skin_law(patch_model)


def rotational_stiffness(state, c, x, weight) -> float:
    """Return the rotational stiffness [N m/rad] of strips with a smooth asperity layer.

    The approach is fixed.

    Parameters
    ----------
    state : StripsState
    c : (m, m)
        Compliance of one strip [m/N].
    x : (m,)
        Positions [m].
    weight : (m,)
        Areas of one strip [m2].
    """
    out = 0.0
    for rate in state.stiffness:
        stiff = rate * weight
        active = stiff > 1e-12 * (state.stiffness.max() * weight.max())
        if active.any():
            out += stiffness.rotational_stiffness(
                c + np.diag(1 / np.where(active, stiff, 1.0)), x, active
            )
    return out


def strip_values(patch) -> dict:
    """Return the values of the measures that depend on strips, by name.

    These are the extent of the contact, the stiffnesses, the lateral centre of pressure and the
    roll moment.
    """
    state = patch.strips
    weight = patch.pair.compliance.interface.weight / len(state.offsets)
    out = {
        "pressure_centre_lateral": state.centre_y,
        "roll_moment": state.roll_moment,
        "roll": state.roll,
    }
    if not state.load > 0:
        return out
    return out | (_behind_skin if isinstance(patch.skin, SmoothAsperities) else _between_nodes)(
        patch, weight
    )


def _behind_skin(patch, weight) -> dict:
    """Return extent of contact and stiffnesses, by name, of strips with a smooth asperity layer."""
    state = patch.strips
    pieces = patch.pair.compliance
    count = len(patch.strips.offsets)
    ratio = patch.tangential_ratio if patch.tangential_ratio is not None else np.inf
    x = patch.x
    bears = state.pressure > MIN_RELATIVE_PRESSURE * state.pressure.max()
    stretches = [
        edges.contact_intervals(
            x,
            bears[k],
            edges.find_pressure_edges(x, row, MIN_RELATIVE_PRESSURE, state.pressure.max()),
        )
        for k, row in enumerate(state.pressure)
        if bears[k].any()
    ]
    return {
        "contact_fraction": float(
            sum(np.diff(stretch).sum() for stretch in stretches) / (count * np.ptp(x))
        ),
        "contact_half_width": float(
            max(stretch[-1, 1] for stretch in stretches)
            - min(stretch[0, 0] for stretch in stretches)
        )
        / 2,
        "normal_stiffness": strips_stiffness(pieces.normal * count, weight, state),
        "rotational_stiffness": rotational_stiffness(state, pieces.normal * count, patch.x, weight),
        "tangential_stiffness": strips_stiffness(pieces.tangential * count, weight, state, ratio),
    }


def _between_nodes(patch, weight) -> dict:
    """Return the extent of contact and the stiffnesses of strips with sharp edges, by name.

    The contact ends between nodes (`contact.edges`).
    """
    state = patch.strips
    pieces = patch.pair.compliance
    x = patch.x
    count = len(patch.strips.offsets)
    normal = pieces.normal * count
    tangential = pieces.tangential * count
    softness = None
    if state.stiffness is not None:
        softness = 1 / (state.stiffness.max() * weight)
        normal = normal + np.diag(softness)
        if patch.tangential_ratio is not None:
            tangential = tangential + np.diag(softness / patch.tangential_ratio)
    sums = np.zeros(3)
    length = 0.0
    low = x[-1]
    high = x[0]
    for force, gap in zip(state.force, state.gap, strict=True):
        if not force.any():
            continue
        found = edges.find_edges(normal, x, force, gap, softness, patch.pair.row)
        stretches = edges.contact_intervals(x, force, found)
        one = np.ones(x.size)
        length += np.diff(stretches).sum()
        low = min(low, stretches[0, 0])
        high = max(high, stretches[-1, 1])
        sums += [
            edges.set_stiffness(c, force > 0, motion, found)
            for c, motion in ((normal, one), (tangential, one), (normal, x))
        ]
    names = ("normal_stiffness", "tangential_stiffness", "rotational_stiffness")
    return {
        "contact_fraction": float(length / (count * np.ptp(x))),
        "contact_half_width": float(high - low) / 2,
        **dict(zip(names, map(float, sums), strict=True)),
    }
