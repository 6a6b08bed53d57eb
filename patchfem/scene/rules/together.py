"""Keys that need, exclude or idle beside keys of other tables: one row for each such case.

A row is a condition and its sentence. The clauses of a condition are joined by `&`: `structure.mode` holds where the scene
has this key or table, `friction|wear` where it has one of them, `!structure.file` where it does not, and
`drive.kind=force|free` where the key has one of these values; `kind` is the kind of the scene, and `patch` stands for
[contact] and for the patch of each interface. The first clause names the key of the message. What a table needs by its own
selectors stands in `keys.choices`, and what no run can compute together in `support`.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

from ...effects import GAP_SHAPES, LAWS, WAVEFORMS, law_takes_stiffness_or_length
from .contact import iterate_patches
from .outlines import END_KEYS, PIECE_NAMES
from .scene_draft import SceneDraft
from .structure import LOCATION_KEYS, MODES_ADVICE

PIECE_KEYS = [f"patch.{name}.{key}" for name in PIECE_NAMES for key in ("length", *END_KEYS)]
INTERFACE_EXCLUDES = (
    "and [[structure.interface]] exclude each other: each interface has its own law and load"
)
# The law takes a stiffness or the bond length that determines it.
TAKES_EITHER = f"friction.law={'|'.join(filter(law_takes_stiffness_or_length, LAWS))}"
OTHER_WAVEFORMS = (
    f"drive.waveform={'|'.join(name for name, wave in WAVEFORMS.items() if not wave.is_sine)}"
)
JOINS_MASSES = f"joins masses, which cannot be used with [contact]; {MODES_ADVICE}"
MISTAKES = {
    # tables
    "friction & structure.interface": f"[friction] {INTERFACE_EXCLUDES}",
    "normal & structure.interface": f"[normal] {INTERFACE_EXCLUDES}",
    "contact & structure.interface": f"[contact] {INTERFACE_EXCLUDES}; move [contact] into the interface that it presses, "
    "as [structure.interface.contact] in place of `load`",
    "normal & contact & !structure.interface": "[contact] and [normal] exclude each other: keep one source of the normal "
    "load",
    **dict.fromkeys(
        ("slide & structure", "slide & drive"),
        "[slide] prescribes the motion, but [structure] with [drive] computes the motion: keep only [slide], or only "
        "[structure] with [drive]",
    ),
    "contact.grooves & kind=patch": "[contact.grooves] needs a sliding motion: add [friction] with [slide], or with "
    "[structure] and [drive]",
    # patches
    **dict.fromkeys(
        (f"{key} & patch.mesh" for key in PIECE_KEYS),
        "cannot be used with contact.mesh, because the mesh file gives the shape of the pieces: leave one of the two keys "
        "out",
    ),
    "patch.mesh_unit & !patch.mesh": "is the unit of the file of contact.mesh, which is missing: leave mesh_unit out",
    "patch.strips.offset & patch.strips.roll": "`offset` leaves the rotation about x free, but contact.strips.roll "
    "prescribes this rotation: keep only one of these two keys",
    "patch.strips.offset & patch.approach": "a load line needs a load: use contact.load in place of [contact.approach]",
    "patch.load_line & patch.tilt.angle & !patch.holder": "cannot be used with contact.tilt.angle unless [contact.holder] "
    "is given: a piece that is free to rotate has no prescribed angle; leave out one of these two keys, or add the spring "
    "of [contact.holder]",
    "patch.asperities.cutoff & !patch.profile & !patch.asperities.from & !patch.asperities.rms_height": "separates the "
    "long waves of a trace from the short ones, but the scene has no trace: add [contact.profile] or `from`, or leave "
    "this key out",
    # rigs
    "structure.masses & contact & kind=rig & !structure.interface": f"structure.masses cannot be used with [contact]; "
    f"{MODES_ADVICE}, or keep the masses, write the friction law in [[structure.interface]] and the patch in "
    "[structure.interface.contact]",
    "structure.start & drive.displacement & drive.kind=free": "[structure.start] and drive.displacement exclude each other: "
    "keep one",
    "drive.mass & structure.mode & !drive.kind=base": "applies only to structure.masses, but a structure of "
    "[[structure.mode]] is driven at its output point: leave drive.mass out",
    "structure.spring & !structure.masses & contact": JOINS_MASSES,
    "structure.damper & !structure.masses & contact": JOINS_MASSES,
    **dict.fromkeys(
        (f"structure.{key} & !structure.file" for key in LOCATION_KEYS),
        "names a place in a universal file, but the scene has no such file; give structure.file",
    ),
    "structure.measured_joint & !structure.measured=stuck": "names the joint that is subtracted from the modes, but nothing "
    'is subtracted; add measured = "stuck" or leave `measured_joint` out',
    "structure.measured=stuck & !friction.law|friction.static & !structure.interface": "'stuck' subtracts the stiffness of "
    "the joint from the modes, but this scene has no joint; add [friction] and its load, or leave `measured` out",
    "structure.reduced.slide & structure.interface": "applies only to [friction]; a [[structure.interface]] names its two "
    "sides with the key `between`: leave structure.reduced.slide out",
    # wear
    "wear.friction & normal": "a [normal] contact has no area, so its wear has no depth: use [contact]",
    "wear.start & normal": "[normal] is a point and has no worn depth to start from: use [contact], or leave wear.start out "
    "and add the worn volumes of both runs",
    f"wear.friction.bond_length_factor & friction.stiffness & {TAKES_EITHER}": "has no meaning with friction.stiffness; "
    "give friction.bond_length in place of friction.stiffness",
}
WITHOUT_PATCH = "has no meaning without [contact] and is not used"
REMARKS = {
    "patch.element_size & patch.mesh": "is not used, because the file of contact.mesh gives the elements",
    "patch.length & patch.upper.length & patch.lower.length": "is not used: [contact.upper] and [contact.lower] set their "
    "own lengths",
    **dict.fromkeys(
        (
            "contact.holder.tangential_stiffness & kind=patch",
            # The angle of a tilt depends on the piece.
            *(f"contact.{name}.on=lower & kind=patch" for name in GAP_SHAPES if name != "tilt"),
            "contact.profile.on=lower & kind=patch",
        ),
        "has no meaning in a patch scene, where nothing slides, and is not used",
    ),
    "contact.grooves.lifted_mass & slide": "has no meaning with [slide], because a prescribed slide has no inertia, and is "
    "not used",
    "normal.grooves.lifted_mass & slide": "has no meaning with [slide], because a prescribed slide has no inertia, and is "
    "not used",
    "normal.width & !friction.spread": "has no meaning without friction.spread and is not used",
    "structure.moving_mass & structure.masses": "has no meaning with structure.masses and is not used",
    "structure.moving_mass & structure.reduced": "has no meaning with structure.reduced and is not used",
    "structure.reduced.moved & drive.kind=force|free": "is not used, because it applies only to a base drive",
    f"measured.reading=fundamental|rms|lowpass & {OTHER_WAVEFORMS}": "has a meaning only under a sine drive and is not used",
    "wear.jumps & normal": WITHOUT_PATCH,
    "wear.upper_share & normal": WITHOUT_PATCH,
    "wear.upper_share & !normal & !contact.grooves & !contact.coating & !contact.upper.coating & "
    "!contact.lower.coating": "has no effect on the measures without grooves or a coating: the measure worn_depth is the "
    "depth worn off both pieces together",
}
MISSING_TABLES = {
    "!drive & structure & kind=rig|linear": "[structure] needs this table",
    "!structure & drive & kind=rig|linear": "[drive] needs this table",
    "!friction & normal|contact|slide|wear & kind=bench|rig & !structure.interface": "a run with a load, a slide or wear "
    "also needs this table",
    "!contact & friction|slide|wear & kind=bench|rig & !normal & !structure.interface": "friction needs a normal load, "
    "[contact] or [normal]",
    "!slide & friction|contact|normal|wear & kind=bench|rig & !structure & !drive": "friction needs a motion, [slide] or "
    "[structure] with [drive]; only `patchfem backbone` needs neither",
    "!contact & !normal & !friction & !slide & !structure & !drive & !wear": "a scene needs [contact] (pressed pieces), or "
    "[structure] with [drive] (a vibrating structure); with [friction] a scene needs a load and a motion",
}
MISSING = {
    "!structure.interface & structure.masses & friction|normal|wear & kind=rig & !contact": "friction between masses needs "
    "an interface: write [[structure.interface]] with `law` and `load` instead of [friction]",
    "!structure.masses & structure.spring & !contact": "structure.spring needs this key",
    "!structure.masses & structure.damper & !contact": "structure.damper needs this key",
    "!drive.displacement & drive.kind=free & !structure.start": "kind 'free' needs this key, the displacement from which "
    "the structure is released; instead you can give [structure.start]",
    "!patch.asperities.normal_stiffness & patch.approach & patch.asperities.law=exponential": "law 'exponential' with "
    "[contact.approach] needs this stiffness at first touch, because the approach is measured from first touch",
}


def check_together(draft: SceneDraft, kind: str) -> None:
    """Report the keys of a scene that need, exclude or idle beside keys of other tables."""
    patches = [key for key, _ in iterate_patches(draft)]
    for rows, report in (
        (MISTAKES, draft.add_mistake),
        (REMARKS, draft.add_remark),
        (MISSING_TABLES, draft.add_missing_table),
        (MISSING, draft.add_missing),
    ):
        for condition, sentence in rows.items():
            for patch in patches if "patch." in condition else [""]:
                condition_here = condition.replace("patch.", f"{patch}.")
                if holds(draft, kind, condition_here):
                    report(_split_condition(condition_here)[0].keys[0], sentence)


def holds(draft: SceneDraft, kind: str, condition: str) -> bool:
    """Return whether all clauses of a condition hold in a scene.

    Parameters
    ----------
    draft : SceneDraft
        Scene with its written values.
    kind : str
        Kind of the scene.
    condition : str
        Clauses as in the rows of this module.
    """
    for clause in _split_condition(condition):
        written = (kind if key == "kind" else draft.written_value(key) for key in clause.keys)
        if clause.is_negated == any(clause.accepts(value) for value in written):
            return False
    return True


class _Clause(NamedTuple):
    """Clause of a condition: its keys, and the values that one of them has, () for any."""

    is_negated: bool
    keys: tuple[str, ...]
    values: tuple[str, ...]

    def accepts(self, written: Any) -> bool:
        """Return whether the clause, without its `!`, holds for the written value of a key."""
        return written is not None and (not self.values or str(written) in self.values)


@lru_cache(4096)
def _split_condition(condition: str) -> list[_Clause]:
    """Return the clauses of a condition."""
    clauses = []
    for text in condition.split(" & "):
        keys, _, values = text.removeprefix("!").partition("=")
        names = tuple(filter(None, values.split("|")))
        clauses.append(_Clause(text.startswith("!"), tuple(keys.split("|")), names))
    return clauses
