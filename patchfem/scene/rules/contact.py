"""Rules of [contact] and of patches of interfaces: keys that exclude or need one another."""

from collections.abc import Iterator
from functools import cached_property
from typing import Any

from ...effects import GAP_SHAPES
from ..keys.contact import Contact, compute_outermost_strip_distance
from ..keys.removed import describe_removed
from .outlines import PIECE_NAMES, check_outlines, find_flat_length
from .rule_table import MissingKeyRule, MistakeRule, RemarkRule, TableFacts, apply_rules
from .scene_draft import SceneDraft
from .view import TableView

# Largest ratio of the height of a piece to its length; from 80 000 on, the stiffness of
# the piece is lost to round-off.
MAX_SLENDERNESS = 10_000
# Largest number of elements along the interface; even with 10 000, the
# dense matrices take gigabytes.
MAX_ELEMENTS = 100_000

# Largest angle [rad] between the pieces; the gap is angle * x, which differs from tan(angle) * x by 0.3 % there.
MAX_SMALL_ANGLE = 0.1


def find_max_load(patch: TableView) -> float:
    """Return the load [N] at which the mean pressure is the lower Young's modulus of the two substrates."""
    moduli = [(patch[name].substrate or patch.substrate).young for name in PIECE_NAMES]
    return min(moduli) * find_flat_length(patch) * patch.width * patch.pairs


class PatchFacts(TableFacts):
    """Properties of the scene that the checks of a patch use."""

    @cached_property
    def flat_length(self) -> float:
        """Length [m] over which both faces are flat and opposite, or UNKNOWN_VALUE if there is none."""
        return find_flat_length(self)

    @property
    def half_length(self) -> float:
        """Half of the flat length [m]."""
        return self.flat_length / 2

    @property
    def flat_length_name(self) -> str:
        """Words that a message uses for the flat length."""
        return "contact.length =" if self.flat_length == self.length else "the interface length of"

    @property
    def max_load(self) -> float:
        """Load [N] from which on strains are of the order of 1."""
        return find_max_load(self)

    @property
    def max_height(self) -> float:
        """Largest height of a piece [m]."""
        return MAX_SLENDERNESS * self.length

    @property
    def min_element_size(self) -> float:
        """Element size [m] at which the interface has MAX_ELEMENTS elements."""
        return self.length / MAX_ELEMENTS

    @property
    def max_roll_offset(self) -> float:
        """Distance [m] from the middle of the patch to the middle of the outermost strip."""
        return compute_outermost_strip_distance(self.width, self.strips.count)

    @property
    def has_free_roll(self) -> bool:
        """Whether a load line over the width permits rotation about x."""
        return bool(self.strips) and self.has("strips.offset")


