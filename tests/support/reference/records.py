"""The pages of measures and of materials."""

from patchfem.response.rows import ROWS as MOTION
from patchfem.runs.results.patch_rows import ROWS as STATIC
from patchfem.scene.keys.materials import MATERIALS, THERMAL, YIELD

from .keys import FOLDER, grid

MADE = "Generated from the program's own records by `python tests/support/reference`; a test compares the two."


class Measures:
    """What a run answers: every measure of `response.rows` and `runs.results.patch_rows`."""

    FILE = FOLDER / "MEASURES.md"
    HEAD = f"""\
# What a run answers

{MADE}
Values in summary.json are in SI and have all digits. The error is an estimated half-width; it should stay
below tolerance × |value| + floor, else a warning says so. What is printed ends at the second digit of its error; a
value without one is known to its last digit, and what is 0 within its floor is printed as 0. Measures of a motion are
those of the last cycles, the last ten or the last tenth of a shorter run. A number behind a name counts the interfaces
(strips, where strips slide apart): `slip_amplitude_2` is that of the second. Of a displacement the floor is 1e-5 of
what the drive itself moves, a/omega^2, where that is less.
"""

    @classmethod
    def text(cls) -> str:
        """The whole page."""
        still, moving = ([(f"`{one.name}`", one.unit, _floor(one), one.text) for one in rows]
                         for rows in (STATIC, MOTION))
        head = ("measure", "unit", "floor", "meaning")
        return "\n\n".join([cls.HEAD.strip(), "## Of a pressed patch", grid(head, still), "## Of a motion",
                            grid(head, moving)]) + "\n"


def _floor(row) -> str:
    """The floor of a row, and the larger term that the tolerance times is one as well."""
    return f"{row.floor:g}" if row.term is None else f"{row.floor:g}, tolerance × {row.term[0]}"


class Materials:
    """The materials that a scene may name."""

    FILE = FOLDER / "MATERIALS.md"
    HEAD = f"""\
# Materials by name

{MADE}
A name stands in `contact.substrate` and in a coating's `material`; a table
`{{young = "121 GPa", poisson = 0.32, density = "4370 kg/m^3"}}` in its place is a material of your own. Elastic
constants of one alloy differ by a few per cent between handbooks and by far more in a sprayed coating: where a number
decides, measure it.
"""

    @classmethod
    def text(cls) -> str:
        """The whole page."""
        rows = [(f"`{name}`", *(f"{value:g}" for value in (m.young / 1e9, *m[1:3])), m.source)
                for name, m in MATERIALS.items()]
        warm = [(f"`{name}`", f"{t.conductivity:g}", f"{t.heat_capacity:g}", t.source) for name, t in THERMAL.items()]
        firm = [(f"`{name}`", f"{one.strength / 1e6:g}", one.source) for name, one in YIELD.items()]
        heads = (("name", "young [GPa]", "poisson", "density [kg/m^3]", "source"),
                 ("name", "conductivity [W/(m K)]", "heat capacity [J/(kg K)]", "source"),
                 ("name", "yield strength [MPa]", "source"))
        return "\n\n".join([cls.HEAD.strip(), grid(heads[0], rows), "## Heat", "For the note on how far friction warms "
                            "the faces, beside `[friction.temperature]`.", grid(heads[1], warm), "## Strength",
                            "For the note on pieces whose stress is beyond it, which the run, elastic throughout, "
                            "leaves out. The fifth of a piece beside its held far face does not count.",
                            grid(heads[2], firm)]) + "\n"
