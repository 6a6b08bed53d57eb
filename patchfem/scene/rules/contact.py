"""Rules of [contact] and of patches of interfaces: keys that exclude or need one another."""

from collections.abc import Iterator

from ...effects import GAP_SHAPES
from ..keys.contact import Contact
from ..keys.removed import describe_removed
from .facts import TableFacts
from .outlines import PIECE_KEYS_OF_PATCH, check_outlines, find_flat_length
from .scene_draft import SceneDraft
from .view import TableView

# Largest ratio of the height of a piece to its length; from 80 000 on, the stiffness of
# the piece is lost to round-off.
MAX_PIECE_SLENDERNESS = 10_000
# Largest number of elements along the interface; even with 10 000, the
# dense matrices take gigabytes.
MAX_INTERFACE_ELEMENTS = 100_000


def find_max_load(patch: TableView) -> float:
    """Return the load [N] of a patch at which the mean pressure is Young's modulus of the softer substrate."""
    moduli = [(patch[name].substrate or patch.substrate).young for name in PIECE_KEYS_OF_PATCH]
    return min(moduli) * find_flat_length(patch) * patch.width * patch.pairs


def iterate_patches(draft: SceneDraft) -> Iterator[tuple[str, Contact]]:
    """Yield dotted key and table of all patches of a draft: [contact] and those of interfaces."""
    if draft.tables.contact is not None:
        yield "contact", draft.tables.contact
    for index, interface in enumerate(draft.values.structure.interface):
        if interface.contact:
            yield f"structure.interface.{index}.contact", interface.contact.table


def check_patches(draft: SceneDraft) -> None:
    """Report mistakes inside [contact] of a draft and inside the patches of its interfaces."""
    for table_key, contact in iterate_patches(draft):
        patch = TableFacts(draft, table_key, contact)
        check_outlines(patch)
        flat_length = find_flat_length(patch)
        _check_sizes(patch, flat_length)
        _check_mesh(patch, flat_length)
        _check_area(patch)
        _check_load_line(patch, flat_length / 2)
        _check_coatings(patch)
        _check_shapes_have_a_piece(patch)


def _check_sizes(patch: TableFacts, flat_length: float) -> None:
    """Report a load or a height of a patch that no elastic piece has, and a step outside it.

    `flat_length` [m] is the length over which both faces are flat.
    """
    max_load = find_max_load(patch)
    if patch.load >= max_load:
        patch.add_mistake(
            "load",
            f"{patch.load:.3g} N is a mean pressure above Young's modulus, but the pieces are elastic and strain "
            f"little; less than {max_load:.3g} N is needed",
        )
    max_height = MAX_PIECE_SLENDERNESS * patch.length
    if patch.height > max_height:
        patch.add_mistake(
            "height",
            f"{patch.height:g} m is more than {MAX_PIECE_SLENDERNESS} times contact.length, but the stress is noticeable "
            f"only to a depth of a few times contact.length; use at most {max_height:.3g} m, and represent the rest of "
            "the height by a spring of the structure",
        )
    if abs(patch.step.at) >= flat_length / 2:
        patch.add_mistake(
            "step.at", f"{patch.step.at} m lies outside the patch: |`at`| < length/2 is needed"
        )


def _check_mesh(patch: TableFacts, flat_length: float) -> None:
    """Report elements of a patch that are longer than its face, or too many.

    `flat_length` [m] is the length over which both faces are flat.
    """
    size = patch.element_size
    if size > flat_length:
        name = "contact.length =" if flat_length == patch.length else "the interface length of"
        patch.add_mistake(
            "element_size", f"{size} m is longer than {name} {flat_length} m; give shorter elements"
        )
    if patch.length > MAX_INTERFACE_ELEMENTS * size:
        patch.add_mistake(
            "element_size",
            f"elements of {size:g} m on a length of {patch.length:g} m are more than {MAX_INTERFACE_ELEMENTS}; use at least "
            f"{patch.length / MAX_INTERFACE_ELEMENTS:.3g} m, or leave this key out",
        )


