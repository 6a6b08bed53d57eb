"""Prescribed approach of a piece that is free to rotate: find the load that reaches it.

In: a `PatchModel` with an approach, and a function that solves the contact under a load. Out:
the solution under the load found by a bracketing search, or an error if no load or several
loads belong to the approach.
"""

from dataclasses import replace

import numpy as np

from ...contact.unilateral import press
from ...core import Compliance, NotConverged, PatchfemError, frozen_array
from ...formatting import format_length

APPROACH_TOL = 1e-6  # Relative error of the reached approach above which the search has failed.
# Same error relative to the range of the gap, whose round-off limits the accuracy.
GAP_ROUND_OFF_TOL = 1e-9


def press_to_approach_with_rotation(
    patch_model, pieces: Compliance, gap, solve_under_load, stiffened_pieces: Compliance
):
    """Solve the contact of a piece that is free to rotate under a prescribed approach.

    A bracketing search finds the load that gives the approach. If even a millionth of the load that
    flat pieces would need gives more than this approach, the pieces do not touch.

    Parameters
    ----------
    patch_model : PatchModel
    pieces : Compliance
    gap : (m,) or (s, m)
        Unloaded gap [m], of strips (s, m).
    solve_under_load : callable
        Function (patch_model, pieces, gap) that solves the contact under the load of the model.
    stiffened_pieces : Compliance
        Pieces with their skin as under a large load.

    Returns
    -------
    press.SolvedContact

    Raises
    ------
    PatchfemError
        If the middle of the piece does not close as the load increases (`refuse_opening_gap`).
    NotConverged
        If the approach jumps past the distance: a single node under the load line carries the load
        at any rotation between two bounds.
    """
    from scipy.optimize import brentq

    refuse_opening_gap(patch_model, stiffened_pieces)
    distance = patch_model.loading.approach
    solutions = []
    min_load = _min_stable_load(patch_model, np.ptp(pieces.interface.x))

    def excess(log_load: float) -> float:
        """Return the difference [m] between the approach under a trial load and the prescribed one.

        log_load is the logarithm of the load [N] in excess of the least stable load.
        """
        # The unknown is the excess over the least load, because near it the piece rotates ever
        # faster until it tips over.
        load = min_load + float(np.exp(log_load))
        solutions.append(
            solve_under_load(patch_model.with_loading(load=load, approach=None), pieces, gap)
        )
        return solutions[-1].pressure.approach - distance

    top = np.log(max(distance, np.ptp(gap), 1e-12) / pieces.normal.mean())
    low = top = max(top, np.log(min_load) if min_load > 0 else top)
    bottom = top - np.log(1e6) if min_load == 0 else np.log(min_load * 1e-9)
    for _ in range(60):
        if excess(top) >= 0:
            break
        low = top
        top = top + 2
    while low == top or excess(low) >= 0:
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
    brentq(excess, low, top, xtol=1e-13, rtol=1e-14)
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


def refuse_opening_gap(patch_model, pieces: Compliance) -> None:
    """Raise PatchfemError if a larger load on the load line opens the gap at mid-length.

    Under large loads the shapes of the surfaces become irrelevant. The problem of flat pieces, also
    on a rotational spring, has a single scale: twice the load doubles forces, rotation and
    approach. Therefore the approach tends to a constant times the load, and this constant is the
    approach of flat pieces under 1 N on the same line. If it is not positive, no load or more than
    one belongs to a distance. For pieces much softer at the surface than below it (Winkler
    foundation) this begins at a third of the length. A moment that does not increase with the load
    does not have this effect.
    """
    if not patch_model.loading.can_rotate or not patch_model.loading.offset:
        return
    flat = np.zeros(pieces.interface.x.size)

    def closing(offset: float) -> float:
        """Return the approach [m] of flat pieces under 1 N at a given position along the interface."""
        return press(
            pieces, flat, 1.0, float(offset), spring=patch_model.loading.rotational_stiffness
        ).approach

    if closing(patch_model.loading.offset) > 0:
        return
    from scipy.optimize import brentq

    limit = brentq(
        closing, 0.0, patch_model.loading.offset, xtol=1e-4 * abs(patch_model.loading.offset)
    )
    holder = "raise" if patch_model.loading.rotational_stiffness > 0 else "name"
    raise PatchfemError(
        f"the line of the load lies {format_length(patch_model.loading.offset, 6)} off the middle; beyond "
        f"{format_length(limit, 3)} a "
        "larger load opens the gap at the middle of the piece, so an approach of "
        f"{format_length(patch_model.loading.approach, 6)} belongs to several loads or to none; lower "
        f"contact.load_line.offset, {holder} contact.holder.rotational_stiffness, or give contact.load "
        "in place of the approach",
        "contact.approach.distance",
    )
