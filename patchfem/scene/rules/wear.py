"""Rules of [wear]: what wear needs."""

from itertools import pairwise
from math import pi

from ...effects import law_takes_key, name_laws_with_key
from .grooves import find_groove_key, find_groove_table
from .rule_table import (
    MistakeRule,
    RemarkRule,
    TableFacts,
    apply_rules,
)
from .scene_draft import SceneDraft
from .view import UNKNOWN_VALUE, TableView

FACTOR_KEYS = ("coefficient_factor", "bond_length_factor")


class WearFacts(TableFacts):
    """Properties of the scene that the checks of [wear] use."""

    def __init__(self, draft: SceneDraft, kind: str) -> None:
        super().__init__(draft, "wear", draft.tables.wear)
        self.kind = kind

    @property
    def law(self) -> TableView:
        """The friction law of the scene."""
        return self.scene.friction

    @property
    def has_coating(self) -> bool:
        """Whether a piece may have a coating."""
        contact = self.scene.contact
        return bool(contact.coating or contact.upper.coating or contact.lower.coating)

    @property
    def depths(self) -> tuple:
        """Worn depths [m] at which factors are given, or () if they are not known."""
        return self.friction.depth or ()

    @property
    def slope(self) -> float:
        """Steepest slope of the flanks of the grooves."""
        grooves = find_groove_table(self.draft)
        return 2 * pi * grooves.amplitude / grooves.wavelength

    @property
    def max_factor(self) -> float:
        """Largest factor on the coefficients of friction."""
        return max(self.friction.coefficient_factor, default=UNKNOWN_VALUE)

    @property
    def max_static(self) -> float:
        """Largest coefficient of static friction."""
        return self.law.static * self.max_factor

    @property
    def locking_factor(self) -> float:
        """Factor on the friction above which the pieces lock on the groove flanks."""
        return 1 / self.slope / self.law.static


MOTION_RULES = (
    MistakeRule(
        lambda w: w.kind == "patch",
        "wear",
        "wear needs a slide: add [friction] with [slide], or with [structure] and [drive]",
    ),
)
FRICTION_RULES = (
    MistakeRule(
        lambda w: w.scene.normal,
        "wear.friction",
        "a [normal] contact has no area, so its wear has no depth: use [contact]",
    ),
    MistakeRule(
        lambda w: w.depths and not _increases_from_zero(w.depths),
        "wear.friction.depth",
        'depths that rise from 0 are needed, such as ["0 um", "1 um", "5 um"]',
    ),
    *(
        MistakeRule(
            lambda w, key=key: w.friction[key] and w.friction[key][0] != 1,
            f"wear.friction.{key}",
            f"the first factor must be 1, not {{friction.{key}[0]:g}}, because [friction] itself describes the contact at "
            "depth 0",
        )
        for key in FACTOR_KEYS
    ),
)
LAW_RULES = (
    MistakeRule(
        lambda w: w.friction.bond_length_factor and not law_takes_key(w.law.law, "bond_length"),
        "wear.friction.bond_length_factor",
        f"law '{{law.law}}' has no bond_length; leave this key out, or use {name_laws_with_key('bond_length')}",
    ),
    MistakeRule(
        lambda w: (
            w.friction.bond_length_factor
            and law_takes_key(w.law.law, "bond_length")
            and w.law.stiffness
        ),
        "wear.friction.bond_length_factor",
        "has no meaning with friction.stiffness; give friction.bond_length in place of friction.stiffness",
    ),
    RemarkRule(
        lambda w: w.friction.coefficient_factor and w.law.static == 0,
        "wear.friction.coefficient_factor",
        "has no effect, because static = 0",
    ),
    MistakeRule(
        lambda w: w.max_static * w.slope >= 1 > w.law.static * w.slope,
        "wear.friction.coefficient_factor",
        "{max_factor:g} raises static to {max_static:g}, at which the pieces lock on the flanks of the unworn grooves "
        "(slope {slope:.6g}); factors below {locking_factor:.6g} are needed",
    ),
)
START_RULES = (
    MistakeRule(
        lambda w: w.scene.normal and w.has("start"),
        "wear.start",
        "[normal] is a point and has no worn depth to start from: use [contact], or leave wear.start out and add the "
        "worn volumes of both runs",
    ),
    *(
        RemarkRule(
            lambda w, key=key: w.scene.normal and w.has(key),
            f"wear.{key}",
            "has no meaning without [contact] and is not used",
        )
        for key in ("jumps", "upper_share")
    ),
    RemarkRule(
        lambda w: (
            not w.scene.normal
            and w.has("upper_share")
            and not find_groove_key(w.draft)
            and not w.has_coating
        ),
        "wear.upper_share",
        "has no effect on the measures without grooves or a coating: the measure worn_depth is the depth worn off both "
        "pieces together",
    ),
)


def check_wear(draft: SceneDraft, kind: str) -> None:
    """Report mistakes in [wear]."""
    if draft.tables.wear is None:
        return
    facts = WearFacts(draft, kind)
    apply_rules(draft, MOTION_RULES, facts)
    if facts.friction:
        apply_rules(draft, FRICTION_RULES, facts)
    if facts.friction and draft.tables.friction is not None:
        apply_rules(draft, LAW_RULES, facts)
    apply_rules(draft, START_RULES, facts)


def _increases_from_zero(values: tuple) -> bool:
    """Return whether values start at 0 and increase strictly."""
    return values[0] == 0 and all(low < high for low, high in pairwise(values))
