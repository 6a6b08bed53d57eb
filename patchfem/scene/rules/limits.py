"""Combinations of effects that a scene may contain but no run can compute yet.

Each sentence has the words "not supported yet" and says what to do instead. To support a combination, delete its row.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

from ...effects import (
    REMEDIES,
    describe_law,
    describe_unsupported,
    law_has_trait,
    law_supports,
    law_takes_key,
    needs_bond_list,
    suggest_laws,
)
from ..keys.contact import Contact
from ..keys.tables import Friction, Tables
from .methods import (
    check_method,
    describe_load_change,
    find_compliance_key,
    find_yaw_key,
    list_lower_shapes,
)
from .rule_table import MissingKeyRule, MistakeRule, TableFacts, apply_rules, make_unsupported_rule
from .scene_draft import SceneDraft
from .view import TableView, wrap_value


class JointFacts(TableFacts):
    """Properties of the scene that the checks of one friction interface use.

    Parameters
    ----------
    draft : SceneDraft
    table_key : str
        Dotted key of the law: "friction", or that of an interface.
    law : Friction
    contact : Contact or None
        Patch of the joint.
    kind : str
        Kind of the scene.
    """

    def __init__(
        self, draft: SceneDraft, table_key: str, law: Friction, contact: Contact | None, kind: str
    ) -> None:
        super().__init__(draft, table_key, law)
        self.kind = kind
        self.contact = wrap_value(contact)
        self.patch_key = "contact" if table_key == "friction" else f"{table_key}.contact"

    def has_trait(self, trait: str) -> bool:
        """Return whether the law has a trait of `effects.LAWS[...].traits`."""
        return law_has_trait(self.table.law, trait)

    def supports(self, *words: str) -> bool:
        """Return whether the friction law supports all of the given features."""
        return all(law_supports(self.table, word) for word in words)

    @property
    def law_description(self) -> str:
        """Friction law as text, with its `reading` or `order` if that requires the sum over all bonds."""
        return describe_law(self.table)

    @property
    def needs_bond_list(self) -> bool:
        """Whether the law is a sum over all bonds."""
        return needs_bond_list(self.table)

    @property
    def load_change_description(self) -> str:
        """Cause of the changing normal load, as text for a message."""
        return describe_load_change(self.load_change)

    @cached_property
    def yaw(self) -> str:
        """Key of the yaw of the first mode that yaws the patch, or "" if no mode does."""
        return find_yaw_key(self.draft.tables)

    @property
    def key_preventing_recursion(self) -> str:
        """Key of the friction law that prevents computing the sum over bonds by recursion."""
        if self.reading == "report":
            return "reading"
        return "breakaway" if self.breakaway else "order"

    @property
    def has_others(self) -> bool:
        """Whether the scene has further friction interfaces."""
        return len(self.scene.structure.interface) > 1

    @property
    def joints_advice(self) -> str:
        """Advice on a friction law that does not support several interfaces."""
        return suggest_laws("joints", friction=self.table)

    @property
    def plane_advice(self) -> str:
        """Advice on a friction law that does not support motion in two directions."""
        if self.has_trait("set-valued"):
            return REMEDIES["stiff"]
        return f"{suggest_laws('plane')}, or leave lateral out"

    @property
    def quadrature(self) -> str:
        """Method of accuracy.quadrature that sums single bonds, or "" if the scene sets no such method."""
        name = self.scene.accuracy.quadrature
        is_sum = name in ("direct", "truncated", "merged")
        return name if is_sum and self.has_trait("bonds") and not self.compliance else ""

    @property
    def has_lower_shape(self) -> bool:
        """Whether a shape lies on the lower piece."""
        return bool(self.contact and list_lower_shapes(self.contact.table))

    @property
    def recursion_feature(self) -> str:
        """Feature, as text, that requires computing the sum over bonds by recursion, or "" if there is none."""
        if self.has_lower_shape:
            return "a shape on the lower piece"
        return "friction.breakaway" if self.breakaway else ""

    @property
    def breakaway_circumstance(self) -> str:
        """Circumstance in which a breakaway needs order = 1, as text, or "" if there is none."""
        if self.kind == "rig":
            return "in a rig"
        return f"and {self.compliance}" if self.compliance else ""

    @property
    def has_constant_pressure(self) -> bool:
        """Whether the law requires constant pressure: it has memory and supports no varying load."""
        has_own_form = self.has_trait("memoryless") or self.has_trait("bonds")
        return not has_own_form and not self.supports("varying-load")

    @property
    def can_slip_in_strips(self) -> bool:
        """Whether partial slip is supported in each strip separately.

        That needs elements under a constant load, the shear of the pieces, and no spring that couples the strips.
        """
        patch = self.contact
        is_coupled = patch.asperities.tangential_ratio or patch.holder.tangential_stiffness
        has_elements = self.supports("pieces", "shear")
        return bool(self.kind == "rig" and patch.shear and not is_coupled and has_elements)

    @property
    def lacks_partial_slip_of_strips(self) -> bool:
        """Whether the scene needs partial slip of the strips but it is not supported."""
        return bool(self.contact.strips and self.compliance) and not self.can_slip_in_strips


MOTION_RULES = (
    make_unsupported_rule(
        lambda j: (
            j.kind == "rig" and j.quadrature and j.recursion_feature and not j.needs_bond_list
        ),
        "accuracy.quadrature",
        "'{quadrature}' with {recursion_feature} in a rig",
        "use 'recursion' or 'auto'",
    ),
    make_unsupported_rule(
        lambda j: (
            j.kind == "bench"
            and j.quadrature == "merged"
            and (j.recursion_feature or j.scene.normal.amplitude)
        ),
        "accuracy.quadrature",
        "'merged' with friction.breakaway, or with a pressure that changes at a point during the slide,",
        "use 'auto', 'direct' or 'truncated'",
    ),
    make_unsupported_rule(
        lambda j: j.kind == "bench" and j.has_constant_pressure and j.scene.normal.amplitude,
        "normal.amplitude",
        "with law '{law}'",
        suggest_laws("varying-load"),
    ),
    make_unsupported_rule(
        lambda j: (
            j.has_trait("bonds")
            and j.breakaway
            and abs(j.order - 1) > 0
            and j.breakaway_circumstance
        ),
        "friction.breakaway",
        "with order = {order:g} {breakaway_circumstance}",
        "order",
    ),
    MistakeRule(
        lambda j: j.kind == "rig" and j.yaw and not j.contact.strips,
        "{yaw}",
        "`yaw` rotates the patch about its normal; add [contact.strips], whose strips slide independently",
    ),
    make_unsupported_rule(
        lambda j: j.kind == "rig" and j.yaw and j.contact.strips and not j.supports("joints"),
        "{yaw}",
        "in strips with {law_description}",
        "{joints_advice}",
    ),
    make_unsupported_rule(
        lambda j: (
            j.contact.strips and not j.lacks_partial_slip_of_strips and j.has_trait("averaged")
        ),
        "contact.strips",
        "with law '{law}'",
        "out",
    ),
)
CHANGING_LOAD_RULES = (
    MistakeRule(
        lambda j: not j.contact and j.load_change != "normal.amplitude",
        "{load_change}",
        "a single contact point cannot heave or pitch: use [contact] in place of [normal]",
    ),
    make_unsupported_rule(
        lambda j: not j.has_trait("bonds") and not j.supports("varying-load"),
        "friction.law",
        "'{law}' with {load_change_description}",
        suggest_laws("varying-load"),
    ),
    make_unsupported_rule(
        lambda j: (
            j.has_trait("bonds") and (j.breakaway or (j.needs_bond_list and j.reading != "report"))
        ),
        "friction.{key_preventing_recursion}",
        "with {load_change_description}",
        "recursion",
    ),
    make_unsupported_rule(
        lambda j: j.compliance and j.has_trait("set-valued") and j.supports("shear"),
        "friction.law",
        "'{law}' with {load_change_description} and {compliance}",
        "stiff",
    ),
    make_unsupported_rule(
        lambda j: j.scene.structure.stiffening,
        "structure.stiffening",
        "with {load_change_description}",
        "either",
    ),
    make_unsupported_rule(
        lambda j: j.scene.structure.bonded.wavelength,
        "structure.bonded.wavelength",
        "with {load_change_description}",
        "either",
    ),
    make_unsupported_rule(
        lambda j: j.contact.strips, "contact.strips", "with {load_change_description}", "either"
    ),
    make_unsupported_rule(
        lambda j: j.contact.asperities.law in ("exponential", "hertz"),
        "contact.asperities.law",
        "'{contact.asperities.law}' with {load_change_description}",
        "linear",
    ),
)
COMPLIANCE_RULES = (
    MistakeRule(
        lambda j: (
            j.has_trait("bonds") and j.reading == "report" and -1 < j.order < 0 and j.initial_bonds
        ),
        "{table_key}.initial_bonds",
        "{initial_bonds:g} with order = {order:g} and {compliance} gives points that no force can move: in the law as "
        "printed in the report, (R/eps)^order is unbounded for bonds at rest; set initial_bonds = 0 or use order >= 0",
    ),
    make_unsupported_rule(
        lambda j: not j.has_trait("bonds") and not j.supports("shear"),
        "{table_key}.law",
        "'{law}' with {compliance}",
        f"leave out {{compliance}}, or {suggest_laws('shear')}",
    ),
    make_unsupported_rule(
        lambda j: j.has_trait("set-valued") and j.supports("shear") and -1 < j.kinetic < j.static,
        "{table_key}.kinetic",
        "{kinetic:g} below static = {static:g} with {compliance}",
        "kinetic",
    ),
)
STRIPS_RULES = (
    make_unsupported_rule(
        lambda j: j.lacks_partial_slip_of_strips,
        "{patch_key}.strips",
        "with {compliance}",
        "either",
    ),
)
INTERFACE_RULES = (
    MissingKeyRule(
        lambda j: not j.contact and not j.has("load"),
        "{table_key}.load",
        "or give this interface a patch with [structure.interface.contact]",
    ),
    make_unsupported_rule(
        lambda j: j.spread and law_takes_key(j.table.law, "spread"),
        "{table_key}.spread",
        "with masses, where an interface has no width",
        "out",
    ),
)
INTERFACE_LAW_RULES = (
    make_unsupported_rule(
        lambda j: j.has_others and not j.supports("joints"),
        "{table_key}.law",
        "{law_description} with other interfaces",
        "{joints_advice}",
    ),
    make_unsupported_rule(
        lambda j: j.lateral and not j.supports("plane"),
        "{table_key}.lateral",
        "with {law_description}",
        "{plane_advice}",
    ),
)
INTERFACE_PATCH_RULES = (
    make_unsupported_rule(
        lambda j: j.lateral,
        "{table_key}.lateral",
        "with [structure.interface.contact]",
        "give the interface a load, or leave lateral out",
    ),
    MistakeRule(
        lambda j: j.has("load"),
        "{table_key}.load",
        "[structure.interface.contact] has its own load; leave this key out",
    ),
    make_unsupported_rule(
        lambda j: j.has("contact.approach"),
        "{patch_key}.approach",
        "with [[structure.interface]]",
        "give contact.load instead",
    ),
    make_unsupported_rule(
        lambda j: j.has("contact.grooves"),
        "{patch_key}.grooves",
        "with [[structure.interface]]",
        "out",
    ),
)
PATCH_LAW_RULES = (
    make_unsupported_rule(
        lambda j: not j.has_others and not j.compliance and not j.supports("joints"),
        "{table_key}.law",
        "{law_description} with [structure.interface.contact]",
        "{joints_advice}",
    ),
    make_unsupported_rule(
        lambda j: j.compliance and not j.supports("pieces", "shear"),
        "{table_key}.law",
        "{law_description} with {compliance}",
        f"leave out {{compliance}}, or {suggest_laws('pieces', 'shear')}",
    ),
    *STRIPS_RULES,
)


def check_combinations(draft: SceneDraft, kind: str) -> None:
    """Report combinations of keys that a run of this kind cannot compute yet."""
    check_method(draft, kind)
    if kind == "rig":
        for index, interface in enumerate(draft.values.structure.interface):
            _check_interface(draft, f"structure.interface.{index}", interface.table)
    law = draft.tables.friction
    if kind not in ("bench", "rig") or law is None or law.law is None:
        return
    joint = JointFacts(draft, "friction", law, draft.tables.contact, kind)
    apply_rules(draft, MOTION_RULES, joint)
    if kind == "rig" and joint.load_change:
        apply_rules(draft, CHANGING_LOAD_RULES, joint)
        for key in list_lower_shapes(draft.tables.contact):
            feature = f"'lower' with {joint.load_change_description}"
            draft.add_mistake(key, describe_unsupported(feature, "shapes"))
    if joint.compliance:
        apply_rules(draft, COMPLIANCE_RULES, joint)
    if joint.contact:
        _check_shape_sides(joint, _find_upper_piece_need(joint))
        apply_rules(draft, STRIPS_RULES, joint)


def _check_interface(draft: SceneDraft, table_key: str, interface: Any) -> None:
    """Report features that an interface between two masses does not support yet."""
    joint = JointFacts(draft, table_key, interface, interface.contact, "rig")
    apply_rules(draft, INTERFACE_RULES, joint)
    if interface.law is not None:
        apply_rules(draft, INTERFACE_LAW_RULES, joint)
    if not joint.contact:
        return
    apply_rules(draft, INTERFACE_PATCH_RULES, joint)
    _check_shape_sides(joint, "with [[structure.interface]]")
    if interface.law is not None:
        apply_rules(draft, PATCH_LAW_RULES, joint)
        if joint.compliance and joint.supports("pieces", "shear"):
            apply_rules(draft, COMPLIANCE_RULES, joint)


def _find_upper_piece_need(joint: JointFacts) -> str:
    """Return the feature that requires shapes on the upper piece, as text, or "" if there is none."""
    law = f"with law '{joint.law}'"
    if joint.has_trait("bonds"):
        needs_upper = joint.compliance and joint.breakaway
        return f"with friction.breakaway and {joint.compliance}" if needs_upper else ""
    if joint.compliance:
        return f"with {joint.compliance} and law '{joint.law}'"
    if joint.kind == "bench":
        return law if joint.has_constant_pressure else ""
    return f"in a rig {law}"


def _check_shape_sides(joint: JointFacts, only_upper: str) -> None:
    """Report shapes on different pieces, or on the lower piece if this is not supported.

    `only_upper` says in words what requires the upper piece; "" if the shapes may lie on the lower one.
    """
    draft = joint.draft
    sides = {
        f"{joint.patch_key}.{name}.on": shape.on
        for name, shape in joint.contact.table.shapes.items()
        if shape.on is not None
    }
    if len(set(sides.values())) > 1:
        key = next((key for key in reversed(sides) if draft.has(key)), next(iter(sides)))
        names = " and ".join(f"contact.{key.split('.')[-2]}" for key in sides)
        piece = "the upper piece" if only_upper else "one piece"
        message = describe_unsupported(f"{names} on different pieces", f"put all shapes on {piece}")
        draft.add_mistake(key, message)
        return
    lower = list_lower_shapes(joint.contact.table, joint.patch_key)
    if lower and only_upper:
        draft.add_mistake(lower[0], describe_unsupported(f"'lower' {only_upper}", "shapes"))


def find_lateral_slide_obstacle(tables: Tables) -> str:
    """Return why a bench cannot follow a path file with lateral motion, or "" if it can."""
    law = tables.friction
    scene = TableView(tables)
    compliance = find_compliance_key(law, tables)
    either = REMEDIES["either"]
    obstacles = (
        (
            not law_supports(law, "two-directions"),
            f"law '{law.law}'",
            suggest_laws("two-directions"),
        ),
        (scene.friction.spread, "friction.spread", either),
        (scene.friction.breakaway, "friction.breakaway", either),
        (compliance, compliance, either),
        (list_lower_shapes(tables.contact), "a shape on the lower piece", REMEDIES["shapes"]),
        (scene.normal.amplitude, "normal.amplitude", either),
    )
    for is_there, feature, instead in obstacles:
        if is_there:
            return describe_unsupported(
                f"a lateral column with {feature}", f"{instead}, or leave the lateral column out"
            )
    return ""
