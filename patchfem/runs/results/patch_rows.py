"""Static measures of a patch and measures of wear: their rows of measures.toml, and the methods that compute them."""

import numpy as np

from ...core import Measure, read_measure_rows

Measures = dict[str, Measure]  # by name
Arrays = dict[str, np.ndarray]  # fields, histories or columns by name
Values = dict[str, float]  # measures or other numbers by name, in SI units

PATCH_TABLE = read_measure_rows("patch")
# The following texts name the method that computed a static measure, in `numerics.measures` of
# summary.json.
FINEST_MESH_SOURCE = "finite elements, finest mesh"
# This method is used if its estimated error is smaller than that of the finest mesh.
EXTRAPOLATED_SOURCE = "finite elements, extrapolated over nested meshes"
CELLS_SOURCE = "cells over the face"
HALF_SPACE_SOURCE = "points on layered half-spaces"
WORN_SOURCE = "wear in jumps of cycles"
# Measures whose errors control the refinement of the mesh.
MESH_MEASURES = tuple(row.name for row in PATCH_TABLE.values() if row.has("mesh"))
POSITIVE_MESH_MEASURES = tuple(name for name in MESH_MEASURES if PATCH_TABLE[name].minimum == 0.0)


def make_measure(name: str, value: float, error: float | None, engine: str = "") -> Measure:
    """Return a measure of a patch or of wear, with the unit and the floor of its row.

    Parameters
    ----------
    name : str
        Name of the measure.
    value, error : float
        In the unit of the row; the error is None without an estimate.
    engine : str
        Method that computed the value.
    """
    row = PATCH_TABLE[name]
    error = None if error is None else float(error)
    return Measure(float(value), row.unit, error, row.floor, engine=engine)


def find_unknown_measures(measures: Measures) -> list[str]:
    """Return the names of the measures whose error exceeds their value, so that they are hardly known.

    Only measures that are positive by definition and for which the mesh is refined are considered.
    """
    names = []
    for name in POSITIVE_MESH_MEASURES:
        measure = measures.get(name)
        if measure is not None and measure.value is not None and measure.error:
            if measure.error >= measure.value:
                names.append(name)
    return names
