"""Materials known by name: one table of elastic constants, density and yield strength, with sources.

A scene may write a name in any spelling: case, blanks, hyphens and underscores do not count.

>>> find_material_name("ti64"), find_material_name("inconel-718"), find_material_name("1.4404")
('Ti-6Al-4V', 'Inconel 718', '316L')
"""

from __future__ import annotations

import re
from difflib import get_close_matches
from functools import cache
from typing import NamedTuple

SEPARATORS = r"[\s_-]"  # characters that are ignored in the name of a material
MAX_NEAR_NAMES = 3  # largest number of materials that are proposed for an unknown name
MIN_PREFIX_LENGTH = 3  # smallest number of characters for which the beginning of a name is compared
# Names with another meaning in other letter case: tin is a metal of about 50 GPa.
CASE_SENSITIVE_NAMES = ("TiN",)
# Smallest similarity ratio (difflib) for a proposal; below it, the
# numbers of all steels look alike.
MIN_SIMILARITY = 0.7


class YieldStrength(NamedTuple):
    """Yield strength in tension [Pa] at 20 degC, with the source of the number."""

    strength: float
    source: str


class ThermalProperties(NamedTuple):
    """Thermal conductivity [W m-1 K-1] and heat capacity [J kg-1 K-1] near 20 degC, with the source of the numbers."""

    conductivity: float
    heat_capacity: float
    source: str


class MaterialRecord(NamedTuple):
    """Isotropic elastic constants and other properties of one material at 20 degC.

    - young, poisson, density: Young's modulus [Pa], Poisson's ratio [1] and density [kg m-3].
    - source: source of these three numbers.
    - other_names: names that mean the same material.
    - strength: yield strength; None for a material that breaks before it yields, or whose yield
      strength is not known.
    - heat: thermal properties; None if they are not known.
    """

    young: float
    poisson: float
    density: float
    source: str
    other_names: tuple[str, ...] = ()
    strength: YieldStrength | None = None
    heat: ThermalProperties | None = None


