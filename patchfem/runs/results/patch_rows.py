"""Static measures of a pressed patch: unit, least floor and meaning of each."""

from ...core import Row

ROWS = (
    Row("normal_load", "N", 0.0, "normal load on the interface, all pairs together", group="patch"),
    Row("contact_fraction", "1", 0.0, "share of the interface under pressure, its ends found between the nodes",
        group="patch"),
    Row("pressure_peak", "Pa", 0.0, "largest normal stress on the interface", group="patch"),
    Row("moment", "N m", 1e-10, "moment of the pressure about the middle of the patch, positive where it lies at +x",
        group="patch"),
    Row("rotation", "rad", 1e-12, "rotation of the upper piece about the middle of the patch, positive opens at +x",
        group="patch"),
    Row("approach", "m", 1e-13, "closing of the holders at x = 0 since the unloaded flat pieces first touch",
        group="patch"),
    Row("contact_half_width", "m", 1e-12, "half the length in contact, its edges found between the nodes",
        group="patch"),
    Row("pressure_centre", "m", 1e-12, "place of the resultant of the pressure along x, from the middle of the patch",
        group="patch"),
    Row("loaded_fraction", "1", 0.0, "mean pressure over the whole interface divided by the largest one",
        group="patch"),
    Row("normal_stiffness", "N m-1", 0.0, "change of the load with the approach at held rotation, whole width",
        group="patch"),
    Row("tangential_stiffness", "N m-1", 0.0, "change of the friction force with the slide while all of it sticks",
        group="patch"),
    Row("rotational_stiffness", "N m rad-1", 0.0, "change of the moment with the rotation at held approach",
        group="patch"),
    Row("pressure_centre_lateral", "m", 1e-12, "place of the resultant of the pressure over the width, of strips",
        group="patch"),
    Row("worn_volume", "m3", 0.0, "volume worn off both pieces together", group="wear"),
    Row("worn_depth_max", "m", 1e-15, "largest worn depth on the interface, both pieces together", group="wear"),
    Row("worn_through_cycle", "1", 0.0, "cycles of wear after which a coating is gone at its deepest place",
        group="wear"),
    Row("groove_amplitude", "m", 1e-12, "half the height of the flanks of the grooves after wear, peak to peak",
        group="wear"),
    Row("static_coefficient", "1", 0.0, "coefficient of static friction after wear, of [wear.friction]", group="wear"),
    Row("bond_length", "m", 0.0, "length over which a bond forms and breaks after wear, of [wear.friction]",
        group="wear"),
    Row("roll_moment", "N m", 1e-10, "moment of the pressure about x, of strips that roll", group="patch"),
    Row("roll", "rad", 1e-12, "roll of the upper piece about x, positive opens at +y, of strips", group="patch"),
)
# what a mesh is chosen for
DECISIVE = ("pressure_peak", "contact_fraction", "approach", "rotation", "normal_stiffness", "tangential_stiffness")
TABLE = {row.name: row for row in ROWS}
