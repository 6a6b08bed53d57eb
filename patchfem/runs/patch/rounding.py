"""The peak beside rounded ends that the cells of a mesh are too long to show."""

import numpy as np

from ...closed_forms.contact import rounded_corner
from .press import Patch

FINE = 4  # cells within the reach of the contact onto the rounding from which meshes show how its peak converges


def unresolved_rounding(patch: Patch) -> float:
    """Largest pressure [Pa] that rounded ends may carry between the nodes; 0 where the mesh resolves them.

    The cells where the contact ends carry what a sharp end would, K = sigma_n sqrt(cell); a rounding that these cells
    pass over has its peak by `rounded_corner`.
    """
    pair, x, sigma = patch.pair, patch.x, patch.pressure.sigma_n
    rounded = _rounded(pair)
    loaded = np.flatnonzero(patch.active)
    if not rounded or not loaded.size or patch.pieces is not pair.compliance:  # a skin evens the pressure out
        return 0.0
    flat, radius = min(body.flat for body in rounded), 1 / sum(1 / body.end.size for body in rounded)
    modulus = 1 / sum((1 - nu**2) / young for young, nu in (piece.layers.coating for piece in (pair.piece, pair.upper)))
    found = 0.0
    for at in (loaded[0], loaded[-1]):
        cell = np.diff(x)[max(at - 1, 0):at + 1].max()
        if abs(abs(x[at]) - flat) > 2 * cell:  # the contact ends elsewhere
            continue
        reach, peak = rounded_corner(sigma[max(at - 2, 0):at + 3].max() * np.sqrt(cell), radius, modulus)
        found = max(found, peak if FINE * cell > reach else 0.0)
    return found


def open_ends(patch: Patch) -> float:
    """Length [m] of rounded face, both ends together, within which the contact may end though its last node is in
    contact."""
    rounded = _rounded(patch.pair)
    return patch.active[[0, -1]].sum() * (patch.x[-1] - min(body.flat for body in rounded)) if rounded else 0.0


def beyond_gentle(patch: Patch) -> bool:
    """Whether the contact goes on where a rounded end is steeper than its face may touch.

    A single loaded node whose cell passes over the whole rounding does not tell.
    """
    cells = np.diff(patch.x)[[0, -1]]
    return bool((patch.active[[0, -1]] & (cells < open_ends(patch))).any())


def _rounded(pair) -> list:
    """The bodies on which a rounding ends the interface."""
    return [body for body in (pair.grid, pair.upper_grid)
            if getattr(body, "end", None) is not None and body.end.kind == "radius" and body.rise[-1] > 0]
