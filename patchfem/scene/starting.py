"""Scenes to start from, one for each kind of question; each runs unchanged within seconds."""

from pathlib import Path

from ..core import Missing, PatchfemError
from .keys.types import advise_on_name

# Folder of the template scenes
TEMPLATE_FOLDER = Path(__file__).parent / "templates"
# Description of each template scene, by its kind
TEMPLATE_DESCRIPTIONS = {
    "patch": "two coated pieces pressed together: contact area, pressure and stiffness",
    "area": "a crowned pad pressed off centre: pressure, stick and slip over the face",
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
# Verb of patchfem for each kind of scene that does not use `run`.
NEXT_VERB_BY_KIND = {
    "beam": "backbone",
    "damper": "sweep",
    "shroud": "sweep",
    "misalignment": "sweep",
}


def read_template(kind: str) -> str:
    """Return the text of the template `kind`, a word of TEMPLATE_DESCRIPTIONS.

    Raises PatchfemError for any other word.
    """
    if kind not in TEMPLATE_DESCRIPTIONS:
        raise PatchfemError(
            f"{kind}: unknown kind of scene; {advise_on_name(kind, TEMPLATE_DESCRIPTIONS)}"
        )
    return (TEMPLATE_FOLDER / f"{kind}.toml").read_text(encoding="utf-8")


def find_shipped_scene() -> Path:
    """Return the path of the example scene, a rig with measured responses.

    It lies in `studies/rig` of a checkout and in `templates/shipped` of an installed package. Raises
    Missing if it was removed from the installation.
    """
    for folder in (TEMPLATE_FOLDER / "shipped", TEMPLATE_FOLDER.parents[2] / "studies" / "rig"):
        if (folder / "rig.toml").is_file():
            return folder / "rig.toml"
    raise Missing("the example scene is missing from this installation; install patchfem again")
