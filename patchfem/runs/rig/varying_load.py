"""Contact model whose normal load changes with the motion or is prescribed over time.

In: a Model, its Numerics and its Patch. Out: a VaryingLoadModel of `dynamics.march.varying_load`.
"""

from ...dynamics.march import varying_load as march
from ...effects import needs_bond_list
from ...model.model import Model
from .bond_lists import choose_bond_summation
from .numerics import Numerics


def make_varying_load_law(model: Model, numerics: Numerics):
    """Convert the friction law of a model to one for varying normal load."""
    f = model.friction
    if f.law == "coulomb":
        return march.make_coulomb_law(f.static, f.kinetic)
    if f.law == "tanh":
        return march.make_tanh_law(f.static, f.reference_speed)
    if f.law == "elastic-plastic":
        return march.make_elastic_plastic_law(f.static, f.bond_length)
    if not needs_bond_list(f):
        return march.make_bonds_law(model.bonds)
    choice = choose_bond_summation(model, numerics)
    return march.make_bond_lists_law(model.bonds, choice.reach(f.order), choice.merge)


def make_varying_load_model(model: Model, numerics: Numerics, patch):
    """Return the contact model of a rig under varying normal load.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    patch : Patch or None
        None under [normal].
    """
    load = None
    sets = None
    if patch is None:
        load = model.point.evaluate
    else:
        sets = march.make_contact_sets(patch, model.patch.loading.rotational_stiffness)
    law = make_varying_load_law(model, numerics)
    shear = None
    if model.partial_slip:
        weight = patch.pieces.interface.weight
        shear = march.choose_shear_modes(
            patch.slip_compliance,
            law,
            patch.pressure.sigma_n * weight,
            weight,
            numerics.shear_modes,
            model.accuracy.tolerance,
        )
    return march.make_model(model.rig.modes, law, sets, load, shear)
