"""A prescribed approach of a piece that is free to turn: the load that reaches it, or that none does."""

from dataclasses import replace

import numpy as np

from ...contact.unilateral import press
from ...core import Compliance, NotConverged, PatchfemError, frozen_array
from ...formatting import format_length

MISSED = 1e-6  # what the search may leave of the distance, over the distance
GAP_ROUND = 1e-9  # what it may leave over the range of the gap, whose round-off it cannot go below


def closed_by(asked, pieces: Compliance, gap, under, stiff: Compliance) -> tuple:
    """The pair under an approach with the rotation free: (Compliance with its skin, Pressure, skin, strips).

    under(asked, pieces, gap): the same of a pair under its load; stiff: the pieces as a large load finds them. The load
    at which the approach is reached is searched. Where a load a millionth of what flat pieces would take is too much,
    nothing touches. PatchfemError where the middle does not close as the load grows (`refuse_opening`), NotConverged
    where the approach jumps past the distance: one node under the load line carries at any rotation within bounds.
    """
    from scipy.optimize import brentq

    refuse_opening(asked, stiff)
    distance, tried = asked.loading.approach, []
    least = _least_load(asked, np.ptp(pieces.interface.x))

    def short(log_load: float) -> float:
        # beyond the least load: the piece turns ever faster the nearer it is to tipping over
        load = least + float(np.exp(log_load))
        tried.append(under(asked.with_loading(load=load, approach=None), pieces, gap))
        return tried[-1][1].approach - distance

    top = np.log(max(distance, np.ptp(gap), 1e-12) / pieces.normal.mean())
    low = top = max(top, np.log(least) if least > 0 else top)
    bottom = top - np.log(1e6) if least == 0 else np.log(least * 1e-9)
    for _ in range(60):
        if short(top) >= 0:
            break
        low, top = top, top + 2
    while low == top or short(low) >= 0:
        if low == bottom:
            apart = asked.with_loading(
                load=0.0, approach=None, can_rotate=False, rotational_stiffness=0.0
            )
            pieces, still, skin, strips = under(apart, pieces, gap)
            open_ = frozen_array(np.atleast_2d(gap).min(axis=0) - min(distance, gap.min()))
            return pieces, replace(still, gap=open_, approach=distance), skin, strips
        low, top = max(low - 2, bottom), low
    brentq(short, low, top, xtol=1e-13, rtol=1e-14)
    best = min(tried, key=lambda one: abs(one[1].approach - distance))
    if abs(best[1].approach - distance) > MISSED * distance + GAP_ROUND * np.ptp(gap):
        reached = [one[1].approach for one in tried]
        below, above = (
            max(a for a in reached if a < distance),
            min(a for a in reached if a > distance),
        )
        raise NotConverged(
            f"an approach of {distance:.6g} m cannot be reached: the approach jumps from {below:.6g} m "
            f"to {above:.6g} m when the line of the load passes one of the few nodes in contact; "
            "lower contact.element_size, or give "
            "contact.load in place of the approach",
            "contact.approach.distance",
        )
    return best


def _least_load(asked, length: float) -> float:
    """Load [N] below which a free piece tips over under its moment."""
    tips = (
        asked.loading.can_rotate
        and asked.loading.line_moment
        and asked.loading.rotational_stiffness == 0
    )
    return 2 * abs(asked.loading.line_moment) / length if tips else 0.0


def refuse_opening(asked, pieces: Compliance) -> None:
    """Raise PatchfemError for a load line so far off the middle that the middle opens as the load grows.

    Under large loads the shapes of the surfaces no longer count. The problem of flat pieces, or of pieces on a spring,
    has one scale: twice the load doubles forces, rotation and approach. So the approach ends as a constant times the
    load, and that constant is the approach of flat pieces under 1 N on the same line. Where it is not positive no load
    or more than one belongs to a distance. On pieces much softer at the surface than below (Winkler's foundation) this
    begins at a third of the length. A moment that does not grow with the load never comes there.
    """
    if not asked.loading.can_rotate or not asked.loading.offset:
        return
    flat = np.zeros(pieces.interface.x.size)

    def closing(offset: float) -> float:
        return press(
            pieces, flat, 1.0, float(offset), spring=asked.loading.rotational_stiffness
        ).approach

    if closing(asked.loading.offset) > 0:
        return
    from scipy.optimize import brentq

    limit = brentq(closing, 0.0, asked.loading.offset, xtol=1e-4 * abs(asked.loading.offset))
    holder = "raise" if asked.loading.rotational_stiffness > 0 else "name"
    raise PatchfemError(
        f"the line of the load lies {format_length(asked.loading.offset, 6)} off the middle; beyond "
        f"{format_length(limit, 3)} a "
        "larger load opens the gap at the middle of the piece, so an approach of "
        f"{format_length(asked.loading.approach, 6)} belongs to several loads or to none; lower "
        f"contact.load_line.offset, {holder} contact.holder.rotational_stiffness, or give contact.load "
        "in place of the approach",
        "contact.approach.distance",
    )