PATCH_RULES = (
    MistakeRule(
        lambda p: p.load >= p.max_load,
        "{table_key}.load",
        "{load:.3g} N is a mean pressure above Young's modulus, but the pieces are elastic and strain little; less than "
        "{max_load:.3g} N is needed",
    ),
    *(
        MistakeRule(
            condition,
            f"{{table_key}}.{key}",
            f"{{{key}:.3g}} rad is not a small angle, but the gap is computed as the angle times the distance from the "
            f"middle of the patch; at most {MAX_SMALL_ANGLE} rad is possible",
        )
        for key, condition in (
            ("tilt.angle", lambda p: abs(p.tilt.angle) > MAX_SMALL_ANGLE),
            ("strips.roll", lambda p: abs(p.strips.roll) > MAX_SMALL_ANGLE),
        )
    ),
    MistakeRule(
        lambda p: p.height > p.max_height,
        "{table_key}.height",
        f"{{height:g}} m is more than {MAX_SLENDERNESS} times contact.length, but the stress is noticeable only to a "
        "depth of a few times contact.length; use at most {max_height:.3g} m, and represent the rest of the height by "
        "a spring of the structure",
    ),
    MistakeRule(
        lambda p: p.element_size > p.flat_length,
        "{table_key}.element_size",
        "{element_size} m is longer than {flat_length_name} {flat_length} m",
    ),
    MistakeRule(
        lambda p: p.length > MAX_ELEMENTS * p.element_size,
        "{table_key}.element_size",
        f"elements of {{element_size:g}} m on a length of {{length:g}} m are more than {MAX_ELEMENTS}; use at least "
        "{min_element_size:.3g} m, or leave this key out",
    ),
    MistakeRule(
        lambda p: p.has("mesh_unit") and not p.has("mesh"),
        "{table_key}.mesh_unit",
        "is the unit of the file of contact.mesh, which is missing: leave mesh_unit out",
    ),
    RemarkRule(
        lambda p: p.element_size and p.mesh,
        "{table_key}.element_size",
        "is not used, because the file of contact.mesh gives the elements",
    ),
    MistakeRule(
        lambda p: abs(p.step.at) >= p.half_length,
        "{table_key}.step.at",
        "{step.at} m lies outside the patch: |`at`| < length/2 is needed",
    ),
    MistakeRule(
        lambda p: p.has_free_roll and p.has("strips.roll"),
        "{table_key}.strips.offset",
        "`offset` leaves the rotation about x free, but contact.strips.roll prescribes this rotation: keep only one of "
        "these two keys",
    ),
    MistakeRule(
        lambda p: p.has_free_roll and p.has("approach"),
        "{table_key}.strips.offset",
        "a load line needs a load: use contact.load in place of [contact.approach]",
    ),
    MistakeRule(
        lambda p: p.approach and (p.has("load_line") or p.holder.rotational_stiffness),
        "{table_key}.approach",
        describe_removed(
            "approach of a piece that can rotate", "an approach of a piece that can rotate"
        ),
    ),
    MistakeRule(
        lambda p: p.has_free_roll and p.strips.count < 2,
        "{table_key}.strips.offset",
        "{strips.count} strip cannot resist a rotation about x: raise contact.strips.count",
    ),
    MistakeRule(
        lambda p: (
            p.has_free_roll and p.strips.count >= 2 and abs(p.strips.offset) >= p.max_roll_offset
        ),
        "{table_key}.strips.offset",
        "{strips.offset} m lies beyond the middle of the outermost strip: |offset| < {max_roll_offset:.6g} m is "
        "needed; raise contact.strips.count or lower the offset",
    ),
    MistakeRule(
        lambda p: (
            p.asperities
            and p.has("asperities.cutoff")
            and not p.has_any("profile", "asperities.from", "asperities.rms_height")
        ),
        "{table_key}.asperities.cutoff",
        "separates the long waves of a trace from the short ones, but the scene has no trace: add [contact.profile] or "
        "`from`, or leave this key out",
    ),
    MissingKeyRule(
        lambda p: (
            p.approach and p.asperities.law == "exponential" and not p.asperities.normal_stiffness
        ),
        "{table_key}.asperities.normal_stiffness",
        "law 'exponential' with [contact.approach] needs this stiffness at first touch, because the approach is "
        "measured from first touch",
    ),
)
LOAD_LINE_RULES = (
    MistakeRule(
        lambda p: p.has("tilt.angle") and not p.has("holder"),
        "{table_key}.load_line",
        "cannot be used with contact.tilt.angle unless [contact.holder] is given: a piece that is free to rotate has "
        "no prescribed angle; leave out one of these two keys, or add the spring of [contact.holder]",
    ),
    MistakeRule(
        lambda p: abs(p.load_line.offset) >= p.half_length,
        "{table_key}.load_line.offset",
        "{load_line.offset} m lies outside the patch: |offset| < length/2 = {half_length} m is needed",
    ),
    MistakeRule(
        lambda p: p.load_line.moment and abs(p.load_line.moment) >= p.half_length * p.load,
        "{table_key}.load_line.moment",
        "{load_line.moment} N m divided by the load {load} N puts the load line outside the patch: |moment|/load < "
        "length/2 = {half_length} m is needed",
    ),
)


def iterate_patches(draft: SceneDraft) -> Iterator[tuple[str, Contact]]:
    """Yield the dotted keys and tables of all patches: [contact] and those of interfaces."""
    if draft.tables.contact is not None:
        yield "contact", draft.tables.contact
    for index, interface in enumerate(draft.values.structure.interface):
        if interface.contact:
            yield f"structure.interface.{index}.contact", interface.contact.table


def check_patches(draft: SceneDraft) -> None:
    """Report mistakes inside [contact] and inside the patches of interfaces."""
    for table_key, contact in iterate_patches(draft):
        facts = PatchFacts(draft, table_key, contact)
        check_outlines(facts)
        apply_rules(draft, PATCH_RULES, facts)
        _check_shapes_have_a_piece(draft, table_key, contact)
        _check_coatings(facts)
        if contact.load_line is not None:
            apply_rules(draft, LOAD_LINE_RULES, facts)


def _check_shapes_have_a_piece(draft: SceneDraft, table_key: str, contact: Contact) -> None:
    """Report gap shapes whose table lacks the key `on`, because `Contact.shapes` would leave them out.

    Only a shape that somebody adds to the package can lack this key.
    """
    for name in GAP_SHAPES:
        if getattr(contact, name, None) is not None and name not in contact.shapes:
            draft.add_mistake(
                f"{table_key}.{name}",
                f"[contact.{name}] is a gap shape, but its table has no key `on`, which names the piece with the "
                "shape; add the key to the class of the table in scene/keys/contact.py",
            )


def _check_coatings(patch: PatchFacts) -> None:
    """Report coatings that are not thinner than their piece."""
    pieces: list[tuple[str, Any, float]] = [
        (f"{patch.table_key}.coating.thickness", patch.coating, patch.height)
    ]
    for name in PIECE_NAMES:
        piece = patch[name]
        key = f"{patch.table_key}.{name}." + ("coating.thickness" if piece.coating else "height")
        if piece:
            pieces.append((key, piece.coating or patch.coating, piece.height or patch.height))
    for key, coating, height in pieces:
        if isinstance(coating, TableView) and coating.thickness >= height:
            patch.draft.add_mistake(
                key,
                f"the coating of {coating.thickness} m must be thinner than its piece, which is {height} m high",
            )
