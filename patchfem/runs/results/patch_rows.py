"""Table of the static measures of a patch and of the measures of wear.

In: a name. Out: its unit, floor and definition; and the names of the methods that compute the
measures.
"""

import numpy as np

from ...core import Measure, MeasureDefinition

Measures = dict[str, Measure]  # by name
Arrays = dict[str, np.ndarray]  # fields, histories or columns by name
Values = dict[str, float]  # measures or other numbers by name, in SI units

PATCH_MEASURE_ROWS = (
    MeasureDefinition(
        "normal_load",
        "N",
        0.0,
        "normal load on the interface, summed over all equal patches (key `pairs`)",
        group="patch",
    ),
    MeasureDefinition(
        "contact_fraction",
        "1",
        0.0,
        "fraction of the length of the interface that is in contact, or of its area beside [contact.area]; the edges of "
        "contact may lie between nodes",
        group="patch",
        minimum=0.0,
        flags="main mesh",
    ),
    MeasureDefinition(
        "pressure_peak",
        "Pa",
        0.0,
        "largest normal stress on the interface",
        group="patch",
        minimum=0.0,
        flags="main mesh",
    ),
    MeasureDefinition(
        "moment",
        "N m",
        1e-10,
        "moment of the pressure about the middle of the patch; positive if the pressure centre "
        "is on the side x > 0",
        group="patch",
    ),
    MeasureDefinition(
        "rotation",
        "rad",
        1e-12,
        "rotation of the upper piece about the middle of the patch; a positive rotation "
        "opens the gap at +x",
        group="patch",
        flags="mesh",
    ),
    MeasureDefinition(
        "approach",
        "m",
        1e-13,
        "distance by which the holders approach each other at x = 0, measured from the first "
        "touch of the unloaded flat pieces",
        group="patch",
        flags="mesh",
    ),
    MeasureDefinition(
        "contact_half_width",
        "m",
        1e-12,
        "half the distance between the outermost edges of contact, including gaps "
        "between them; the edges may lie between nodes",
        group="patch",
        minimum=0.0,
    ),
    MeasureDefinition(
        "pressure_centre",
        "m",
        1e-12,
        "position along x of the resultant of the pressure, relative to the middle of the patch",
        group="patch",
    ),
    MeasureDefinition(
        "loaded_fraction",
        "1",
        0.0,
        "mean pressure over the whole interface divided by the pressure peak",
        group="patch",
        minimum=0.0,
    ),
    MeasureDefinition(
        "normal_stiffness",
        "N m-1",
        0.0,
        "derivative of the load with respect to the approach at fixed rotation, for "
        "the whole width",
        group="patch",
        minimum=0.0,
        flags="mesh",
    ),
    MeasureDefinition(
        "tangential_stiffness",
        "N m-1",
        0.0,
        "derivative of the friction force with respect to the slide while the whole patch sticks",
        group="patch",
        minimum=0.0,
        flags="mesh",
    ),
    MeasureDefinition(
        "rotational_stiffness",
        "N m rad-1",
        0.0,
        "derivative of the moment with respect to the rotation at fixed approach",
        group="patch",
        minimum=0.0,
    ),
    MeasureDefinition(
        "contact_area",
        "m2",
        0.0,
        "area in contact, summed over all equal patches; needs [contact.area]",
        group="patch",
        minimum=0.0,
    ),
    MeasureDefinition(
        "pressure_centre_y",
        "m",
        1e-12,
        "position across the width of the resultant of the pressure, relative to the middle; needs [contact.area]",
        group="patch",
    ),
    MeasureDefinition(
        "roll_stiffness",
        "N m rad-1",
        0.0,
        "derivative of the roll moment with respect to the roll at fixed approach; needs [contact.area]",
        group="patch",
        minimum=0.0,
    ),
    MeasureDefinition(
        "yielded_fraction",
        "1",
        1e-4,
        "fraction of the face whose pressure is the hardness; needs contact.area.hardness",
        group="patch",
        minimum=0.0,
    ),
    MeasureDefinition(
        "stick_area_fraction",
        "1",
        1e-3,
        "fraction of the area in contact that sticks at the last reversal of the slide; needs [contact.area] and partial "
        "slip",
        group="patch",
        minimum=0.0,
    ),
    MeasureDefinition(
        "worn_volume", "m3", 0.0, "volume worn off both pieces together", group="wear", minimum=0.0
    ),
    MeasureDefinition(
        "worn_depth_max",
        "m",
        1e-15,
        "largest worn depth on the interface, both pieces together; with a profile and [contact.asperities], a mean over "
        "the waves that these represent",
        group="wear",
        minimum=0.0,
    ),
    MeasureDefinition(
        "worn_through_cycle",
        "1",
        0.0,
        "number of cycles after which a coating is worn through at its deepest place",
        group="wear",
    ),
    MeasureDefinition(
        "groove_amplitude",
        "m",
        1e-12,
        "half the peak-to-valley height of the grooves after wear",
        group="wear",
    ),
    MeasureDefinition(
        "static_coefficient",
        "1",
        0.0,
        "coefficient of static friction after wear; needs [wear.friction]",
        group="wear",
    ),
    MeasureDefinition(
        "bond_length", "m", 0.0, "bond length after wear; needs [wear.friction]", group="wear"
    ),
    MeasureDefinition(
        "roll_moment",
        "N m",
        1e-10,
        "moment of the pressure about x; positive if the pressure centre is on the side y > 0; needs [contact.area]",
        group="patch",
    ),
    MeasureDefinition(
        "roll",
        "rad",
        1e-12,
        "rotation of the upper piece about x; needs [contact.area]; a positive rotation "
        "opens the gap at +y",
        group="patch",
    ),
)
# The following texts name the method that computed a static measure, in `numerics.measures` of
# summary.json.
FINEST_MESH_SOURCE = "finite elements, finest mesh"
# This method is used if its estimated error is smaller than that of the finest mesh.
EXTRAPOLATED_SOURCE = "finite elements, extrapolated over nested meshes"
CELLS_SOURCE = "cells over the face"
HALF_SPACE_SOURCE = "points on layered half-spaces"
WORN_SOURCE = "wear in jumps of cycles"
PATCH_TABLE = {row.name: row for row in PATCH_MEASURE_ROWS}
# Measures whose errors control the refinement of the mesh.
MESH_MEASURES = tuple(row.name for row in PATCH_MEASURE_ROWS if row.has("mesh"))
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
