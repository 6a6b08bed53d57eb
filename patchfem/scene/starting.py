"""Scenes to start from, one file per kind of question; each runs as it stands, in seconds.

`text_of` gives the text of one. `shipped` is the place of the scene of the rig with the rows measured on it, which lies
in `studies/rig` of a checkout and in `templates/shipped` of an installed package.
"""

from pathlib import Path

from ..core import Missing, PatchfemError
from .keys.types import choices

HERE = Path(__file__).parent / "templates"
KINDS = {
    "patch": "two coated pieces pressed together: contact area, pressure and stiffness",
    "joint": "a bolted lap joint moved to and fro: friction loop, stiffness and damping",
    "bench": "a friction law at one contact point, along a prescribed slide",
    "rig": "a rubbing block on flexures, shaken at one frequency",
    "beam": "a beam with a bolted lap joint: frequency and damping at each amplitude of vibration",
    "damper": "a sweep: the under-platform damper that reduces a blade's amplitude at resonance most",
    "shroud": "a sweep: resonances of blades that rub at their shrouds, for each nodal diameter",
    "linear": "a mass on flexures, without friction",
    "misalignment": "a sweep: how far the patch in the rig of the 1985 report may be tilted",
    "wear": "how a tilted patch wears in over many cycles",
}
# else run
NEXT = {
    "beam": "backbone",
    "damper": "sweep",
    "shroud": "sweep",
    "misalignment": "sweep",
}


def text_of(kind: str) -> str:
    """The text of a scene of one of KINDS; PatchfemError for any other word."""
    if kind not in KINDS:
        raise PatchfemError(f"{kind}: unknown kind of scene; {choices(kind, KINDS)}")
    return (HERE / f"{kind}.toml").read_text(encoding="utf-8")


def shipped() -> Path:
    """The scene of the rig that comes with the program; Missing where it was taken out of the installation."""
    for folder in (HERE / "shipped", HERE.parents[2] / "studies" / "rig"):
        if (folder / "rig.toml").is_file():
            return folder / "rig.toml"
    raise Missing("the example scene is missing from this installation; install patchfem again")
