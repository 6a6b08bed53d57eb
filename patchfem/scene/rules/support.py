"""Combinations of effects that a scene may contain but no run can compute: the table UNSUPPORTED_COMBINATIONS.

Each row of support.toml names features and says what to do instead, and why; LIMITS.md lists the rows and defines the
features. A feature is a key (`structure.stiffening`), a key with a value (`drive.kind=free`) or a row of JOINT_FEATURES;
keys of the patch of a joint begin with `patch`. To support a combination, delete its row. What single engines of a rig can
compute stands in `methods`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from functools import cache, cached_property, reduce
from pathlib import Path
from typing import Any, NamedTuple

from ...effects import (
    LAWS,
    describe_unsupported,
    find_waveform,
    law_has_trait,
)
from ..keys.contact import Contact
from ..keys.tables import Friction
from .facts import TableFacts
from .methods import (
    check_accuracy_method,
    describe_load_change,
    find_climbed_grooves,
    find_heave_key,
    find_yaw_key,
)
from .scene_draft import SceneDraft
from .structure import find_instrument_key
from .view import ViewValue, wrap_value

# Features of the whole scene: their rows are tried once, also where no law could be read.
SCENE_FEATURES = ("wear", "structure.measured=stuck", "sensor apart from the output")
# Keys of a scene whose joint has no single stiffness that could be subtracted from measured modes
VARIABLE_STIFFNESS_KEYS = (
    "structure.masses",
    "structure.reduced",
    "structure.bonded.wavelength",
    "contact.grooves",
    "normal.grooves",
    "normal.amplitude",
)


class DraftJoint(TableFacts):
    """Friction interface of a scene, with the properties that decide what it can be combined with.

    Parameters
    ----------
    draft : SceneDraft
        Scene that is being read, to which mistakes are added.
    table_key : str
        Dotted key of the law: "friction", or that of an interface between masses.
    law : Friction or None
        Table of the friction law, or None if it could not be read.
    contact : Contact or None
        Patch of the joint.
    kind : str
        Kind of the scene.
    """

    def __init__(
        self,
        draft: SceneDraft,
        table_key: str,
        law: Friction | None,
        contact: Contact | None,
        kind: str,
    ) -> None:
        super().__init__(draft, table_key, law)
        self.kind = kind
        self.contact = wrap_value(contact)
        self.is_interface = table_key != "friction"
        self.patch_key = f"{table_key}.contact" if self.is_interface else "contact"
        self.load_change_description = describe_load_change(self.load_change)
        self.grooves = find_climbed_grooves(draft.tables)
        self.heave_key = find_heave_key(draft.tables)
        self.yaw = find_yaw_key(draft.tables)
        self.instrument_key = find_instrument_key(draft)
        self.wave = find_waveform(draft.tables.drive)

    def find_key_value(self, key: str) -> ViewValue:
        """Return the value of a dotted key of the scene.

        "patch" at its beginning stands for the patch of this joint.
        """
        table, *names = key.split(".")
        return reduce(getattr, names, self.contact if table == "patch" else self.scene[table])

    def has_trait(self, trait: str) -> bool:
        """Return whether the law has a trait, such as "bonds".

        `effects.LAWS` lists them.
        """
        return law_has_trait(self.law or None, trait)

    @cached_property
    def _sides(self) -> dict[str, str]:
        """Piece that has each shape of the patch, "upper" or "lower", by dotted key, such as contact.crown.on."""
        shapes = self.contact.table.shapes if self.contact else {}
        return {f"{self.patch_key}.{name}.on": one.on for name, one in shapes.items() if one.on}

    @property
    def lower_shape(self) -> str:
        """Key of the first shape on the lower piece; "" if there is none, or if shapes lie on both pieces."""
        return next(iter(self._sides)) if set(self._sides.values()) == {"lower"} else ""

    @property
    def opposite_shape(self) -> str:
        """Key of the last gap shape that the scene writes, if shapes lie on both pieces; "" if all lie on one."""
        if len(set(self._sides.values())) < 2:
            return ""
        return next(filter(self.draft.has, reversed(self._sides)), next(iter(self._sides)))

    @property
    def has_unbounded_bonds(self) -> bool:
        """Whether no force can move the bonds at rest: in the law as printed (R/eps)^order is unbounded for them."""
        is_unbounded = self.has_trait("bonds") and self.reading == "report" and -1 < self.order < 0
        return bool(is_unbounded and self.initial_bonds)

    @property
    def load_change_or_grooves(self) -> str:
        """Text of what changes the load on the points of the interface on their way; "" if nothing does."""
        grooves = "" if self.is_interface else self.grooves
        return grooves or (self.load_change and self.kind == "rig" and self.load_change_description)

    @property
    def other_pressure(self) -> str:
        """Key of what gives a pressure besides that of [contact] at rest; "" if nothing does."""
        return self.heave_key or (self.scene.structure.interface and "[[structure.interface]]")

    @property
    def unplaced_motion(self) -> str:
        """Key of a heave, pitch or yaw that the contact cannot follow, because it is a point; "" for none."""
        if self.kind != "rig" or self.contact.area:
            return ""
        is_point = not (self.is_interface or self.contact)
        return self.yaw or (self.heave_key if is_point else "")

    @property
    def variable_stiffness_key(self) -> str:
        """Key of what leaves the joint of measured modes without a single stiffness in stick; "" if it has one."""
        written = [key for key in VARIABLE_STIFFNESS_KEYS if self.find_key_value(key)]
        if any(face.contact for face in self.scene.structure.interface):
            written.append("[structure.interface.contact]")
        return next(filter(None, [*written, self.heave_key, self.yaw]), "")

    @property
    def bounding_key(self) -> str:
        """Key of what makes the motion depend on that of the output; "" if nothing does."""
        if self.wave.has_levels or (
            self.wave.is_swept and self.scene.accuracy.method != "harmonic"
        ):
            return f"drive.waveform = '{self.scene.drive.waveform}'"
        if self.scene.drive.kind == "free":
            return "drive.kind = 'free'"
        keys = ("structure.travel", "structure.stiffening")
        return next(filter(self.find_key_value, keys), "")

    @property
    def is_read(self) -> bool:
        """Whether the properties of the joint are known: it is an interface, or has a known law in a bench or a rig."""
        return self.is_interface or (self.law in LAWS and self.kind in ("bench", "rig"))


class Feature(NamedTuple):
    """Property of a joint that cannot be combined with every other.

    - is_there: property of a DraftJoint that tells whether it has the feature, or a function of it.
    - key: dotted key that causes it; "" for a mere condition. `{name}` in it, and in `words`, stands for a property of
      the joint.
    - words: text for messages; "" for the key itself.
    """

    is_there: Callable[[DraftJoint], Any] | str
    key: str = ""
    words: str = ""

    def describes(self, joint: DraftJoint) -> bool:
        """Return whether a joint has the feature."""
        name = self.is_there
        return bool(getattr(joint, name) if isinstance(name, str) else name(joint))


JOINT_FEATURES = {
    # kinds of scenes and drives
    "rig": Feature(lambda j: j.kind == "rig"),
    "drive other than a sine": Feature(
        lambda j: j.scene.drive.kind == "free" or (j.wave.name and not j.wave.is_sine),
        "drive.waveform",
        "a motion that is not steady",
    ),
    "sensor apart from the output": Feature("instrument_key", "{instrument_key}"),
    "output that bounds the motion": Feature("bounding_key", "{bounding_key}"),
    "joint without a single stiffness": Feature(
        "variable_stiffness_key", "{variable_stiffness_key}"
    ),
    # the load
    "mode with heave or pitch": Feature("heave_key", "{heave_key}"),
    "mode that turns or lifts a joint without places": Feature(
        "unplaced_motion", "{unplaced_motion}", "a joint without places"
    ),
    "pressure in motion or of an interface": Feature("other_pressure", "{other_pressure}"),
    "changing load or grooves": Feature("load_change_or_grooves", "", "{load_change_or_grooves}"),
    "changing load": Feature(
        lambda j: j.kind == "rig" and j.load_change, "{load_change}", "{load_change_description}"
    ),
    # the law
    "kinetic below static": Feature(
        lambda j: j.has_trait("set-valued") and -1 < j.kinetic < j.static,
        "{table_key}.kinetic",
        "{kinetic:g} below static = {static:g}",
    ),
    "bonds that no force can move": Feature(
        "has_unbounded_bonds",
        "{table_key}.initial_bonds",
        "{initial_bonds:g} with order = {order:g} (reading 'report'), whose bonds at rest no force can move,",
    ),
    # the patch
    "nonlinear asperities": Feature(
        lambda j: j.contact.asperities.law in ("exponential", "hertz"),
        "{patch_key}.asperities.law",
        "'{contact.asperities.law}'",
    ),
    "partial slip": Feature("compliance", "{compliance}"),
    "shape on the lower piece": Feature(
        "lower_shape", "{lower_shape}", "a shape on the lower piece"
    ),
    "shapes on different pieces": Feature(
        "opposite_shape", "{opposite_shape}", "a shape on each piece"
    ),
    "grooves": Feature(lambda j: not j.is_interface and j.grooves, "contact.grooves", "{grooves}"),
    # interfaces
    "interface": Feature("is_interface", "{table_key}", "[[structure.interface]]"),
}


@cache
def find_feature(name: str) -> Feature:
    """Return the Feature of a name in support.toml: a row of JOINT_FEATURES, a dotted key, or "key=value"."""
    if name in JOINT_FEATURES:
        return JOINT_FEATURES[name]
    key, _, value = name.partition("=")
    shown_key = key.replace("patch", "{patch_key}", 1) if key.startswith("patch.") else key
    if value:
        return Feature(lambda j: j.find_key_value(key) == value, shown_key, f"'{value}'")
    return Feature(lambda j: j.find_key_value(key), shown_key)


# Features of a row, separated by ", ", and what to do instead
UNSUPPORTED_COMBINATIONS = tuple(
    tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")).items()
)


def check_combinations(draft: SceneDraft, kind: str) -> None:
    """Add combinations of keys that a run of this kind cannot compute to the draft of a scene, as mistakes.

    The combinations are the rows of UNSUPPORTED_COMBINATIONS, which are tried on each interface.
    """
    check_accuracy_method(draft, kind)
    joints = [DraftJoint(draft, "friction", draft.tables.friction, draft.tables.contact, kind)]
    for index, interface in enumerate(draft.values.structure.interface if kind == "rig" else ()):
        table = interface.table
        joints.append(DraftJoint(draft, f"structure.interface.{index}", table, table.contact, kind))
    for joint in joints:
        # Many rows name the same feature, which is looked for only once.
        is_there = cache(lambda name, joint=joint: find_feature(name).describes(joint))
        reported: set[str] = set()  # one mistake for each key is enough
        for names, instead in UNSUPPORTED_COMBINATIONS:
            first, *others = names.split(", ")
            feature = find_feature(first)
            is_tried = not joint.is_interface if first in SCENE_FEATURES else joint.is_read
            if not is_tried or feature.key in reported:
                continue
            if all(map(is_there, (first, *others))):
                message = describe_row(names, instead).format_map(joint)
                draft.add_mistake(feature.key.format_map(joint), message)
                reported.add(feature.key)


def describe_row(names: str, instead: str) -> str:
    """Return the message of a row of UNSUPPORTED_COMBINATIONS, with names of properties of a `DraftJoint` in braces.

    `names` are the features of the row, and `instead` is what the user can do, and why.
    """
    first, *others = names.split(", ")
    words = find_feature(first).words
    if beside := " and ".join(filter(None, map(_name_feature, others))):
        words = f"{words} with {beside}".strip()
    return describe_unsupported(words, instead)


def _name_feature(name: str) -> str:
    """Return a feature as text, with names of properties in braces; "" for a mere condition."""
    feature = find_feature(name)
    if "=" in name:
        return f"{feature.key} = {feature.words}"
    return feature.words or feature.key
