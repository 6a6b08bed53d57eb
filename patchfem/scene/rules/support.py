"""Combinations of effects that a scene may contain but no run can compute: the table SUPPORT.

Each row names two or three of FEATURES and says what to do instead. To support a combination, delete its row. What
single engines of a rig can compute stands in `methods`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple

from ...effects import (
    LAWS,
    describe_law,
    describe_unsupported,
    find_waveform,
    law_has_trait,
    law_supports,
    law_takes_key,
    needs_bond_list,
    suggest_laws,
)
from ..keys.contact import Contact
from ..keys.tables import Friction
from .methods import (
    check_method,
    describe_load_change,
    find_climbed_grooves,
    find_yaw_key,
    list_lower_shapes,
)
from .rule_table import MistakeRule, TableFacts, apply_rules
from .scene_draft import SceneDraft
from .structure import find_instrument_key
from .view import wrap_value

SCENE_FEATURES = ("wear", "stuck", "instruments")  # features that do not depend on a joint
SINGLE_SUMS = "use 'auto', 'direct' or 'truncated'"
SUMS = ("direct", "truncated", "merged")  # methods of accuracy.quadrature that sum single bonds


class Joint(TableFacts):
    """Friction interface of a scene, with the properties that decide what it can be combined with.

    Parameters
    ----------
    draft : SceneDraft
    table_key : str
        Dotted key of the law: "friction", or that of an interface between masses.
    law : Friction or None
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
        self.yaw = find_yaw_key(draft.tables)
        self.instrument_key = find_instrument_key(draft)
        self.wave = find_waveform(draft.tables.drive)

    def has_trait(self, trait: str) -> bool:
        """Return whether the law has a trait of `effects.LAWS[...].traits`."""
        return law_has_trait(self.law or None, trait)

    def supports(self, *words: str) -> bool:
        """Return whether the law is known and supports all of the given features."""
        return self.law in LAWS and all(law_supports(self.table, word) for word in words)

    def lacks(self, *words: str) -> bool:
        """Return whether the law is known and does not support all of the given features."""
        return self.law in LAWS and not self.supports(*words)

    @property
    def law_description(self) -> str:
        """Friction law as text, with its `reading` or `order` if that requires the sum over all bonds."""
        return describe_law(self.table)

    @property
    def joints_advice(self) -> str:
        """Advice on a friction law that does not support several interfaces."""
        return suggest_laws("joints", friction=self.table)

    @property
    def grooves_advice(self) -> str:
        """Advice on a friction law that does not support grooves."""
        return suggest_laws("grooves", friction=self.table)

    @property
    def needs_list(self) -> bool:
        """Whether the law is a sum over all bonds."""
        return self.has_trait("bonds") and needs_bond_list(self.table)

    @property
    def key_preventing_recursion(self) -> str:
        """Key of the friction law that prevents computing the sum over bonds by recursion."""
        return "reading" if self.reading == "report" else "order"

    @cached_property
    def lower_shape(self) -> str:
        """Key of the first shape on the lower piece; "" if there is none, or if shapes lie on both pieces."""
        shapes = self.contact.table.shapes if self.contact else {}
        lower = list_lower_shapes(self.contact.table, self.patch_key) if self.contact else []
        return lower[0] if lower and len(lower) == len(shapes) else ""

    @property
    def can_slip_in_strips(self) -> bool:
        """Whether partial slip is supported in each strip separately.

        That needs elements under a constant load, the shear of the pieces, and no spring that couples the strips.
        """
        patch = self.contact
        is_coupled = patch.asperities.tangential_ratio or patch.holder.tangential_stiffness
        return bool(
            self.kind == "rig"
            and patch.shear
            and not is_coupled
            and self.supports("pieces", "shear")
        )

    @property
    def is_read(self) -> bool:
        """Whether the law could be read, or the joint is that of an interface, in a bench or a rig."""
        return self.is_interface or (self.law in LAWS and self.kind in ("bench", "rig"))


class Feature(NamedTuple):
    """Property of a joint that cannot be combined with every other.

    - is_there: function of the joint.
    - key: dotted key that causes it; "" for a mere condition. `{name}` in it, and in `words`, stands for a property of
      the joint.
    - words: text for messages; "" for the key itself.
    """

    is_there: Callable[[Joint], Any]
    key: str = ""
    words: str = ""


