"""Definitions of the quantities of compare, profile and wear between two runs, by name."""

from ..surface.compare.records import COMPARISON_DEFINITIONS
from ..surface.roughness.areal import AREAL_DEFINITIONS
from ..surface.roughness.parameters import PROFILE_DEFINITIONS, WAVES_DEFINITIONS
from .answer import Definition

# names in a track -> names in compare.json and in the answer
RENAMED_TRACK_QUANTITIES = {"depth_mean": "track_depth"}


def name_in_track(name: str) -> str:
    """Return the name that a quantity of a wear track has in the answer of a comparison, such as "track_depth"."""
    return RENAMED_TRACK_QUANTITIES.get(name, f"track_{name}")


def _collect_definitions() -> dict[str, Definition]:
    """Return the definitions of all quantities except those of a track, by name."""
    meanings = WAVES_DEFINITIONS | COMPARISON_DEFINITIONS
    for letter, profile in (("P", "levelled trace"), ("R", "roughness profile"), ("", "profile")):
        for name, (unit, text) in PROFILE_DEFINITIONS.items():
            # material ratios of a roughness profile have no letter. Of a trace as a whole there is Pt in place of Pz.
            is_used = name != "z" if letter == "P" else name.startswith("Mr") == (not letter)
            if is_used:
                meanings.setdefault(letter + name, (unit, f"{text}, of the {profile}"))
    return {name: Definition(*one) for name, one in (meanings | AREAL_DEFINITIONS).items()}


SURFACE_QUANTITIES = _collect_definitions()


def find_surface_definition(name: str) -> Definition | None:
    """Return the definition of a quantity of compare, pairs or profile; None if there is none.

    Quantities of a track have the names of those of a whole comparison behind "track_".
    """
    if name in SURFACE_QUANTITIES:
        return SURFACE_QUANTITIES[name]
    for part, (unit, text, _) in SURFACE_QUANTITIES.items():
        if name == name_in_track(part):
            return Definition(unit, f"{text}; of the longest track")
    return None
