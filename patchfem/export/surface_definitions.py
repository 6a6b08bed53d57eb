"""Definitions of the quantities of compare, profile and wear between two runs, by name."""

from ..surface.compare.records import DEFINITIONS
from ..surface.roughness.areal import AREAL
from ..surface.roughness.parameters import PROFILE, WAVES
from .answer import Definition

# names in a track -> names in compare.json and in the answer
TRACK_NAMES = {"depth_mean": "track_depth"}

# quantities that have the same meaning between two scans, two traces and two runs
_MEANINGS = {
    "worn_volume": ("m3", "volume lost in the part that both surfaces show"),
    "worn_depth_mean": (
        "m",
        "mean depth of the lost material over the part that both surfaces show",
    ),
    "worn_depth_max": ("m", "largest depth of the lost material"),
    "worn_area": ("m2", "lost area of the section, which is the lost volume per width"),
    "worn_share": ("1", "fraction of the part that both surfaces show that is worn"),
    "hidden_wear": (
        "m",
        "mean of an even or wedge-shaped wear, which measured surfaces show as an offset or tilt of the datum",
    ),
    "track_hidden_wear": (
        "m",
        "mean of the even or wedge-shaped wear of the worn part, which a trace of this part alone cannot show",
    ),
    "wear_coefficient": (
        "m2 N-1",
        "coefficient of Archard's law with which the computed depth of a run fits the measured depth",
    ),
    "patch_centre": ("m", "middle of the patch, in x of the second trace"),
    "difference_rms": (
        "m",
        "root mean square of measured less computed depth over the patch, with the fitted coefficient",
    ),
}


def name_in_track(name: str) -> str:
    """Return the name in an answer of a quantity of a track."""
    return TRACK_NAMES.get(name, f"track_{name}")


def list_names() -> list[str]:
    """Return the names of all quantities that `find` defines.

    Quantities of a track have the names of the same quantities of a whole comparison, without the prefix "track_".
    """
    heights = [f"P{name}" for name in PROFILE if name != "z"]
    roughness = [name if name.startswith("Mr") else f"R{name}" for name in PROFILE]
    return list(dict.fromkeys([*_MEANINGS, *WAVES, *DEFINITIONS, *heights, *roughness, *AREAL]))


def find(name: str) -> Definition | None:
    """Return the definition of a quantity of compare, pairs or profile; None if there is none."""
    for table in (_MEANINGS, WAVES, DEFINITIONS, AREAL):
        if name in table:
            return Definition(*table[name])
    for letter, profile in (("P", "levelled trace"), ("R", "roughness profile"), ("", "profile")):
        if name.startswith(letter) and name.removeprefix(letter) in PROFILE:
            unit, text = PROFILE[name.removeprefix(letter)]
            return Definition(unit, f"{text}, of the {profile}")
    for part, (unit, text) in DEFINITIONS.items():
        if name == name_in_track(part):
            return Definition(unit, f"{text}; of the longest track")
    return None
