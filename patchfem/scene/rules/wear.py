"""Rules of [wear.friction]."""

from itertools import pairwise

from ...effects import law_takes_key, name_laws_with_key
from .facts import TableFacts
from .grooves import find_grooves, find_steepest_slope
from .scene_draft import SceneDraft
from .view import UNKNOWN_VALUE


def check_wear(draft: SceneDraft) -> None:
    """Report mistakes in [wear.friction] of a scene draft."""
    wear = TableFacts(draft, "wear", draft.tables.wear)
    if wear.friction:
        _check_friction(wear)
        _check_law(wear)


def _check_friction(wear: TableFacts) -> None:
    """Report wear depths that do not rise from 0, and factors that do not begin with 1."""
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
    """Report factors in [wear.friction] on a key that the law lacks, or with which the pieces lock.

    `wear` is the table [wear].
    """
    law = wear.scene.friction
    if wear.friction.bond_length_factor and not law_takes_key(law.law, "bond_length"):
        wear.add_mistake(
            "friction.bond_length_factor",
            f"law '{law.law}' has no bond_length; leave this key out, or use {name_laws_with_key('bond_length')}",
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
