"""A scene whose contact pushes and turns the modes as well as it rubs, or whose load is prescribed in time."""


from ...dynamics.march import varying_load as march
from ...model.model import Model


def rubbing_of(model: Model):
    """The dynamics.march.varying_load.Rubbing of the law of a model."""
    f = model.friction
    if f.law == "coulomb":
        return march.coulomb(f.static, f.kinetic)
    if f.law == "tanh":
        return march.rate(f.static, f.reference_speed)
    if f.law == "elastic-plastic":
        return march.plastic(f.static, f.bond_length)
    return march.bonds(model.bonds)


def varying_load_model(model: Model, patch, count: int | None = None):
    """The VaryingLoadModel of a rig whose load changes; patch: the solved Patch or None under [normal]; count: how many
    shear modes stand for pieces that give way, None: by the tolerance."""
    load, sets = (model.point.at, None) if patch is None else (None, march.sets_of(patch, model.patch.spring))
    law, shear = rubbing_of(model), None
    if model.soft:
        weight = patch.pieces.interface.weight
        shear = march.shear_of(patch.giving, law, patch.pressure.sigma_n * weight, weight, count,
                                model.accuracy.tolerance)
    return march.model_of(model.rig.modes, law, sets, load, shear)