FEATURES = {
    # kinds of scenes, drives and methods
    "bench": Feature(lambda j: j.kind == "bench"),
    "rig": Feature(lambda j: j.kind == "rig"),
    "release": Feature(lambda j: j.scene.drive.kind == "free", "drive.kind", "drive.kind = 'free'"),
    "transient": Feature(
        lambda j: j.wave.name and not j.wave.is_sine,
        "drive.waveform",
        "drive.waveform = '{scene.drive.waveform}'",
    ),
    "harmonic": Feature(
        lambda j: j.scene.accuracy.method == "harmonic",
        "accuracy.method",
        "accuracy.method 'harmonic'",
    ),
    "harmonics": Feature(lambda j: j.scene.accuracy.harmonics, "accuracy.harmonics"),
    "wear": Feature(lambda j: j.scene.wear and not j.is_interface, "wear"),
    "worn start": Feature(lambda j: j.scene.wear.start, "wear.start"),
    "stuck": Feature(
        lambda j: j.scene.structure.measured == "stuck" and not j.is_interface,
        "structure.measured",
        "'stuck'",
    ),
    "instruments": Feature(lambda j: not j.is_interface and j.instrument_key, "{instrument_key}"),
    "travel": Feature(lambda j: j.scene.structure.travel, "structure.travel"),
    "levels or sweep": Feature(
        lambda j: j.scene.accuracy.method != "harmonic" and (j.wave.is_swept or j.wave.has_levels),
        "drive.waveform",
        "drive.waveform = '{scene.drive.waveform}'",
    ),
    # the load
    "oscillating load": Feature(lambda j: j.scene.normal.amplitude, "normal.amplitude"),
    "moving load": Feature(lambda j: j.load_change[:9] == "structure", "{load_change}"),
    "changing load": Feature(
        lambda j: j.kind == "rig" and j.load_change, "{load_change}", "{load_change_description}"
    ),
    # the law
    "constant load": Feature(
        lambda j: not j.has_trait("bonds") and j.lacks("varying-load"),
        "{table_key}.law",
        "law '{law}'",
    ),
    "constant pressure": Feature(
        lambda j: (
            not j.has_trait("memoryless") and not j.has_trait("bonds") and j.lacks("varying-load")
        ),
        "{table_key}.law",
        "law '{law}'",
    ),
    "rigid pieces": Feature(
        lambda j: not j.is_interface and not j.has_trait("bonds") and j.lacks("shear"),
        "{table_key}.law",
        "'{law}'",
    ),
    "no elements": Feature(
        lambda j: j.is_interface and j.lacks("pieces", "shear"),
        "{table_key}.law",
        "{law_description}",
    ),
    "one interface": Feature(lambda j: j.lacks("joints"), "{table_key}.law", "{law_description}"),
    "flat faces": Feature(
        lambda j: not j.needs_list and j.lacks("grooves"), "{table_key}.law", "law '{law}'"
    ),
    "no bonds": Feature(lambda j: not j.has_trait("bonds"), "{table_key}.law", "law '{law}'"),
    "averaged": Feature(lambda j: j.has_trait("averaged"), "{table_key}.law", "law '{law}'"),
    "rigid stick": Feature(
        lambda j: j.has_trait("set-valued") and j.supports("shear"), "{table_key}.law", "'{law}'"
    ),
    "lower kinetic": Feature(
        lambda j: j.has_trait("set-valued") and j.supports("shear") and -1 < j.kinetic < j.static,
        "{table_key}.kinetic",
        "{kinetic:g} below static = {static:g}",
    ),
    "spread": Feature(lambda j: j.spread and law_takes_key(j.law, "spread"), "{table_key}.spread"),
    # the sum over bonds
    "list": Feature(lambda j: j.needs_list, "{table_key}.{key_preventing_recursion}"),
    "stretched list": Feature(
        lambda j: j.needs_list and j.reading != "report", "{table_key}.{key_preventing_recursion}"
    ),
    "recursion": Feature(lambda j: not j.needs_list),
    "named sum": Feature(
        lambda j: j.has_trait("bonds") and j.scene.accuracy.quadrature in SUMS,
        "accuracy.quadrature",
        "'{scene.accuracy.quadrature}'",
    ),
    "merged": Feature(
        lambda j: j.scene.accuracy.quadrature == "merged", "accuracy.quadrature", "'merged'"
    ),
    # the patch
    "rigid patch": Feature(lambda j: not j.compliance),
    "compliance": Feature(lambda j: j.compliance, "{compliance}"),
    "lower shape": Feature(lambda j: j.lower_shape, "{lower_shape}", "a shape on the lower piece"),
    "strips": Feature(lambda j: j.contact.strips, "{patch_key}.strips"),
    "joined strips": Feature(lambda j: not j.can_slip_in_strips),
    "yaw": Feature(lambda j: j.yaw, "{yaw}"),
    "nonlinear layer": Feature(
        lambda j: j.contact.asperities.law in ("exponential", "hertz"),
        "contact.asperities.law",
        "'{contact.asperities.law}'",
    ),
    "holder": Feature(
        lambda j: j.contact.holder.tangential_stiffness, "contact.holder.tangential_stiffness"
    ),
    "grooves": Feature(lambda j: not j.is_interface and j.grooves, "contact.grooves", "{grooves}"),
    "point": Feature(lambda j: j.scene.normal),
    # the structure
    "stiffening": Feature(lambda j: j.scene.structure.stiffening, "structure.stiffening"),
    "interlock": Feature(
        lambda j: j.scene.structure.bonded.wavelength, "structure.bonded.wavelength"
    ),
    "masses": Feature(lambda j: j.scene.structure.masses, "structure.masses"),
    "reduced": Feature(lambda j: j.scene.structure.reduced, "[structure.reduced]"),
    "patches": Feature(
        lambda j: any(face.contact for face in j.scene.structure.interface),
        "[structure.interface.contact]",
    ),
    "interfaces": Feature(
        lambda j: j.scene.structure.interface, "structure.interface", "[[structure.interface]]"
    ),
    "interface": Feature(lambda j: j.is_interface, "{table_key}", "[[structure.interface]]"),
    "others": Feature(
        lambda j: j.is_interface and len(j.scene.structure.interface) > 1,
        "structure.interface",
        "other interfaces",
    ),
    "patch": Feature(
        lambda j: j.is_interface and j.contact, "{patch_key}", "[structure.interface.contact]"
    ),
    "approach": Feature(lambda j: j.contact.approach, "{patch_key}.approach"),
    "own grooves": Feature(lambda j: j.contact.grooves, "{patch_key}.grooves"),
    "grooved faces": Feature(
        lambda j: j.contact.grooves or j.scene.normal.grooves, "contact.grooves", "grooves"
    ),
}
AT_OUTPUT = "give `accelerometer` and `gauge` the value of `output`"
ONLY_MODES = "only modes can be measured with the joint: leave `measured` out"
WITHOUT_JOINT = (
    "the joint has no single stiffness to subtract from the modes: give the modes without the joint"
)
STEADY_ADVICE = "wear is computed from the last cycle of a steady motion: use"
# Features that no run supports together, and what to do instead: a key of `effects.REMEDIES`, or the advice itself. A
# mistake is reported at the key of the first feature.
SUPPORT = (
    ("constant load, changing load", suggest_laws("varying-load")),
    ("stretched list, changing load", "recursion"),
    ("rigid stick, compliance, changing load", "stiff"),
    ("stiffening, changing load", "either"),
    ("interlock, changing load", "either"),
    ("strips, changing load", "either"),
    ("nonlinear layer, changing load", "linear"),
    ("lower shape, changing load", "shapes"),
    ("oscillating load, bench, constant pressure", suggest_laws("varying-load")),
    ("named sum, rig, recursion, lower shape", "use 'recursion' or 'auto'"),
    ("merged, bench, rigid patch, lower shape", SINGLE_SUMS),
    ("merged, bench, rigid patch, oscillating load", SINGLE_SUMS),
    ("yaw, strips, rig, one interface", "{joints_advice}"),
    ("strips, averaged", "out"),
    ("strips, joined strips, compliance", "either"),
    ("rigid pieces, compliance", f"leave out {{compliance}}, or {suggest_laws('shear')}"),
    ("lower kinetic, compliance", "kinetic"),
    ("lower shape, no bonds, rig", "shapes"),
    ("lower shape, no bonds, compliance", "shapes"),
    ("lower shape, bench, constant pressure", "shapes"),
    ("lower shape, interface", "shapes"),
    ("list, grooves", "recursion"),
    ("flat faces, grooves", "{grooves_advice}"),
    ("named sum, grooves", "use 'recursion' or 'auto'"),
    (
        "harmonics, harmonic, grooves",
        "leave `harmonics` out: the motion is integrated until it repeats",
    ),
    (
        "harmonics, harmonic, others",
        "leave `harmonics` out: the steady motion of all interfaces is found without it",
    ),
    ("holder, grooves", "out"),
    ("grooves, strips, yaw", "either"),
    ("grooves, strips, compliance", "either"),
    ("oscillating load, grooves", "either"),
    ("moving load, grooves", "either"),
    ("lower shape, grooves", "shapes"),
    ("stiffening, grooves", "either"),
    ("interlock, grooves", "either"),
    ("spread, interface", "out"),
    ("one interface, others", "{joints_advice}"),
    ("one interface, patch", "{joints_advice}"),
    ("no elements, compliance", f"leave out {{compliance}}, or {suggest_laws('pieces', 'shear')}"),
    ("approach, interface", "give contact.load instead"),
    ("own grooves, interface", "out"),
    (
        "wear, grooves, point",
        "a [normal] contact has no area, so its wear has no depth: use [contact]",
    ),
    ("wear, strips, compliance", "leave out [wear] or {compliance}"),
    ("wear, strips, lower shape", "put all shapes on the upper piece"),
    ("wear, strips, worn start", "leave out [wear] or leave out wear.start"),
    ("wear, rig, oscillating load", "leave out [wear] or the amplitude"),
    (
        "wear, interfaces",
        "leave out [wear] or describe a single interface by [friction] and [normal]",
    ),
    ("wear, moving load", "leave out [wear] or this key"),
    ("wear, rig, release", f"{STEADY_ADVICE} kind 'base' or 'force'"),
    ("wear, rig, transient", f"{STEADY_ADVICE} waveform 'sine'"),
    ("wear, rig, harmonic", "use 'auto', 'exact' or 'march'"),
    ("stuck, masses", ONLY_MODES),
    ("stuck, reduced", ONLY_MODES),
    ("stuck, interlock", WITHOUT_JOINT),
    ("stuck, grooved faces", WITHOUT_JOINT),
    ("stuck, oscillating load", WITHOUT_JOINT),
    ("stuck, moving load", WITHOUT_JOINT),
    ("stuck, yaw", WITHOUT_JOINT),
    ("stuck, patches", WITHOUT_JOINT),
    ("instruments, travel", AT_OUTPUT),
    ("instruments, stiffening", AT_OUTPUT),
    ("instruments, release", AT_OUTPUT),
    ("instruments, levels or sweep", AT_OUTPUT),
    ("wear, averaged", "leave out [wear] or use law 'coulomb'"),
)
JOINT_RULES = (
    MistakeRule(
        lambda j: j.kind == "rig" and j.yaw and not j.contact.strips,
        "{yaw}",
        "`yaw` rotates the patch about its normal; add [contact.strips], whose strips slide independently",
    ),
    MistakeRule(
        lambda j: (
            j.kind == "rig"
            and not j.is_interface
            and not j.contact
            and j.load_change[:9] == "structure"
        ),
        "{load_change}",
        "a single contact point cannot heave or pitch: use [contact] in place of [normal]",
    ),
    MistakeRule(
        lambda j: (
            j.compliance
            and j.has_trait("bonds")
            and j.reading == "report"
            and -1 < j.order < 0
            and j.initial_bonds
        ),
        "{table_key}.initial_bonds",
        "{initial_bonds:g} with order = {order:g} and {compliance} gives points that no force can move: in the law as "
        "printed in the report, (R/eps)^order is unbounded for bonds at rest; set initial_bonds = 0 or use order >= 0",
    ),
)


