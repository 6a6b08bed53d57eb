"""All rules on combinations of keys of a scene, and the kind of run that the tables define.

A rule sees the tables as far as they could be read and is silent about values that are missing.
"""

from ...effects import law_has_trait
from .accuracy import check_quadrature, check_settings
from .contact import check_patches
from .drive import check_drive, check_length
from .friction import check_laws
from .grooves import check_grooves
from .needed_keys import check_needed_keys
from .scene_draft import SceneDraft
from .structure import check_energy_gain, check_structure
from .together import check_together
from .wear import check_wear

# Tables that decide the kind of a scene
RUN_TABLES = ("contact", "normal", "friction", "slide", "structure", "drive", "wear")


def check_scene(draft: SceneDraft) -> str:
    """Add all mistakes of a scene to its draft, and return the kind of scene.

    The kind is "patch", "bench", "rig" or "linear", or "" if the tables define none.
    """
    check_needed_keys(draft)
    check_patches(draft)
    check_laws(draft)
    check_structure(draft)
    check_drive(draft)
    _check_slide(draft)
    check_wear(draft)
    check_grooves(draft)
    kind = find_kind(draft)
    for check_table in (
        check_together,
        check_quadrature,
        check_settings,
        _remark_unused_motions,
        _check_sliding,
        check_length,
        check_energy_gain,
    ):
        check_table(draft, kind)
    return kind


def _check_slide(draft: SceneDraft) -> None:
    """Report mistakes inside [slide] of a scene draft."""
    scene = draft.values
    slide = scene.slide
    if slide.kind in ("constant", "dwell") and slide.distance == 0:
        draft.add_mistake("slide.distance", f"must be > 0 m for kind '{slide.kind}'")
    law = scene.friction
    grows_at_rest = law_has_trait(law.law, "bonds") and law.rest_growth
    is_timeless = law_has_trait(law.law, "timeless") or law_has_trait(law.law, "bonds")
    if slide.kind == "dwell" and slide.hold and is_timeless and not grows_at_rest:
        draft.add_remark(
            "slide.hold",
            "has no effect, because no bond grows at rest; add friction.rest_growth and slip_growth to law 'nonlocal'",
        )


def find_kind(draft: SceneDraft) -> str:
    """Return the kind of run that the tables of a draft define, "" if they define none.

    It is "patch" for [contact] alone, "bench" with [slide], "linear" for a structure without friction, and else "rig".
    """
    tables = {name for name in RUN_TABLES if draft.has(name)}
    if draft.has("structure.interface"):
        # Each interface holds a law and a load, which count here as the tables [friction] and [normal].
        tables = tables - {"contact"} | {"friction", "normal"}
    if "contact" in tables:
        tables.discard("normal")
    has_rig = bool(tables & {"structure", "drive"})
    if not tables or ("slide" in tables and has_rig):
        return ""
    if tables == {"contact"}:
        return "patch"
    if "slide" in tables:
        return "bench"
    return "linear" if tables == {"structure", "drive"} else "rig"


def _remark_unused_motions(draft: SceneDraft, kind: str) -> None:
    """Add a remark on each `normal`, `pitch` or `yaw` of a mode in a scene of the kind "linear".

    These motions of the patch have no effect without friction.
    """
    for index, mode in enumerate(draft.values.structure.mode if kind == "linear" else ()):
        for key in filter(mode.__getitem__, ("normal", "pitch", "yaw")):
            draft.add_remark(
                f"structure.mode.{index}.{key}",
                "has no meaning in a linear scene, which has no friction, and is not used",
            )


def _check_sliding(draft: SceneDraft, kind: str) -> None:
    """Report a draft, of the kind "rig", in which no mode moves the patch."""
    modes = tuple(draft.values.structure.mode) if kind == "rig" else ()
    if modes and all(mode.slide == 0 for mode in modes):
        draft.add_mistake(
            "structure.mode.0.slide",
            "`slide` is 0 in every mode, so nothing slides at the patch; give `slide` for the mode that moves the "
            "patch, or leave out [friction] and the load",
        )
