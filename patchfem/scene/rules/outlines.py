"""Rules of the outline of each piece: its length and what its ends look like."""

from ..keys.contact import Contact
from .scene_draft import Draft

ENDS = ("chamfer", "end_radius")
LEAST = 1e-5  # of the length of a piece: an end, or a difference of lengths, below it is no shape that a mesh can show


def length_of(contact: Contact, name: str) -> float | None:
    """Length [m] of the piece `name`, "upper" or "lower"; None where it is not known."""
    piece = getattr(contact, name)
    return (piece and piece.length) or contact.length


def flat_of(contact: Contact) -> float | None:
    """Length [m] over which both faces are flat and face one another; None where a length is not known."""
    out = []
    for name in ("upper", "lower"):
        piece, length = getattr(contact, name), length_of(contact, name)
        ends = max((getattr(piece, key) or 0.0 for key in ENDS), default=0.0) if piece else 0.0
        if length is None or 2 * ends >= length:
            return None
        out.append(length - 2 * ends)
    return min(out)


def outlines(draft: Draft) -> None:
    """Say every mistake in the lengths and the ends of the two pieces."""
    contact = draft.tables.contact
    for name in ("upper", "lower"):
        if piece := getattr(contact, name):
            _ends(draft, contact, name, piece)
            for key in ("length", *ENDS):
                if contact.mesh and draft.given(f"contact.{name}.{key}"):
                    draft.say(
                        f"contact.{name}.{key}",
                        "cannot be used with contact.mesh, because the mesh file gives "
                        "the shape of the pieces: leave one of the two keys out",
                    )
    lengths = [length_of(contact, name) for name in ("upper", "lower")]
    given = [name for name in ("upper", "lower") if draft.given(f"contact.{name}.length")]
    if given and None not in lengths and 0 < abs(lengths[0] - lengths[1]) < LEAST * max(lengths):
        draft.say(
            f"contact.{given[-1]}.length",
            f"the pieces are {lengths[0]} and {lengths[1]} m long; the difference "
            "is less than 1e-5 of the length: write the same length for both "
            "pieces",
        )
    if len(given) == 2 and draft.given("contact.length"):
        draft.remark(
            "contact.length is not used: [contact.upper] and [contact.lower] set their own lengths"
        )


def _ends(draft: Draft, contact: Contact, name: str, piece) -> None:
    given = [key for key in ENDS if draft.given(f"contact.{name}.{key}")]
    if len(given) == 2:
        draft.say(
            f"contact.{name}.end_radius", "`chamfer` and `end_radius` exclude each other: keep one"
        )
    length, height = length_of(contact, name), piece.height or contact.height
    coating = piece.coating if piece.coating is not None else contact.coating
    thickness = getattr(coating, "thickness", None) or 0.0
    for key in given:
        size, at = getattr(piece, key), f"contact.{name}.{key}"
        if size and length and 2 * size >= length:
            draft.say(
                at,
                f"{size} m at each end leaves no flat face on a piece that is {length} m long; {key} must be "
                "less than length/2",
            )
        elif size and length and size < LEAST * length:
            draft.say(
                at, f"{size} m is less than 1e-5 of the length {length} m: leave this key out"
            )
        elif size and height and size + thickness >= height:
            draft.say(
                at,
                f"{size} m and a coating of {thickness} m do not fit into the height {height} m of the piece",
            )