MATERIALS: dict[str, MaterialRecord] = {
    "Ti-8Al-1Mo-1V": MaterialRecord(
        young=121e9,
        poisson=0.32,
        density=4370.0,
        source="MatWeb MTA816, annealed for 8 h at 790 degC; AZoM gives 117 GPa, Timet 131 GPa "
        "(19e6 psi) after duplex annealing.",
        other_names=("Ti-8-1-1",),
        strength=YieldStrength(
            930e6,
            "MatWeb MTA816: value after annealing for 8 h at 790 degC; the specified minimum "
            "is 828 MPa.",
        ),
        heat=ThermalProperties(
            conductivity=6.0,
            heat_capacity=502.0,
            source="MatWeb MTA816; Timet gives 5.98 W/m/K at 24 degC.",
        ),
    ),
    "WC-Co": MaterialRecord(
        young=250e9,
        poisson=0.24,
        density=14500.0,
        source="Assumed value for a sprayed coating: pores and splat boundaries reduce Young's modulus "
        "from 600 GPa (sintered) to 200-350 GPa.",
    ),
    "WC-Co sintered": MaterialRecord(
        young=600e9,
        poisson=0.22,
        density=14900.0,
        source="Handbook values of the dense cermet with about 6 % cobalt.",
    ),
    "steel": MaterialRecord(
        young=210e9,
        poisson=0.30,
        density=7850.0,
        source="Handbook values of plain carbon steel at 20 degC.",
        other_names=("carbon steel", "S235", "S235JR", "1.0038"),
        strength=YieldStrength(
            235e6,
            "EN 10025-2: minimum yield strength of S235 (up to 16 mm thick), the common grade with "
            "the lowest strength.",
        ),
        heat=ThermalProperties(
            conductivity=50.0, heat_capacity=490.0, source="Handbook values of plain carbon steel."
        ),
    ),
    "stainless steel": MaterialRecord(
        young=193e9,
        poisson=0.29,
        density=8000.0,
        source="Data sheets of austenitic steel 304 at 20 degC; they give 193 to 200 GPa.",
        other_names=("304", "AISI 304", "1.4301", "X5CrNi18-10"),
        strength=YieldStrength(
            205e6,
            "ASTM A240: minimum yield strength of annealed 304; AK Steel gives a typical value of 290 MPa.",
        ),
    ),
    "cast iron": MaterialRecord(
        young=110e9,
        poisson=0.26,
        density=7200.0,
        source="Handbook values of grey cast iron; Young's modulus is near the middle "
        "of the range 66-140 GPa of the grades.",
        other_names=("grey cast iron", "gray cast iron"),
    ),
    "aluminium": MaterialRecord(
        young=69e9,
        poisson=0.33,
        density=2700.0,
        source="Handbook values of alloy 6061 at 20 degC.",
        other_names=("aluminum", "6061", "6061-T6", "Al 6061", "Al 6061-T6", "EN AW-6061"),
        strength=YieldStrength(240e6, "ASTM B209: minimum yield strength of 6061-T6."),
    ),
    "bronze": MaterialRecord(
        young=110e9,
        poisson=0.34,
        density=8800.0,
        source="Handbook values of tin bronze; Young's modulus is about 100-115 GPa, "
        "depending on the alloy.",
        other_names=("tin bronze",),
    ),
    "alumina": MaterialRecord(
        young=370e9,
        poisson=0.22,
        density=3900.0,
        source="Data sheets of sintered ceramic with 99.5 % Al2O3; NIST gives 416 GPa and 3984 kg/m3 "
        "without pores.",
        other_names=("Al2O3", "aluminium oxide", "aluminum oxide"),
    ),
    "PTFE": MaterialRecord(
        young=0.5e9,
        poisson=0.46,
        density=2200.0,
        source="Callister, Materials Science and Engineering, appendix B: 0.40 to 0.55 GPa, and "
        "Poisson's ratio; data sheets of the unfilled polymer give 2130 to 2200 kg/m3; this material creeps.",
        other_names=("Teflon",),
    ),
    "Ti-6Al-4V": MaterialRecord(
        young=114e9,
        poisson=0.31,
        density=4430.0,
        source="Data sheets of annealed grade 5 (AMS 4928); MIL-HDBK-5J, tables 5.4.1.0, give 110 GPa "
        "for sheet and 117 GPa for bar.",
        other_names=("Ti64", "Ti grade 5", "titanium grade 5", "3.7165", "3.7164", "TA6V"),
        strength=YieldStrength(
            828e6, "AMS 4928 and ASTM B348: minimum of annealed bar; a typical value is 910 MPa."
        ),
    ),
    "Inconel 718": MaterialRecord(
        young=200e9,
        poisson=0.29,
        density=8190.0,
        source="Special Metals, publication SMC-045 (2007), tables 2 and 3: 29.0e6 psi and 0.296 lb/in3 "
        "at 21 degC.",
        other_names=("IN718", "718", "alloy 718", "UNS N07718", "2.4668", "NiCr19Fe19Nb5Mo3"),
        strength=YieldStrength(
            1034e6,
            "AMS 5662 and AMS 5663: minimum of bar that is solution annealed and aged.",
        ),
    ),
    "316L": MaterialRecord(
        young=200e9,
        poisson=0.30,
        density=8000.0,
        source="EN 10088-1, 1.4404: Young's modulus and density at 20 degC; EN 1993-1-4: Poisson's "
        "ratio. American handbooks give 193 GPa.",
        other_names=(
            "AISI 316L",
            "SS 316L",
            "stainless steel 316L",
            "1.4404",
            "X2CrNiMo17-12-2",
            "UNS S31603",
        ),
        strength=YieldStrength(
            170e6,
            "ASTM A240: minimum of annealed 316L; EN 10088-2 asks for 220 to 240 MPa of 1.4404.",
        ),
    ),
    "17-4PH": MaterialRecord(
        young=196e9,
        poisson=0.27,
        density=7800.0,
        source="MMPDS-04, section 2.6.9: 28.5e6 psi, and 0.282 lb/in3 in condition H900; the other conditions "
        "differ by less than 1 %.",
        other_names=("AISI 630", "630", "1.4542", "X5CrNiCuNb16-4", "UNS S17400"),
        strength=YieldStrength(
            725e6,
            "ASTM A564, type 630: minimum in condition H1150; H1025 has 1000 MPa and H900 "
            "1170 MPa; H1150-M, aged twice, has less than H1150.",
        ),
    ),
    "42CrMo4": MaterialRecord(
        young=200e9,
        poisson=0.32,
        density=7830.0,
        source="MIL-HDBK-5J, section 2.3.1, low-alloy steels such as AISI 4130: 29.0e6 psi and "
        "0.283 lb/in3; European data sheets give 190 to 210 GPa.",
        other_names=("4140", "AISI 4140", "SAE 4140", "1.7225", "42CrMoS4", "SCM440"),
        strength=YieldStrength(
            650e6,
            "EN 10083-3, quenched and tempered: minimum at a diameter of 40 to 100 mm; it is "
            "900 MPa up to 16 mm and 500 MPa up to 250 mm.",
        ),
    ),
    "100Cr6": MaterialRecord(
        young=210e9,
        poisson=0.30,
        density=7810.0,
        source="Data of rolling bearing makers for hardened steel of ISO 683-17; data sheets of "
        "AISI 52100 give 190 to 210 GPa and 0.27 to 0.30.",
        other_names=("52100", "AISI 52100", "SAE 52100", "1.3505", "SUJ2", "bearing steel"),
        strength=YieldStrength(
            2030e6,
            "Data sheets of AISI 52100 balls, hardened to 60 HRC: 295 ksi; soft annealed steel has "
            "350 to 590 MPa.",
        ),
    ),
    "Al 7075-T6": MaterialRecord(
        young=71e9,
        poisson=0.33,
        density=2800.0,
        source="MIL-HDBK-5J, section 3.7: 10.3e6 psi and 0.101 lb/in3.",
        other_names=("7075", "7075-T6", "7075-T651", "Al 7075", "EN AW-7075", "AA 7075", "3.4365"),
        strength=YieldStrength(
            460e6,
            "EN 485-2: minimum of plates of 6 to 12.5 mm; plates of more than 50 mm have less; a "
            "typical value is 503 MPa.",
        ),
    ),
    "Al 6082-T6": MaterialRecord(
        young=70e9,
        poisson=0.30,
        density=2700.0,
        source="EN 1999-1-1, section 3.2.5: design values of structural aluminium.",
        other_names=("6082", "6082-T6", "6082-T651", "Al 6082", "EN AW-6082", "AA 6082", "3.2315"),
        strength=YieldStrength(
            240e6, "EN 485-2: minimum of plates of 12.5 to 100 mm; sheets up to 6 mm have 260 MPa."
        ),
    ),
    "CuZn39Pb3": MaterialRecord(
        young=97e9,
        poisson=0.31,
        density=8470.0,
        source="Data sheets of CW614N; Poisson's ratio is that of C36000, a similar brass. Brasses have 95 to 110 GPa.",
        other_names=("brass", "free-cutting brass", "CW614N", "CZ121", "C38500"),
        strength=YieldStrength(
            220e6,
            "EN 12167: lowest proof strength of drawn bar of 3 to 20 mm; brass as extruded may "
            "have 110 MPa.",
        ),
    ),
    "CuBe": MaterialRecord(
        young=131e9,
        poisson=0.30,
        density=8360.0,
        source="Data sheets of C17200 (alloy 25) after age hardening: 19e6 psi and 0.302 lb/in3; others "
        "give 0.298 lb/in3, and Poisson's ratios of 0.285 to 0.33.",
        other_names=(
            "C17200",
            "CuBe2",
            "alloy 25",
            "beryllium copper",
            "copper beryllium",
            "BeCu",
            "CW101C",
        ),
        strength=YieldStrength(
            860e6,
            "ASTM B196, bar up to 76 mm in temper TF00 (age hardened without cold work): minimum, "
            "125 ksi; solution annealed bar (TB00) has 140 MPa.",
        ),
    ),
    "silicon nitride": MaterialRecord(
        young=310e9,
        poisson=0.27,
        density=3200.0,
        source="SKF, brochure on hybrid bearings: Young's modulus and density of dense balls; makers give 300 "
        "to 315 GPa, and Poisson's ratios of 0.26 to 0.27.",
        other_names=("Si3N4",),
    ),
    "PEEK": MaterialRecord(
        young=4.0e9,
        poisson=0.40,
        density=1300.0,
        source="Victrex PEEK 450G, data sheet (ISO 527, 23 degC), as other tables quote it; for unfilled PEEK, others "
        "give 3.6 GPa and 1320 kg/m3. Poisson's ratio: typical value. This material creeps.",
        other_names=("PEEK 450G", "Victrex PEEK"),
        strength=YieldStrength(
            98e6,
            "Victrex PEEK 450G, data sheet (ISO 527), as other tables quote it; for unfilled PEEK, others "
            "give 90 to 100 MPa.",
        ),
    ),
    "DLC": MaterialRecord(
        young=259e9,
        poisson=0.25,
        density=2070.0,
        source="Nature Communications (2021), doi 10.1038/s41467-021-24766-6, table 1: a-C:H with 20 % "
        "hydrogen; there ta-C has 490 to 630 GPa; softer a-C:H has 100 GPa. Poisson's ratio assumed.",
        other_names=("a-C:H", "diamond-like carbon"),
    ),
    "Cr": MaterialRecord(
        young=235e9,
        poisson=0.21,
        density=7150.0,
        source="Assumed value for electroplated hard chromium, between 191 GPa (Coatings 12 (2022) 354, "
        "trivalent bath) and 279 GPa of the dense metal, whose density and Poisson's ratio are used.",
        other_names=("chromium", "hard chromium", "hard chrome", "chrome"),
    ),
    "TiN": MaterialRecord(
        young=450e9,
        poisson=0.25,
        density=5210.0,
        source="Assumed value for a dense PVD coating; reported values of Young's modulus are 250 to "
        "590 GPa. Density: CRC Handbook. The case of the name counts: tin is another material.",
        other_names=("titanium nitride",),
    ),
}


