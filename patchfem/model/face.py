"""Gap between two faces over x and y: the shapes of a scene at the cells of a face, and the means of an areal scan.

In: a `PatchModel` with an area, and the centres of the cells. Out: the gap (ny, nx) [m], with notes.
"""

from dataclasses import replace
from time import process_time

import numpy as np

from ..core import PatchfemError, frozen_array
from ..formatting import format_length
from ..surface import areal
from ..surface.files import read
from .gap import ShapedGap
from .patch import PatchModel
from .source import cache_by_file, name_key


def compute_face_gap(patch: PatchModel, x: np.ndarray, y: np.ndarray) -> ShapedGap:
    """Compute the gap of the unloaded faces at equal cells.

    Parameters
    ----------
    patch : PatchModel
        Patch with an area.
    x, y : (nx,) and (ny,) ndarray
        Centres of the cells [m], 0 in the middle of the face.

    Returns
    -------
    ShapedGap
        Its heights are (ny, nx) [m].

    Raises
    ------
    PatchfemError
        If the scan cannot be read or does not cover half of the face.
    """
    shaped = patch.gap.add_up_shapes(x[None, :], y=y[:, None])
    scan = patch.area.scan
    if scan is None:
        return shaped

    # A scan that is larger than the face is cropped, and a smaller one goes on with its last heights.
    begin = process_time()
    with name_key("contact.profile.scan"):
        part = read_face(scan.path, scan.at, patch.pieces.length, patch.pieces.width)
    sign = -1.0 if scan.is_material else 1.0
    measured = sign * average_over_cells(part, x, y)
    return shaped.add_profile(measured - measured.min(), part.notes, process_time() - begin)


def read_scan(path) -> "areal.Areal":
    """Read the areal scan in a file; PatchfemError for a trace."""
    scan = read.read_surface(path)
    if not isinstance(scan, areal.Areal):
        raise PatchfemError(
            f"{path}: a trace, but an areal scan is needed: give it as contact.profile.file"
        )
    return scan


@cache_by_file
def read_face(path, at: tuple[float, float] | None, length: float, width: float) -> "areal.Areal":
    """Read the part of an areal scan that lies over a face, levelled and without spikes.

    Parameters
    ----------
    path : Path
        File of the scan.
    at : tuple of float or None
        Place (x, y) [m] of the middle of the face in the file; None for the middle of the scan.
    length, width : float
        Lengths of the face along x and y [m].

    Returns
    -------
    areal.Areal
        Positions relative to the middle of the face, and heights [m] without gaps.

    Raises
    ------
    PatchfemError
        If the file is not an areal scan, or covers less than half of the face.
    """
    scan = read_scan(path)
    spikes = areal.find_scan_spikes(scan)
    scan = replace(scan, z=np.where(spikes, np.nan, scan.z))
    middle = at or ((scan.x[0] + scan.x[-1]) / 2, (scan.y[0] + scan.y[-1]) / 2)
    x = scan.x - middle[0]
    y = scan.y - middle[1]
    covered = _covered_length(x, length) * _covered_length(y, width) / (length * width)
    # Smallest share of the face that a scan covers; a smaller one says little about the other heights.
    if covered < 0.5:
        size = f"{format_length(np.ptp(x))} x {format_length(np.ptp(y))}"
        face = f"{format_length(length)} x {format_length(width)}"
        raise PatchfemError(
            f"{path}: the scan, {size}, covers {100 * covered:.3g} % of the face, {face}, but half of it is needed; "
            "measure a larger part, or set contact.profile.at, contact.length and contact.width to the place and the size "
            "of the scan"
        )

    # One row of points beyond each side stays, if there is one.
    columns = _find_covering(x, length)
    rows = _find_covering(y, width)
    part = areal.Areal(
        frozen_array(x[columns]),
        frozen_array(y[rows]),
        scan.z[rows, columns],
        scan.source,
        scan.notes,
    )
    part = areal.level(part)
    notes = list(part.notes)
    if spikes.any():
        notes.append(f"{scan.source}: {int(spikes.sum())} heights of spikes were removed")
    # Share of a face below which missing heights at its sides are not reported; a row of a usual scan is more.
    if 1 - covered > 1e-3:
        notes.append(
            f"{scan.source}: the scan does not cover {100 * (1 - covered):.2g} % of the face, at its sides; the nearest "
            "heights are taken there"
        )
    return replace(part, z=frozen_array(areal.fill_nearest(part.z)), notes=tuple(notes))


def _covered_length(places: np.ndarray, length: float) -> float:
    """Return the length [m] over which points at `places` (n,) [m] cover a face of a length [m] about 0."""
    step = float(np.diff(places).mean()) / 2
    first = max(places[0] - step, -length / 2)
    last = min(places[-1] + step, length / 2)
    return max(last - first, 0.0)


def _find_covering(places: np.ndarray, length: float) -> slice:
    """Return the slice of the points at `places` (n,) [m] that cover a face of a length [m] about 0."""
    first = max(int(np.searchsorted(places, -length / 2, "right")) - 1, 0)
    last = int(np.searchsorted(places, length / 2, "left")) + 1
    return slice(first, last)


def average_over_cells(scan: "areal.Areal", x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Average the cubic spline through a scan over equal cells.

    Waves shorter than a cell do not pass for long ones. Beyond the scan the heights at its sides go on.

    Parameters
    ----------
    scan : areal.Areal
        Scan without gaps.
    x, y : (nx,) and (ny,) ndarray
        Centres of the cells [m].

    Returns
    -------
    (ny, nx) ndarray
        Mean heights [m].
    """
    along_y = _average_axis(scan.y, scan.z, y)
    return frozen_array(_average_axis(scan.x, along_y.T, x).T)


def _average_axis(places: np.ndarray, heights: np.ndarray, centres: np.ndarray) -> np.ndarray:
    """Average heights (m, k) at `places` (m,) along their first axis over cells with given centres (n,): (n, k) [m]."""
    from scipy.interpolate import make_interp_spline

    half = (centres[1] - centres[0]) / 2
    edges = np.append(centres - half, centres[-1] + half)
    integral = make_interp_spline(places, heights, k=min(3, places.size - 1)).antiderivative()
    inside = np.clip(edges, places[0], places[-1])
    beyond = np.where((edges < places[0])[:, None], heights[0], heights[-1])
    total = integral(inside) + (edges - inside)[:, None] * beyond
    return np.diff(total, axis=0) / (2 * half)
