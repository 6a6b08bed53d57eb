"""The pages of measures and of materials."""

from patchfem.response.rows import ROWS as MOTION
from patchfem.runs.results.patch_rows import ROWS as STATIC
from patchfem.scene.keys.materials import MATERIALS, THERMAL, YIELD

from .keys import FOLDER, grid

MADE = "`python tests/support/reference` generates this page from the program's own records."


class Measures:
    """What a run answers: every measure of `response.rows` and `runs.results.patch_rows`."""

    FILE = FOLDER / "MEASURES.md"
    HEAD = f"""\
# Measures of a run

{MADE}

Values in `summary.json` are in SI and have all digits. The error is the estimated half-width of the interval that
contains the exact value of the model. A warning appears if the error exceeds tolerance × |value| + floor. Printed
values end at the second digit of their error. A value that is printed without an error is exact to its last digit. A
value that is 0 within its floor is printed as 0.

Measures of a motion refer to the window: the last ten cycles or the last tenth of the run, whichever is shorter. A
number at the end of a name counts the interfaces, or the strips if they slide separately: `slip_amplitude_2` is the
slip amplitude of the second. The floor of a displacement is at most 1e-5 of the amplitude of the drive, a/omega^2.
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

`contact.substrate` and the `material` of a coating take one of these names, or a table with your own values:
`{{young = "121 GPa", poisson = 0.32, density = "4370 kg/m^3"}}`. Elastic constants of one alloy differ by a few per
cent between handbooks, and those of a sprayed coating by far more. Measure a constant on which your result depends.
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
        return "\n\n".join([cls.HEAD.strip(), grid(heads[0], rows), "## Heat",
                            "With `[friction.temperature]` a note uses these values to estimate how much friction "
                            "heats the faces.", grid(heads[1], warm), "## Strength",
                            "Pieces are elastic throughout a run. A note appears if their stress exceeds the yield "
                            "strength; the fifth of a piece next to its fixed far face does not count.",
                            grid(heads[2], firm)]) + "\n"
