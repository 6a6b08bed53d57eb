"""What the law of friction adds to a plan: its link of the stiffness chain and its groups."""

from ..effects import has
from ..friction.record import law_from
from ..model.model import Model


def link(model: Model) -> dict:
    """Last link of the stiffness chain: bonds, or slip."""
    f, load = model.friction, model.nominal_load
    if not load > 0:
        return {}
    rigid = "none: it creeps" if has(f.law, "creeps") else "rigid until it slips"
    if has(f.law, "bonds"):
        return {"bonds": f.static * load / f.bond_length}
    if has(f.law, "averaged"):
        return {"bonds": rigid}
    one = law_from(f, load).element(load)
    return {"bonds": one.limit / one.length if one.length else rigid}


def groups(model: Model) -> dict:
    """Dimensionless groups of the law by name."""
    if model.spread is None:
        return {}
    from ..friction.bonds.spread import pad_factor

    return {"share_of_the_spread": pad_factor(model.pad, model.spread)}
