"""Rules of [wear]: what wear needs."""

from itertools import pairwise

from ...effects import law_takes_key, name_laws_with_key
from .facts import TableFacts
from .grooves import find_grooves, find_steepest_slope
from .scene_draft import SceneDraft
from .view import UNKNOWN_VALUE


def check_wear(draft: SceneDraft, kind: str) -> None:
    """Report mistakes in [wear]."""
    wear = TableFacts(draft, "wear", draft.tables.wear)
    if draft.tables.wear is None:
        return
    if kind == "patch":
        draft.add_mistake(
            "wear",
            "wear needs a slide: add [friction] with [slide], or with [structure] and [drive]",
        )
    if wear.friction:
        _check_friction(wear)
        _check_law(wear)
    if wear.scene.normal:
        _check_point(wear)
        return
    contact = wear.scene.contact
    has_coating = contact.coating or contact.upper.coating or contact.lower.coating
    if wear.has("upper_share") and find_grooves(draft) is None and not has_coating:
        wear.add_remark(
            "upper_share",
            "has no effect on the measures without grooves or a coating: the measure worn_depth is the depth worn off "
            "both pieces together",
        )


def _check_point(wear: TableFacts) -> None:
    """Report keys that need a worn depth, which a contact point does not have."""
    if wear.friction:
        wear.add_mistake(
            "friction",
            "a [normal] contact has no area, so its wear has no depth: use [contact]",
        )
    if wear.has("start"):
        wear.add_mistake(
            "start",
            "[normal] is a point and has no worn depth to start from: use [contact], or leave wear.start out and add "
            "the worn volumes of both runs",
        )
    for key in ("jumps", "upper_share"):
        if wear.has(key):
            wear.add_remark(key, "has no meaning without [contact] and is not used")


def _check_friction(wear: TableFacts) -> None:
    """Report depths that do not rise from 0, and factors that do not begin with 1."""
    depths = tuple(wear.friction.depth)
    if depths and (depths[0] or not all(low < high for low, high in pairwise(depths))):
        wear.add_mistake(
            "friction.depth",
            'depths that rise from 0 are needed, such as ["0 um", "1 um", "5 um"]',
        )
    for key in ("coefficient_factor", "bond_length_factor"):
        for factor in tuple(wear.friction[key])[:1]:
            if factor != 1:
                wear.add_mistake(
                    f"friction.{key}",
                    f"the first factor must be 1, not {factor:g}, because [friction] itself describes the contact at "
                    "depth 0",
                )


def _check_law(wear: TableFacts) -> None:
    """Report factors on a key that the friction law does not have, or with which the pieces lock."""
    law = wear.scene.friction
    if wear.friction.bond_length_factor and not law_takes_key(law.law, "bond_length"):
        wear.add_mistake(
            "friction.bond_length_factor",
            f"law '{law.law}' has no bond_length; leave this key out, or use {name_laws_with_key('bond_length')}",
        )
    elif wear.friction.bond_length_factor and law.stiffness:
        wear.add_mistake(
            "friction.bond_length_factor",
            "has no meaning with friction.stiffness; give friction.bond_length in place of friction.stiffness",
        )
    if wear.friction.coefficient_factor and law.static == 0:
        wear.add_remark("friction.coefficient_factor", "has no effect, because static = 0")

    # The largest factor on the friction of grooves without wear.
    factor = max(wear.friction.coefficient_factor, default=UNKNOWN_VALUE)
    grooves = find_grooves(wear.draft)
    if grooves is None:
        return
    slope = find_steepest_slope(grooves)
    if factor * law.static * slope >= 1 > law.static * slope:
        wear.add_mistake(
            "friction.coefficient_factor",
            f"{factor:g} raises static to {factor * law.static:g}, at which the pieces lock on the flanks of the "
            f"unworn grooves (slope {slope:.6g}); factors below {1 / slope / law.static:.6g} are needed",
        )