def check_combinations(draft: SceneDraft, kind: str) -> None:
    """Report combinations of keys that a run of this kind cannot compute yet."""
    check_method(draft, kind)
    joints = [Joint(draft, "friction", draft.tables.friction, draft.tables.contact, kind)]
    for index, interface in enumerate(draft.values.structure.interface if kind == "rig" else ()):
        table = interface.table
        joints.append(Joint(draft, f"structure.interface.{index}", table, table.contact, kind))
    for joint in joints:
        _check_shape_sides(joint)
        apply_rules(draft, JOINT_RULES if joint.is_read else (), joint)
        reported: set[str] = set()  # one mistake for each key is enough
        there = {name for name, feature in FEATURES.items() if feature.is_there(joint)}
        for names, instead in SUPPORT:
            first, *others = names.split(", ")
            key = FEATURES[first].key
            if not there.issuperset((first, *others)) or not (
                joint.is_read or first in SCENE_FEATURES
            ):
                continue
            if key not in reported:
                beside = " and ".join(filter(None, map(_name_feature, others)))
                words = f"{FEATURES[first].words} with {beside}".strip()
                message = describe_unsupported(words, instead).format_map(joint)
                draft.add_mistake(key.format_map(joint), message)
                reported.add(key)


def _name_feature(name: str) -> str:
    """Return a feature as text, with names of properties in braces."""
    return FEATURES[name].words or FEATURES[name].key


def _check_shape_sides(joint: Joint) -> None:
    """Report shapes on different pieces."""
    shapes = joint.contact.table.shapes if joint.contact else {}
    sides = {f"{joint.patch_key}.{name}.on": shape.on for name, shape in shapes.items() if shape.on}
    if len(set(sides.values())) > 1 and joint.is_read:
        key = next((key for key in reversed(sides) if joint.draft.has(key)), next(iter(sides)))
        names = " and ".join(f"contact.{key.split('.')[-2]}" for key in sides)
        message = describe_unsupported(
            f"{names} on different pieces", "put all shapes on one piece"
        )
        joint.draft.add_mistake(key, message)
