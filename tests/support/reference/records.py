"""Pages of measures and of materials."""

from collections.abc import Iterable

from patchfem.export import quantities
from patchfem.export import surface_definitions as definitions
from patchfem.measures.rows import MOTION_MEASURE_ROWS as MOTION
from patchfem.runs.results.patch_rows import PATCH_TABLE
from patchfem.scene import MATERIALS

from .keys import FOLDER, format_table

MADE = "`python tests/support/reference` generates this page from the program's own records."

# parts of a worn track, whose names in an answer begin with track_
TRACK_PARTS = (
    "from",
    "to",
    "width",
    "depth_mean",
    "depth_floor",
    "step",
    "area_gross",
    "area_net",
    "pile_up",
    "length",
    "volume",
    "direction",
)


class MeasuresPage:
    """Page of the quantities of all verbs, from the tables that define them."""

    FILE = FOLDER / "MEASURES.md"
    HEAD = f"""\
# Measures

{MADE}

Values in `summary.json` are in SI and have all digits. The error is the estimated half-width of the interval that
contains the exact value of the model. The floor is an absolute error that is always permitted: a warning appears if the
error exceeds tolerance × |value| + floor. If the column "floor" has two entries, the larger entry is the floor. Printed
values are rounded to the second significant digit of their error. A value that is printed without an error is exact to
its last digit. A value whose magnitude is below the floor is printed as 0.

Measures of a motion are evaluated over a window at the end of the run: the last ten cycles or the last tenth of the
run, whichever is shorter, but at least one cycle; under tones the window holds whole beats, under a random drive all of
the record but what the start leaves. If the drive has no frequency, as in a release, a cycle is the frictionless
period of the first mode that is not a rigid-body mode. In a release only `relative_displacement_amplitude` is that of the
last whole cycle of the motion; peaks of acceleration and force, slip and stick are those of the window, in which the
motion may still decay. The window of a bench is its last cycle; its energies, its friction work and its peaks,
`friction_force_peak` and `friction_ratio_peak`, are those of the whole run. A measure "per cycle" is the mean over the
cycles of the window. A number at the end of a name is the number of an interface, or of a band if the bands of a face
slide separately: `slip_amplitude_2` is the slip amplitude of the second interface or band. The floor of a displacement
is at most 1e-5 of a/omega^2, the displacement amplitude of a drive with the acceleration amplitude a, and that of
`friction_force_peak` at most 1e-5 of the normal load.
"""

    STUDIES = """\
A sweep has a `limit_` for each measure, such as `limit_loop_area`, and the `smallest_` and the `largest_` value of the
measures that change most. A fit has a measure for each free key, such as `friction.static`, with its 95 % interval."""
    SURFACES = """\
A measure that begins with `track_` is that of the longest worn track. With `--pairs` a number at the end of a name is
that of a group of pairs."""

    @classmethod
    def text(cls) -> str:
        """Return the page."""
        static_rows, motion_rows = (
            [(f"`{row.name}`", row.unit, _format_floor(row), row.text) for row in rows]
            for rows in (PATCH_TABLE.values(), MOTION)
        )
        head = ("measure", "unit", "floor", "meaning")
        surface_names = [
            definitions.name_in_track(name) if name in TRACK_PARTS else name
            for name in definitions.SURFACE_QUANTITIES
        ]
        return (
            "\n\n".join(
                [
                    cls.HEAD.strip(),
                    "## Of a pressed patch",
                    format_table(head, static_rows),
                    "## Of a motion",
                    format_table(head, motion_rows),
                    "## Of a sweep, a backbone, a fit and a cost curve",
                    cls.STUDIES,
                    _format_definitions(quantities.QUANTITIES, ""),
                    "## Of compare and profile",
                    cls.SURFACES,
                    _format_definitions(surface_names, "compare"),
                ]
            )
            + "\n"
        )


def _format_definitions(names: Iterable[str], kind: str) -> str:
    """Return the table of the quantities with these names in an answer of this kind."""
    rows = []
    for name in names:
        definition = quantities.find_definition(name, kind)
        rows.append((f"`{name}`", definition.unit, definition.text))
    return format_table(("measure", "unit", "meaning"), rows)


def _format_floor(row) -> str:
    """Return the floor of a row, with its relative part if it has one."""
    if not row.larger_term:
        return f"{row.floor:g}"
    term = f" × {row.larger_term}" * (row.larger_term != "1")
    return f"{row.floor:g}; tolerance{term}"


class MaterialsPage:
    """Page of the materials that a scene may name."""

    FILE = FOLDER / "MATERIALS.md"
    HEAD = f"""\
# Materials by name

{MADE}

The value of `contact.substrate`, or of `material` in a coating, is one of these names or a table of your own values:
`{{young = "121 GPa", poisson = 0.32, density = "4370 kg/m^3"}}`, with `yield = "880 MPa"` for its yield strength if you
know it. For one alloy, the elastic constants differ by a few
per cent between handbooks; for a sprayed coating they differ by far more. If your result depends on one of these
constants, measure it on your material.

Case, blanks, hyphens and underscores do not matter in a name, except the case of `TiN`: `ti64`, `Ti6Al4V` and
`ti-6al-4v` mean `Ti-6Al-4V`. The error for an unknown name lists the materials or proposes near ones.
"""

    @classmethod
    def text(cls) -> str:
        """Return the page."""
        rows = []
        strength_rows = []
        for name, record in MATERIALS.items():
            quoted = f"`{name}`"
            numbers = (record.young / 1e9, record.poisson, record.density)
            strength = "-"
            if record.strength is not None:
                strength = f"{record.strength.strength / 1e6:g}"
                strength_rows.append((quoted, strength, record.strength.source))
            others = ", ".join(record.other_names)
            values = (f"{number:g}" for number in numbers)
            rows.append((quoted, *values, strength, others, record.source))
        heads = (
            (
                "name",
                "young [GPa]",
                "poisson",
                "density [kg/m^3]",
                "yield [MPa]",
                "other names",
                "source",
            ),
            ("name", "yield strength [MPa]", "source"),
        )
        return (
            "\n\n".join(
                [
                    cls.HEAD.strip(),
                    format_table(heads[0], rows),
                    "## Strength",
                    "The pieces are assumed to be elastic. A note appears if the von Mises stress in a piece "
                    "exceeds the yield strength, that of the key `yield` or of this table. The stress is "
                    "that of the mesh, without the fifth of the height of the piece next to its fixed far "
                    "face, or its lower bound that follows from the pressure peak. Hard coatings and "
                    "ceramics fracture before they yield, so no yield strength is given for them here; "
                    "none is given for cast iron, bronze and PTFE, because it depends on the grade. A "
                    "strength is the specified minimum for the condition stated in the source, unless the "
                    "source states otherwise; for another condition, give `yield` in the scene.",
                    format_table(heads[1], strength_rows),
                ]
            )
            + "\n"
        )
