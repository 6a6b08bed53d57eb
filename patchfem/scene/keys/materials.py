"""Materials known by name: elastic constants, density and yield strength of materials.toml.

A scene may write a name in any spelling: case, blanks, hyphens and underscores do not count.

>>> find_material_name("ti64"), find_material_name("inconel-718"), find_material_name("1.4404")
('Ti-6Al-4V', 'Inconel 718', '316L')
"""

import re
import tomllib
from collections.abc import Sequence
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import NamedTuple

IGNORED_SEPARATORS_PATTERN = r"[\s_-]"  # characters that are ignored in the name of a material


class YieldStrength(NamedTuple):
    """Yield strength in tension [Pa] at 20 degC, with the source of the number."""

    strength: float
    source: str


class MaterialRecord(NamedTuple):
    """Isotropic elastic constants and other properties of one material at 20 degC.

    - young, poisson, density: Young's modulus [Pa], Poisson's ratio [1] and density [kg m-3].
    - source: source of these three numbers.
    - other_names: names that mean the same material.
    - strength: yield strength; None for a material that breaks before it yields, or whose yield
      strength is not known.
    """

    young: float
    poisson: float
    density: float
    source: str
    other_names: Sequence[str] = ()
    strength: YieldStrength | None = None


def _read_materials() -> dict[str, MaterialRecord]:
    """Return the records of materials.toml by name."""
    text = Path(__file__).with_name("materials.toml").read_text(encoding="utf-8")
    materials = {}
    for name, row in tomllib.loads(text).items():
        strength = YieldStrength(**row.pop("strength")) if "strength" in row else None
        materials[name] = MaterialRecord(**row, strength=strength)
    return materials


# Materials of the package by name
MATERIALS = _read_materials()


def normalise_material_name(name: str) -> str:
    """Return the name of a material with case folded and separators removed, for comparisons."""
    return re.sub(IGNORED_SEPARATORS_PATTERN, "", name.casefold())


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
    if is_case_sensitive(spelling) and re.sub(IGNORED_SEPARATORS_PATTERN, "", written_name) != name:
        return None
    return name


def is_case_sensitive(spelling: str) -> bool:
    """Return whether a normalised spelling denotes a material only in the letter case of its name."""
    # Names with another meaning in other letter case: tin is a metal of about 50 GPa.
    return spelling in map(str.casefold, ("TiN",))


def advise_on_material(written_name: str) -> str:
    """Return a hint for an unknown material name: the most similar names and all names.

    `written_name` is the name as the scene has it.
    """
    spellings = list_spellings()
    written = normalise_material_name(written_name)
    # Smallest similarity ratio (difflib) for a proposal; below it, the numbers of all steels look
    # alike.
    near_spellings = get_close_matches(written, spellings, len(spellings), 0.7)
    # Smallest number of characters for which the beginning of a name is compared
    if len(written) >= 3:
        longer = [spelling for spelling in spellings if spelling.startswith(written)]
        near_spellings = [*longer, *near_spellings]
    near_names = list(dict.fromkeys(spellings[spelling] for spelling in near_spellings))
    # Largest number of materials that are proposed for an unknown name
    quoted_names = " or ".join(f"'{name}'" for name in near_names[:3])
    question = f"did you mean {quoted_names}? " if near_names else ""
    return f"{question}use one of {', '.join(MATERIALS)}"
