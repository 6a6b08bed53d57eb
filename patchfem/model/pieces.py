"""The two pieces of a patch: layers, grids, nominal stiffness, and whether they are alike."""

from ..core import PatchfemError
from ..elasticity.elasticity import Layers
from ..mesh.tensor import TensorGrid, graded_grid

AUTOMATIC_CELLS = 200  # along the interface where neither the scene nor the tolerance decides


def layers_of(contact, side: str) -> Layers:
    """Elastic layers of one piece."""
    _, substrate, coating = piece_of(contact, side)
    coat = coating.material if coating else substrate
    return Layers((coat.young, coat.poisson), (substrate.young, substrate.poisson), contact.plane)


def grid_of(scene, side: str = "lower") -> TensorGrid:
    """The tensor grid that is made for a piece of a scene without a mesh file."""
    contact = scene.contact
    height, _, coating = piece_of(contact, side)
    size = contact.element_size or contact.length / AUTOMATIC_CELLS
    return graded_grid(contact.length, height, size, coating.thickness if coating else 0.0)


def bodies_of(scene) -> tuple:
    """(lower piece, upper piece or None where it is alike): grids that are made, the tensor grid recognised in the
    named mesh file, or its two pieces of any triangles and quads."""
    contact = scene.contact
    if contact.mesh is None:
        return grid_of(scene), grid_of(scene, "upper") if unlike(contact) else None
    from ..mesh.files import read_grid, read_pieces

    path = scene.beside(contact.mesh)
    try:
        low, high = read_grid(path), None
    except PatchfemError:  # no tensor grid of alike pieces; what is wrong with the file is said by the general reader
        pair = read_pieces(path)
        low, high = pair.lower, pair.upper
    for side, body in (("lower", low), ("upper", high or low)):
        _matches(scene, side, body)
    return low, low if high is None and unlike(contact) else high


def _matches(scene, side: str, body) -> None:
    contact = scene.contact
    height, _, coating = piece_of(contact, side)
    thickness = coating.thickness if coating else 0.0
    for key, mine, wanted in (("length", body.length, contact.length), ("height", body.height, height),
                              ("coating.thickness", body.coating, thickness)):
        if abs(mine - wanted) > 1e-6 * contact.length:
            raise PatchfemError(f"{scene.where('contact.' + key)}: {wanted:.9g} m, the {side} piece of the mesh has "
                                f"{mine:.9g} m")


def unlike(contact) -> bool:
    """Whether the pieces differ in height, material or coating."""
    return piece_of(contact, "lower") != piece_of(contact, "upper")


def piece_of(contact, side: str) -> tuple:
    """(height, substrate, coating or None) of one piece, its own table before the common keys."""
    own = getattr(contact, side)
    height, substrate, coating = contact.height, contact.substrate, contact.coating
    if own is not None:
        height, substrate = own.height or height, own.substrate or substrate
        coating = None if own.coating == "none" else own.coating or coating
    return height, substrate, coating


def _bars(contact, softness) -> float:
    """Sum over the layers of both pieces of thickness * softness(material), all pairs together, per area [m/N]."""
    total = 0.0
    for height, substrate, coat in (piece_of(contact, side) for side in ("lower", "upper")):
        total += (height - (coat.thickness if coat else 0.0)) * softness(substrate)
        total += coat.thickness * softness(coat.material) if coat else 0.0
    return total / (contact.pairs * contact.length * contact.width)


def nominal_load(scene) -> float:
    """The load of a scene [N]; for a prescribed approach that of the layers as bars in series, an upper estimate."""
    contact = scene.contact
    if contact is None:
        return scene.normal.load if scene.normal is not None else 0.0
    if contact.load is not None:
        return contact.load
    return contact.approach.distance / _bars(contact, lambda m: (1 - m.poisson**2) / m.young)


def block_shear(contact) -> float:
    """Shear stiffness [N/m] of two blocks in series, layer by layer; short blocks held at both faces are stiffer."""
    return 1 / _bars(contact, lambda m: 2 * (1 + m.poisson) / m.young)