def _check_area(patch: TableFacts) -> None:
    """Report a load line outside a face, a hardness below the mean pressure, and unequal pieces that slip."""
    line = patch.load_line.across
    if abs(line) >= patch.width / 2:
        patch.add_mistake(
            "load_line.across",
            f"{line} m lies outside the patch: |across| < width/2 = {patch.width / 2} m is needed",
        )
    mean = patch.load / (patch.pairs * patch.length * patch.width)
    if patch.area.hardness <= mean:
        patch.add_mistake(
            "area.hardness",
            f"{patch.area.hardness:g} Pa is not above the mean pressure of the load, {mean:.3g} Pa, so the cells cannot "
            "carry it: raise the hardness or lower contact.load",
        )
    # A normal pressure on unequal pieces also moves their faces sideways, which the cells do not couple.
    if patch.area and patch.shear and _are_pieces_different(patch):
        patch.add_mistake(
            "shear",
            "pieces of different elasticity couple pressure and shear stress, which [contact.area] neglects: make the "
            "pieces equal, or leave out [contact.shear]",
        )


def _are_pieces_different(patch: TableFacts) -> bool:
    """Return whether the two pieces of a patch have different heights, substrates or coatings."""
    pieces = []
    for name in PIECE_KEYS_OF_PATCH:
        piece = patch[name].table
        values = [getattr(piece, key, None) for key in ("height", "substrate", "coating")]
        general = (patch.table.height, patch.table.substrate, patch.table.coating)
        pieces.append([own or other for own, other in zip(values, general)])
    return pieces[0] != pieces[1]


def _check_load_line(patch: TableFacts, half_length: float) -> None:
    """Report a load line outside the patch, and an approach of a piece that can rotate.

    `half_length` [m] is half the length over which both faces are flat.
    """
    if patch.approach and (patch.has("load_line") or patch.holder.rotational_stiffness):
        patch.add_mistake("approach", describe_removed("an approach of a piece that can rotate"))
    line = patch.load_line
    if abs(line.offset) >= half_length:
        patch.add_mistake(
            "load_line.offset",
            f"{line.offset} m lies outside the patch: |offset| < length/2 = {half_length} m is needed",
        )
    if line.moment and abs(line.moment) >= half_length * patch.load:
        patch.add_mistake(
            "load_line.moment",
            f"{line.moment} N m divided by the load {patch.load} N puts the load line outside the patch: |moment|/load "
            f"< length/2 = {half_length} m is needed",
        )


def _check_coatings(patch: TableFacts) -> None:
    """Report coatings of a patch that are not thinner than their piece."""
    layers = [("coating.thickness", patch.coating, patch.height)]
    for name in PIECE_KEYS_OF_PATCH:
        piece = patch[name]
        key = f"{name}.coating.thickness" if piece.coating else f"{name}.height"
        if piece:
            layers.append((key, piece.coating or patch.coating, piece.height or patch.height))
    for key, coating, height in layers:
        # The coating of a piece may be the word "none".
        if isinstance(coating, TableView) and coating.thickness >= height:
            patch.add_mistake(
                key,
                f"the coating of {coating.thickness} m must be thinner than its piece, which is {height} m high",
            )


def _check_shapes_have_a_piece(patch: TableFacts) -> None:
    """Report gap shapes of a patch whose table lacks the key `on`.

    `Contact.shapes` leaves them out. Only a shape that somebody adds to the package can lack this key.
    """
    for name in GAP_SHAPES:
        if getattr(patch.table, name, None) is not None and name not in patch.table.shapes:
            patch.add_mistake(
                name,
                f"[contact.{name}] is a gap shape, but its table has no key `on`, which names the piece with the "
                "shape; add the key to the class of the table in scene/keys/contact.py",
            )
