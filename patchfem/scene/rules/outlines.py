"""Rules of the outlines of the two pieces: their lengths and the shape of their ends."""

from .facts import TableFacts
from .view import UNKNOWN_VALUE, TableView

# Tables of [contact] with the outline of one piece each
PIECE_KEYS_OF_PATCH = ("upper", "lower")
# Keys of a piece for the lengths [m] of its shaped ends
PIECE_END_KEYS = ("chamfer", "end_radius")
# Smallest end, or difference of lengths, as a fraction of the length of a piece; a smaller
# one is smaller than any element.
MIN_PIECE_END_FRACTION = 1e-5


def find_piece_length(contact: TableView, name: str) -> float:
    """Return the length [m] of the piece `name`, "upper" or "lower", of a table [contact]."""
    return contact[name].length or contact.length


def find_flat_length(patch: TableView) -> float:
    """Return the length [m] over which both faces of a patch are flat and opposite.

    It is UNKNOWN_VALUE if there is none.
    """
    lengths = []
    for name in PIECE_KEYS_OF_PATCH:
        end = max(patch[name][key] or 0.0 for key in PIECE_END_KEYS)
        length = find_piece_length(patch, name) - 2 * end
        if not length > 0:
            return UNKNOWN_VALUE
        lengths.append(length)
    return min(lengths)


def check_outlines(patch: TableFacts) -> None:
    """Report mistakes in the lengths and the ends of the two pieces of a patch."""
    for name in PIECE_KEYS_OF_PATCH:
        _check_piece(patch, name)
    lengths = [find_piece_length(patch, name) for name in PIECE_KEYS_OF_PATCH]
    written = [name for name in PIECE_KEYS_OF_PATCH if patch.has(f"{name}.length")]
    if written and 0 < abs(lengths[0] - lengths[1]) < MIN_PIECE_END_FRACTION * max(lengths):
        patch.add_mistake(
            f"{written[-1]}.length",
            f"the pieces are {lengths[0]} and {lengths[1]} m long; the difference is less than 1e-5 of the length: "
            "write the same length for both pieces",
        )


def _check_piece(patch: TableFacts, name: str) -> None:
    """Report ends that do not fit into a piece of a patch.

    Its name is "upper" or "lower".
    """
    piece = patch[name]
    length = find_piece_length(patch, name)
    height = piece.height or patch.height
    coating = piece.coating or patch.coating
    thickness = getattr(coating, "thickness", None) or 0.0
    for key in PIECE_END_KEYS:
        end = piece[key]
        if 2 * end >= length:
            sentence = (
                f"{end} m at each end leaves no flat face on a piece that is {length} m long; {key} must be less than "
                "length/2"
            )
        elif end < MIN_PIECE_END_FRACTION * length:
            sentence = f"{end} m is less than 1e-5 of the length {length} m: leave this key out"
        elif end + thickness >= height:
            sentence = f"{end} m and a coating of {thickness} m do not fit into the height {height} m of the piece"
        else:
            continue
        patch.add_mistake(f"{name}.{key}", sentence)