def normalise_material_name(name: str) -> str:
    """Return the name of a material with case folded and separators removed, for comparisons."""
    return re.sub(SEPARATORS, "", name.casefold())


@cache
def list_spellings() -> dict[str, str]:
    """Return a dict that maps the normalised spelling of each known name to the name in MATERIALS."""
    spellings = {}
    for name, record in MATERIALS.items():
        for spelling in (name, *record.other_names):
            spellings[normalise_material_name(spelling)] = name
    return spellings


def find_material_name(written_name: str) -> str | None:
    """Return the name in MATERIALS that a written name refers to, or None if it is unknown."""
    spelling = normalise_material_name(written_name)
    name = list_spellings().get(spelling)
    if is_case_sensitive(spelling) and re.sub(SEPARATORS, "", written_name) != name:
        return None
    return name


def is_case_sensitive(spelling: str) -> bool:
    """Return whether a normalised spelling denotes a material only in the letter case of its name."""
    return spelling in map(str.casefold, CASE_SENSITIVE_NAMES)


def advise_on_material(written_name: str) -> str:
    """Return a hint for an unknown material name: the most similar names and the list of all names."""
    spellings = list_spellings()
    written = normalise_material_name(written_name)
    near_spellings = get_close_matches(written, spellings, len(spellings), MIN_SIMILARITY)
    if len(written) >= MIN_PREFIX_LENGTH:
        longer = [spelling for spelling in spellings if spelling.startswith(written)]
        near_spellings = [*longer, *near_spellings]
    near_names = list(dict.fromkeys(spellings[spelling] for spelling in near_spellings))
    quoted_names = " or ".join(f"'{name}'" for name in near_names[:MAX_NEAR_NAMES])
    question = f"did you mean {quoted_names}? " if near_names else ""
    return f"{question}use one of {', '.join(MATERIALS)}"
