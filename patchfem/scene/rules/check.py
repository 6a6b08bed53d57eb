"""All rules on combinations of keys of a scene, and the kind of run that the tables define.

A rule sees the tables as far as they could be read and is silent about values that are missing.
"""

from __future__ import annotations

from ...effects import find_waveform, law_has_trait
from ..keys.tables import Friction
from .accuracy import check_quadrature, check_settings
from .contact import check_patches
from .drive import check_drive, check_length
from .friction import check_laws
from .grooves import check_grooves
from .needed_keys import check_needed_keys
from .rule_table import MistakeRule, RemarkRule, Rule, TableFacts, apply_rules
from .scene_draft import SceneDraft
from .structure import MODES_ADVICE, check_energy_gain, check_structure
from .wear import check_wear

RUN_TABLES = ("contact", "normal", "friction", "slide", "structure", "drive", "wear")


class SimpleFacts(TableFacts):
    """Properties of the scene that the checks of small tables use."""

    @property
    def is_sine(self) -> bool:
        """Whether the drive signal is a sine."""
        return find_waveform(self.draft.tables.drive).is_sine

    @property
    def is_law_independent_of_rest_time(self) -> bool:
        """Whether the friction force does not depend on the time at rest."""
        law = self.draft.tables.friction
        return law is not None and _is_independent_of_rest_time(law)


NORMAL_RULES = (
    RemarkRule(
        lambda n: n.has("width") and not n.draft.has("friction.spread"),
        "normal.width",
        "has no meaning without friction.spread and is not used",
    ),
)
MEASURED_RULES = (
    RemarkRule(
        lambda m: m.reading in ("fundamental", "rms", "lowpass") and not m.is_sine,
        "measured.reading",
        "has a meaning only under a sine drive and is not used",
    ),
)
SLIDE_RULES = (
    MistakeRule(
        lambda s: s.kind in ("constant", "dwell") and s.distance == 0.0,
        "slide.distance",
        "must be > 0 m for kind '{kind}'",
    ),
    RemarkRule(
        lambda s: s.kind == "dwell" and s.hold and s.is_law_independent_of_rest_time,
        "slide.hold",
        "has no effect, because no bond grows at rest; add friction.rest_growth and slip_growth to law 'nonlocal'",
    ),
)


def check_scene(draft: SceneDraft) -> str:
    """Report all mistakes of a scene; return the kind of scene, or "" if the tables define none."""
    check_needed_keys(draft)
    check_patches(draft)
    _check_table(draft, "normal", NORMAL_RULES)
    check_laws(draft)
    _check_table(draft, "slide", SLIDE_RULES)
    check_structure(draft)
    check_drive(draft)
    _check_table(draft, "measured", MEASURED_RULES)
    kind = _find_kind(draft)
    for check_table in (
        check_quadrature,
        check_settings,
        _remark_unused,
        _check_sliding,
        check_length,
        check_wear,
        check_grooves,
        check_energy_gain,
    ):
        check_table(draft, kind)
    return kind


def _check_table(draft: SceneDraft, name: str, rules: tuple[Rule, ...]) -> None:
    """Report mistakes in one of the tables [normal], [slide] or [measured]."""
    table = getattr(draft.tables, name)
    if table is None:
        return
    facts = SimpleFacts(draft, name, table)
    apply_rules(draft, rules, facts)


def _is_independent_of_rest_time(law: Friction) -> bool:
    """Return whether the force of a law does not depend on the time at rest."""
    return law_has_trait(law.law, "timeless") or (
        law_has_trait(law.law, "bonds") and law.rest_growth is None
    )


