"""Values of scikit-fem's elements on their reference cells, stored on disk.

Only the first run on a machine imports scikit-fem, which takes as long as a small patch.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from . import cache as disk_cache


class ElementValues(NamedTuple):
    """Shape functions of an element at points in its reference cell.

    - ``shape``: (g, n) values
    - ``gradient``: (g, 2, n) derivatives with respect to the local coordinates
    - ``weight``: (g,) weights of the points, which add up to the area of the reference cell
    """

    shape: np.ndarray
    gradient: np.ndarray
    weight: np.ndarray


CELL_NAMES = {3: "triangle", 4: "quadrilateral"}  # names of cells by their number of corners


def rectangle_terms() -> np.ndarray:
    """Return the stiffness terms of bilinear rectangles, from the disk cache if possible."""
    return _load_arrays()["rectangle_terms"]


def element_values(n_corners: int, kind: str) -> ElementValues:
    """Return the shape functions of an element at points of its reference cell.

    Parameters
    ----------
    n_corners : int
        3 for linear triangles, 4 for bilinear quadrilaterals.
    kind : {"gauss", "centre"}
        Gauss points of degree 2 (3 in triangles, 2 x 2 in quadrilaterals), or the centre.

    Returns
    -------
    ElementValues
    """
    arrays = _load_arrays()
    prefix = f"{CELL_NAMES[n_corners]}_{kind}"
    return ElementValues(*(arrays[f"{prefix}_{field}"] for field in ElementValues._fields))


@cache
def _load_arrays() -> dict[str, np.ndarray]:
    """Return the shape functions on the reference cells, from the disk cache if possible."""
    # The axes are the Lame constant, the term A, B or C, two corners and two directions.
    shapes = {"rectangle_terms": (2, 3, 4, 4, 2, 2)}
    for n_corners, name in CELL_NAMES.items():
        for kind, n_points in (("gauss", n_corners), ("centre", 1)):
            shapes[f"{name}_{kind}_shape"] = (n_points, n_corners)
            shapes[f"{name}_{kind}_gradient"] = (n_points, 2, n_corners)
            shapes[f"{name}_{kind}_weight"] = (n_points,)
    key = disk_cache.reference_cell_key()
    stored_arrays = disk_cache.load_arrays(key, shapes)
    if stored_arrays is not None:
        return stored_arrays
    from .plane_form import evaluate_reference_cells

    arrays = evaluate_reference_cells()
    disk_cache.store_arrays(key, arrays)
    return arrays
