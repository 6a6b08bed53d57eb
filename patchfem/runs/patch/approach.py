"""Search for the load that gives a prescribed approach of a piece that is free to rotate.

In: a `PatchModel` with an approach, and a function that solves the contact under a load. Out: the
solution under the load that gives the approach, or an error if no load or several loads give it.
"""

from dataclasses import replace

import numpy as np

from ...contact.unilateral import press
from ...core import Compliance, NotConverged, PatchfemError, frozen_array
from ...formatting import format_length

# Largest relative error of the approach at which the search counts as successful.
APPROACH_TOL = 1e-6
# The same error relative to the range of the gap, whose round-off limits the accuracy.
GAP_ROUND_OFF_TOL = 1e-9


def solve_contact_at_approach(
    patch_model, pieces: Compliance, gap, solve_under_load, stiffened_pieces: Compliance
):
    """Solve the contact of a freely rotating piece under a prescribed approach.

    The load that gives the approach is found by bracketing. If a millionth of the load that flat
    pieces would need already gives a larger approach, the pieces do not touch.

    Parameters
    ----------
    patch_model : PatchModel
    pieces : Compliance
    gap : (m,) or (s, m)
        Unloaded gap [m], of strips (s, m).
    solve_under_load : callable
        Function (patch_model, pieces, gap) that solves the contact under a prescribed load.
    stiffened_pieces : Compliance
        Compliance of the pieces with the asperity layer as stiff as under a large load.

    Returns
    -------
    press.SolvedContact

    Raises
    ------
    PatchfemError
        If the gap in the middle does not close under an increasing load (`require_closing_gap`).
    NotConverged
        If the approach is discontinuous at the prescribed value: a single node under the load line
        carries the load at any rotation between two bounds.
    """
    from scipy.optimize import brentq

    require_closing_gap(patch_model, stiffened_pieces)
    distance = patch_model.loading.approach
    solutions = []
    min_load = _min_stable_load(patch_model, np.ptp(pieces.interface.x))

    def approach_difference(log_load: float) -> float:
        """Return the difference [m] between the approach under a trial load and the prescribed one.

        log_load: logarithm of the load [N] minus the smallest stable load.
        """
        # The unknown is the load minus the smallest stable load, because near that load the piece
        # tips over.
        load = min_load + float(np.exp(log_load))
        solutions.append(
            solve_under_load(patch_model.with_loading(load=load, approach=None), pieces, gap)
        )
        return solutions[-1].pressure.approach - distance

    top = np.log(max(distance, np.ptp(gap), 1e-12) / pieces.normal.mean())
    low = top = max(top, np.log(min_load) if min_load > 0 else top)
    bottom = top - np.log(1e6) if min_load == 0 else np.log(min_load * 1e-9)
    for _ in range(60):
        if approach_difference(top) >= 0:
            break
        low = top
        top = top + 2
    while low == top or approach_difference(low) >= 0:
        if low == bottom:
            unloaded_model = patch_model.with_loading(
                load=0.0, approach=None, can_rotate=False, rotational_stiffness=0.0
            )
            unloaded = solve_under_load(unloaded_model, pieces, gap)
            open_gap = frozen_array(np.atleast_2d(gap).min(axis=0) - min(distance, gap.min()))
            pressure = replace(unloaded.pressure, gap=open_gap, approach=distance)
            return unloaded._replace(pressure=pressure)
        top = low
        low = max(low - 2, bottom)
    brentq(approach_difference, low, top, xtol=1e-13, rtol=1e-14)
    approaches = [solution.pressure.approach for solution in solutions]
    nearest = int(np.argmin(np.abs(np.array(approaches) - distance)))
    error = abs(approaches[nearest] - distance)
    if error > APPROACH_TOL * distance + GAP_ROUND_OFF_TOL * np.ptp(gap):
        below = max(approach for approach in approaches if approach < distance)
        above = min(approach for approach in approaches if approach > distance)
        raise NotConverged(
            f"an approach of {distance:.6g} m cannot be reached: the approach jumps from {below:.6g} m "
            f"to {above:.6g} m when the line of the load passes one of the few nodes in contact; "
            "lower contact.element_size, or give "
            "contact.load in place of the approach",
            "contact.approach.distance",
        )
    return solutions[nearest]


def _min_stable_load(patch_model, length: float) -> float:
    """Return the load [N] below which a freely rotating piece tips over under its moment."""
    tips = (
        patch_model.loading.can_rotate
        and patch_model.loading.line_moment
        and patch_model.loading.rotational_stiffness == 0
    )
    return 2 * abs(patch_model.loading.line_moment) / length if tips else 0.0


def require_closing_gap(patch_model, pieces: Compliance) -> None:
    """Raise PatchfemError if an increasing load off the middle opens the gap there.

    Under large loads the shapes of the surfaces become irrelevant. The contact of flat pieces, also
    with a rotational spring, is homogeneous: twice the load doubles forces, rotation and approach.
    The approach therefore tends to a constant times the load, and the constant is the approach of
    flat pieces under 1 N on the same load line. If it is not positive, an approach belongs to no
    load or to more than one. For pieces that are much softer at the surface than below it (Winkler
    foundation), this begins at a third of the length from the middle. A moment that does not
    increase with the load has no such effect.
    """
    loading = patch_model.loading
    if not loading.can_rotate or not loading.offset:
        return
    flat = np.zeros(pieces.interface.x.size)

    def approach_under_unit_load(offset: float) -> float:
        """Return the approach [m] of flat pieces under 1 N at a given offset from the middle [m]."""
        return press(pieces, flat, 1.0, float(offset), spring=loading.rotational_stiffness).approach

    if approach_under_unit_load(loading.offset) > 0:
        return
    from scipy.optimize import brentq

    limit = brentq(
        approach_under_unit_load,
        0.0,
        loading.offset,
        xtol=1e-4 * abs(loading.offset),
    )
    holder = "raise" if loading.rotational_stiffness > 0 else "name"
    raise PatchfemError(
        f"the line of the load lies {format_length(loading.offset, 6)} off the middle; beyond "
        f"{format_length(limit, 3)} a "
        "larger load opens the gap at the middle of the piece, so an approach of "
        f"{format_length(loading.approach, 6)} belongs to several loads or to none; lower "
        f"contact.load_line.offset, {holder} contact.holder.rotational_stiffness, or give contact.load "
        "in place of the approach",
        "contact.approach.distance",
    )
