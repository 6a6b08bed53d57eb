"""What the law of friction adds to a plan: its link of the stiffness chain and its groups."""

from ..effects import has
from ..friction.record import law_from
from ..model.model import Model


def link(model: Model) -> dict:
    """Last links of the stiffness chain: grooves, and of every interface bonds, or slip."""
    load = model.nominal_load
    if not load > 0:
        return {}
    valley = {"grooves": model.grooves.stiffness(load)} if model.grooves is not None else {}
    others = model.rig.interfaces[1:] if model.rig is not None else ()
    return valley | _of_law(model.friction, load) | {
        f"bonds_{k}": _of_law(one.numbers, load if one.load is None else one.load)["bonds"]
        for k, one in enumerate(others, 2)}


def _of_law(f, load: float) -> dict:
    """The link of a law under a load [N]."""
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


def words(model: Model) -> list:
    """The sentence on the grooves that the load climbs; none without them."""
    load = model.nominal_load
    if model.grooves is None or not load > 0:
        return []
    g, mu = model.grooves, model.friction.static
    return [f"the grooves hold like a spring N k^2 A = {g.stiffness(load):.4g} N/m about their bottom, and up to "
            f"{g.capacity(load, mu):.4g} N on their steepest flank, where friction alone holds mu N = {mu * load:.4g} "
            "N"]
