"""Contact points of pieces that deform in shear, over grooves, or under the pressure of a lower piece.

In: a model and its Patch. Out: `points.contacts.Contact`s of benches and rigs, and the fields of grooves.
"""

from dataclasses import replace

import numpy as np

from ...contact.stiffness import tangential_stiffness
from ...effects import law_has_trait
from ...points import contacts
from ...slip import shear_modes
from ...slip.fields import bond_shear_modes

# Ratio of the assumed pressure of an initially unloaded node of the lower piece to the mean
# pressure.
OPEN_PRESSURE_FRACTION = 1e-3
# Bond length of the points that represent Coulomb's law over grooves, relative to the tolerance times the slide at gross
# slip; on flat ground the force is then wrong by at most .17 of the tolerance, relative to the friction limit.
COULOMB_LENGTH_RATIO = 0.1
# Smallest bond length for the choice of shear modes over grooves, relative to the slide at gross slip.
MIN_LENGTH_RATIO = 1e-3


def make_flank_contact(model, load: float, patch=None, n_modes: int | None = None):
    """Return the points of a law with memory on the flanks of grooves.

    A bench has no lifted mass. Coulomb's law at points of pieces that deform in shear is an elastic-plastic law of a
    short length.

    Parameters
    ----------
    model : Model
        Model of a bench or a rig with grooves.
    load : float
        Normal load [N].
    patch : Patch, optional
        Patch whose pieces deform in shear.
    n_modes : int, optional
        Number of shear modes of the pieces; default: by the tolerance.

    Returns
    -------
    points.contacts.Contact
    """
    f = model.friction
    law = model.bonds if law_has_trait(f.law, "bonds") else f

    # On a rig the lifted mass is compared to the modal mass at the interface, m / (s . s).
    grooves = model.grooves
    row = np.zeros(0)
    if model.rig is None:
        grooves = replace(grooves, lifted_mass=0.0)
    else:
        modes = model.rig.modes
        row = modes.slide
        grooves.check_lifted_mass(f.static, modes.mass / float(modes.slide @ modes.slide))

    if not model.partial_slip:
        return contacts.make_flank_contact(law, grooves, load, row)

    # Points on pieces that deform in shear: limit mu N of each node, and the length over which it
    # is reached.
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    limit = f.static * force
    tolerance = model.accuracy.tolerance
    length = getattr(law, "length", None) or f.bond_length

    # Coulomb's law yields at once; a length far below the slide at gross slip, sum(limit) / k_t,
    # replaces the jump.
    if not length:
        compliance = patch.slip_compliance
        gross_slip_slide = limit.sum() / tangential_stiffness(compliance, force > 0)
        law = f.model_copy(
            update={"bond_length": COULOMB_LENGTH_RATIO * tolerance * gross_slip_slide}
        )
        length = max(COULOMB_LENGTH_RATIO * tolerance, MIN_LENGTH_RATIO) * gross_slip_slide

    # Growth makes the friction in motion smaller: `weakening` is the static / kinetic coefficient.
    weakening = 1.0
    if getattr(law, "has_growth", False):
        weakening = 1 / law.ratio if law.ratio > 0 else np.inf

    if n_modes is not None:
        reduced = shear_modes.shear_modes(patch.slip_compliance, limit, length, n_modes, weakening)
    else:
        reduced = shear_modes.find_sufficient_modes(
            patch.slip_compliance,
            limit,
            length,
            shear_modes.N_SHEAR_MODES,
            0.1 * tolerance,
            weakening,
        )

    # The load of the grooves is distributed over the points as the pressure is.
    shares = force[reduced.points] / force.sum()
    return contacts.make_flank_contact(law, grooves, load, row, reduced, shares)


