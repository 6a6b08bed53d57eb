"""Friction law with a spatially averaged pressure, for points of a patch or a rigidly sliding block.

In: the keys of law 'convolution' and a Patch with the static contact solution. Out: the averaged pressure, the loads that
limit the friction of the nodes in both directions, the ratio of the slip force to mu_s N, and nodal tractions.
"""

import numpy as np

from ...core import PatchfemError
from ...effects import describe_unsupported, import_effect, law_has_trait


def find_tractions(keys, patch, direction: float, offset: float = 0.0) -> np.ndarray:
    """Return the averaged pressure (m,) [Pa] at the loaded nodes of the upper piece, or 0 at open nodes.

    The law averages the pressure over the part of the surface that the node has just passed, that is, behind it in the
    direction of the motion. The cells of a face are averaged along their row.

    Parameters
    ----------
    keys : Friction
        Effective keys of a law whose pressure is averaged along the motion.
    patch : Patch
        Solved patch, whose pressure is averaged.
    direction : float
        Sign of the motion.
    offset : float
        Displacement [m] of the upper piece over the pressure, which ends where the lower piece does.
    """
    average_pressure = import_effect("friction.law=convolution").average_pressure
    n_rows = 1 if patch.model.area is None else patch.shape[0]
    rows = []
    for x, sigma in zip(patch.x.reshape(n_rows, -1), patch.pressure.sigma_n.reshape(n_rows, -1)):
        average = average_pressure(x + offset, x, sigma, direction, keys.bond_length, keys.order)
        is_loaded = np.interp(x + offset, x, sigma, left=0.0, right=0.0) > 0
        rows.append(np.where(is_loaded, average, 0.0))
    return np.concatenate(rows)


def find_loads(keys, patch) -> np.ndarray | None:
    """Return the loads (2, m) [N] that limit the friction of the nodes of a patch in slides to +x and to -x.

    They are None without a patch, and for a law that does not average the pressure.

    Parameters
    ----------
    keys : Friction
        Effective keys of the law.
    patch : Patch or None
        Solved patch.
    """
    if patch is None or not law_has_trait(keys.law, "averaged"):
        return None
    tractions = [find_tractions(keys, patch, direction) for direction in (1.0, -1.0)]
    return np.array(tractions) * patch.pieces.interface.weight


def make_averages(keys, patch) -> np.ndarray | None:
    """Return the weights (2, m, m - 1, 2) by which averages follow from nodal forces, for slides to +x and to -x.

    Entry (k, j, s, i) is the share of the load that limits node j that end i of segment s gives per newton. They are None
    for a law that does not average the pressure.

    Parameters
    ----------
    keys : Friction
        Effective keys of the law.
    patch : Patch
        Patch whose pressure changes.
    """
    if not law_has_trait(keys.law, "averaged"):
        return None
    x = patch.x
    area = patch.pieces.interface.weight
    law = import_effect("friction.law=convolution")
    forward = law.compute_segment_weights(x, x, keys.bond_length, keys.order)
    back = law.compute_segment_weights(-x[::-1], -x[::-1], keys.bond_length, keys.order)
    weights = np.stack([forward, back[::-1, ::-1, ::-1]])
    return weights * area[:, None, None] / np.stack([area[:-1], area[1:]], axis=1)


def replace_law(keys, patch):
    """Return Coulomb's law in place of a law that averages the pressure; other laws are unchanged.

    On a rigid block the sum of the friction limits of all nodes is a constant fraction of the load, which replaces the
    coefficient of friction.

    Parameters
    ----------
    keys : Friction
        Effective keys of the friction law.
    patch : Patch or None
        Solved patch with the pressure; None for a single point.

    Raises
    ------
    PatchfemError
        If the slip force differs between the two directions of sliding.
    """
    if not law_has_trait(keys.law, "averaged"):
        return keys
    static = keys.static
    if patch is not None:
        forward, back = find_loads(keys, patch).sum(axis=1)
        # Largest relative difference between the slip forces forward and backward that counts as
        # zero.
        if abs(forward - back) > 1e-9 * max(forward, back):
            raise PatchfemError(
                describe_unsupported(
                    f"law '{keys.law}' with a pressure that is not symmetric (slip force {forward * static:.6g} N "
                    f"forward, {back * static:.6g} N back)",
                    "use 'march'",
                ),
                "accuracy.method",
            )
        static *= (forward + back) / 2 / patch.pressure.load
    return keys.model_copy(update={"law": "coulomb", "static": static, "kinetic": static})


def distribute_slip_force(keys, patch, forces, offsets) -> np.ndarray:
    """Distribute the friction force of a slipping rigid block over its nodes.

    The tractions are proportional to the pressure averaged in the direction of the force.

    Parameters
    ----------
    keys : Friction
        Effective keys of a law whose pressure is averaged along the motion.
    patch : Patch
        Solved patch, which gives nodes and pressure.
    forces, offsets : (f,)
        Resultant forces [N], and displacements [m] of the upper piece over the pressure.

    Returns
    -------
    (f, m)
        Tractions [Pa].
    """
    tractions = np.zeros((len(forces), patch.x.size))
    for row, force, offset in zip(tractions, forces, offsets):
        traction = find_tractions(keys, patch, 1.0 if force >= 0 else -1.0, offset)
        row += force * traction / max(patch.pieces.interface.weight @ traction, 1e-300)
    return tractions
