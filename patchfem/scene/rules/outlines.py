"""Rules of the outlines of the two pieces: their lengths and the shape of their ends."""

from typing import Any

from .rule_table import TableFacts
from .view import UNKNOWN_VALUE, TableView

PIECE_NAMES = ("upper", "lower")
END_KEYS = ("chamfer", "end_radius")
# Smallest end, or difference of lengths, as a fraction of the length of a piece; a smaller
# one is smaller than any element.
MIN_END_FRACTION = 1e-5


def find_piece_length(contact: TableView, name: str) -> float:
    """Return the length [m] of the piece "upper" or "lower"."""
    return contact[name].length or contact.length


def find_flat_length(patch: TableView) -> float:
    """Return the length [m] over which both faces are flat and opposite, or UNKNOWN_VALUE if there is none."""
    lengths = []
    for name in PIECE_NAMES:
        end = max(patch[name][key] or 0.0 for key in END_KEYS) if patch[name] else 0.0
        length = find_piece_length(patch, name) - 2 * end
        if not length > 0:
            return UNKNOWN_VALUE
        lengths.append(length)
    return min(lengths)


def check_outlines(patch: TableFacts) -> None:
    """Report mistakes in the lengths and the ends of the two pieces of a patch."""
    draft = patch.draft
    table_key = patch.table_key
    for name in PIECE_NAMES:
        if patch[name]:
            _check_ends(patch, name)
            _check_outline_keys_with_mesh(patch, name)
    lengths = [find_piece_length(patch, name) for name in PIECE_NAMES]
    written = [name for name in PIECE_NAMES if patch.has(f"{name}.length")]
    difference = abs(lengths[0] - lengths[1])
    if written and 0 < difference < MIN_END_FRACTION * max(lengths):
        draft.add_mistake(
            f"{table_key}.{written[-1]}.length",
            f"the pieces are {lengths[0]} and {lengths[1]} m long; the difference is less than 1e-5 of the length: "
            "write the same length for both pieces",
        )
    if len(written) == 2 and patch.has("length"):
        draft.add_remark(
            f"{table_key}.length",
            "is not used: [contact.upper] and [contact.lower] set their own lengths",
        )


def _check_outline_keys_with_mesh(patch: TableFacts, name: str) -> None:
    """Report keys for the outline of a piece that are given together with a mesh file."""
    for key in ("length", *END_KEYS):
        if patch.mesh and patch.has(f"{name}.{key}"):
            patch.draft.add_mistake(
                f"{patch.table_key}.{name}.{key}",
                "cannot be used with contact.mesh, because the mesh file gives the shape of the pieces: leave one of "
                "the two keys out",
            )


def _check_ends(patch: TableFacts, name: str) -> None:
    """Report ends of a piece that exclude each other, or do not fit into its length and height."""
    draft = patch.draft
    table_key = f"{patch.table_key}.{name}"
    piece: Any = patch[name]
    length = find_piece_length(patch, name)
    height = piece.height or patch.height
    coating = piece.coating or patch.coating
    thickness = getattr(coating, "thickness", None) or 0.0
    written = [key for key in END_KEYS if patch.has(f"{name}.{key}")]
    for key in written:
        end = piece[key]
        if 2 * end >= length:
            message = (
                f"{end} m at each end leaves no flat face on a piece that is {length} m long; {key} must be less than "
                "length/2"
            )
        elif end < MIN_END_FRACTION * length:
            message = f"{end} m is less than 1e-5 of the length {length} m: leave this key out"
        elif end + thickness >= height:
            message = f"{end} m and a coating of {thickness} m do not fit into the height {height} m of the piece"
        else:
            continue
        draft.add_mistake(f"{table_key}.{key}", message)