def compute_groove_fields(patch, contact, snapshots) -> tuple:
    """Return traction (f, m) [Pa] and slip (f, m) [m] at the nodes of a patch over grooves.

    Parameters
    ----------
    patch : Patch
        Patch whose pieces deform in shear.
    contact : points.contacts.Contact
        Points of the law on the flanks, reduced to shear modes.
    snapshots : sequence of points.time_march.Snapshot
        States of the points in the f frames.
    """
    index = contact.reduction.points
    weight = patch.pieces.interface.weight[index]
    shares = np.array([law.load for law in contact.point_sets[0].laws])
    shares = shares / shares.sum()
    tau = np.zeros((len(snapshots), patch.x.size))
    local = np.zeros((len(snapshots), patch.x.size))
    for i, one in enumerate(snapshots):
        t = float(contact.grooves.slope(one.slide))
        length = np.hypot(1.0, t)
        tau[i, index] = (one.vertical * shares * t + one.forces * length) / weight
        local[i] = one.slide
        local[i, index] -= (one.stretch + one.bend) / length
    return tau, local


def make_bond_sum(law, choice) -> "contacts.BondSum | None":
    """Return the settings of a sum over lists of bonds; None for the recursion.

    Parameters
    ----------
    law : Bonds
        Parameters of the bond law.
    choice : EngineChoice or None
        Method of bond summation.
    """
    if choice is None or choice.engine == "recursion":
        return None
    return contacts.BondSum(law, choice.reach(law.order), choice.merge)


def compute_point_shear_modes(model, patch, n_modes: int | None = None):
    """Return the shear modes of the contact points of a nonlocal law.

    If the pressure is fixed to the lower piece, all nodes are contact points. An initially unloaded
    node then has OPEN_PRESSURE_FRACTION times the mean pressure of the loaded nodes.

    Parameters
    ----------
    model : Model
        Model with a law whose stretch varies along the interface.
    patch : Patch
        Solved patch, which gives limits and compliance of the points.
    n_modes : int, optional
        Number of modes; default: by the scene, otherwise by the tolerance.
    """
    law = model.bonds
    sigma = patch.pressure.sigma_n
    tolerance = 0.1 * model.accuracy.tolerance
    n_modes = n_modes or model.accuracy.shear_modes
    if model.side != "lower":
        return bond_shear_modes(patch, law, n_modes, tolerance)
    # A single mode is computed first, because this rejects a patch that could jump at constant
    # displacement.
    bond_shear_modes(patch, law, 1, 1.0)
    return bond_shear_modes(
        patch,
        law,
        n_modes,
        tolerance,
        sigma=np.maximum(sigma, OPEN_PRESSURE_FRACTION * mean_loaded_pressure(patch)),
    )


def mean_loaded_pressure(patch) -> float:
    """Return the mean pressure [Pa] over the loaded nodes."""
    return patch.pressure.load / float(patch.pieces.interface.weight @ (patch.pressure.sigma_n > 0))


def count_shear_modes(model, patch) -> int | None:
    """Return the number of shear modes of a bench run with bonds; None if it uses none."""
    if (
        not model.partial_slip
        or not law_has_trait(model.friction.law, "bonds")
        or model.grooves is not None
    ):
        return None
    return compute_point_shear_modes(model, patch).stiffness.size


def make_lower_contact(model, patch, row, modes, bond_sum) -> contacts.Contact:
    """Return the points of bonds at all nodes, under a pressure that is fixed to the lower piece.

    Parameters
    ----------
    model : Model
        Model with a bond law.
    patch : Patch
        Solved patch, whose pressure moves with the lower piece.
    row : (n,) array
        Slide per modal coordinate.
    modes : ShearModes or None
        Shear modes at the nodes; None for pieces that are rigid in shear.
    bond_sum : BondSum or None
        Sum over lists of bonds, or None for the recursion.
    """
    mean = mean_loaded_pressure(patch)
    return contacts.make_bond_contact(
        model.bonds,
        mean * patch.pieces.interface.weight,
        row,
        modes,
        bond_sum,
        np.stack([patch.x, patch.pressure.sigma_n / mean]),
    )