def _find_kind(draft: SceneDraft) -> str:
    """Return the kind of run that the tables define; report missing and conflicting tables."""
    tables = {name for name in RUN_TABLES if draft.has(name)}
    if draft.has("structure.interface"):
        for name in sorted(tables & {"friction", "normal", "contact"}):
            instead = ""
            if name == "contact":
                instead = (
                    "; move [contact] into the interface that it presses, as [structure.interface.contact] in place "
                    "of `load`"
                )
            draft.add_mistake(
                name,
                f"[{name}] and [[structure.interface]] exclude each other: each interface has its own law and load"
                f"{instead}",
            )
        # Each interface holds a law and a load, which count here as the
        # tables [friction] and [normal].
        tables = tables - {"contact"} | {"friction", "normal"}
    if {"contact", "normal"} <= tables:
        draft.add_mistake(
            "normal",
            "[contact] and [normal] exclude each other: keep one source of the normal load",
        )
        tables.discard("normal")
    if "slide" in tables and tables & {"structure", "drive"}:
        draft.add_mistake(
            "slide",
            "[slide] prescribes the motion, but [structure] with [drive] computes the motion: keep only [slide], or "
            "only [structure] with [drive]",
        )
        return ""
    if tables == {"contact"}:
        return "patch"
    if tables == {"structure", "drive"}:
        return "linear"
    return _find_moving_kind(draft, tables)


def _find_moving_kind(draft: SceneDraft, tables: set[str]) -> str:
    """Return whether a scene with friction is a bench or a rig; report missing tables."""
    if not tables:
        draft.add_missing_table(
            "contact",
            "a scene needs [contact] (pressed pieces), or [structure] with [drive] (a vibrating structure); with "
            "[friction] a scene needs a load and a motion",
        )
        return ""
    has_rig = bool(tables & {"structure", "drive"})
    if has_rig and "drive" not in tables:
        draft.add_missing_table("drive", "[structure] needs this table")
    if has_rig and "structure" not in tables:
        draft.add_missing_table("structure", "[drive] needs this table")
    if tables - {"structure", "drive"}:
        _require_friction(draft, tables, has_rig)
    return "bench" if "slide" in tables else "rig"


def _require_friction(draft: SceneDraft, tables: set[str], has_rig: bool) -> None:
    """Report tables that a run with friction lacks."""
    if "friction" not in tables:
        others = ", ".join(f"[{name}]" for name in sorted(tables))
        draft.add_missing_table("friction", f"a run with {others} also needs this table")
    if draft.has("structure.masses") and not draft.has("structure.interface"):
        if "contact" in tables:
            draft.add_mistake(
                "structure.masses",
                f"structure.masses cannot be used with [contact]; {MODES_ADVICE}, or keep the masses, write the "
                "friction law in [[structure.interface]] and the patch in [structure.interface.contact]",
            )
        else:
            draft.add_missing(
                "structure.interface",
                "friction between masses needs an interface: write [[structure.interface]] with `law` and `load` "
                "instead of [friction]",
            )
    if not tables & {"contact", "normal"}:
        draft.add_missing_table("contact", "friction needs a normal load, [contact] or [normal]")
    if not has_rig and "slide" not in tables:
        draft.add_missing_table(
            "slide",
            "friction needs a motion, [slide] or [structure] with [drive]; only `patchfem backbone` needs neither",
        )


def _remark_unused(draft: SceneDraft, kind: str) -> None:
    """Add remarks on keys that have no effect because the scene has no sliding or no friction."""
    if kind == "patch" and draft.tables.contact is not None:
        shapes = draft.tables.contact.shapes.items()
        keys = [f"{name}.on" for name, shape in shapes if shape.on == "lower" and name != "tilt"]
        if draft.has("contact.holder.tangential_stiffness"):
            keys.insert(0, "holder.tangential_stiffness")
        for key in keys:
            draft.add_remark(
                f"contact.{key}",
                "has no meaning in a patch scene, where nothing slides, and is not used",
            )
    if kind == "linear":
        for key in ("normal", "pitch", "yaw"):
            for index, mode in enumerate(draft.values.structure.mode):
                if mode[key]:
                    draft.add_remark(
                        f"structure.mode.{index}.{key}",
                        "has no meaning in a linear scene, which has no friction, and is not used",
                    )


def _check_sliding(draft: SceneDraft, kind: str) -> None:
    """Report a rig in which no mode moves the patch."""
    modes = draft.values.structure.mode if kind == "rig" else ()
    if modes and all(mode.slide == 0 for mode in modes):
        draft.add_mistake(
            "structure.mode.0.slide",
            "`slide` is 0 in every mode, so nothing slides at the patch; give `slide` for the mode that moves the "
            "patch, or leave out [friction] and the load",
        )
