"""Rules of [contact], and of the patch of an interface: keys that exclude or need one another."""

from collections.abc import Iterator
from typing import Any

from ..keys.contact import outermost
from .outlines import flat_of, outlines
from .scene_draft import ASPERITIES, PEAKS, Draft, _needs

TALLEST = 10_000  # times the length: at 80 000 the stiffness of a piece is lost in its round-off
MOST_ELEMENTS = 100_000  # over the interface; the patch of a tenth of them takes gigabytes


class OfInterface:
    """A Draft in which [contact] is the patch of an interface, whose mistakes are told at its own keys."""

    def __init__(self, draft: Draft, number: int, law: Any) -> None:
        self._draft, self.at = draft, f"structure.interface.{number}"
        self.tables = draft.tables.model_copy(
            update={"contact": law.contact, "friction": law, "normal": None}
        )

    def given(self, key: str) -> bool:
        return self._draft.given(self._there(key))

    def say(self, key: str, message: str) -> None:
        self._draft.say(self._there(key), message)

    def lacks(self, key: str, reason: str) -> None:
        self._draft.lacks(self._there(key), reason)

    def remark(self, sentence: str) -> None:
        self._draft.remark(f"{self.at}.{sentence}" if sentence.startswith("contact.") else sentence)

    def _there(self, key: str) -> str:
        return (
            f"{self.at}.{key.removeprefix('friction.')}"
            if key.startswith(("contact", "friction"))
            else key
        )


def of_interfaces(draft: Draft) -> Iterator[OfInterface]:
    """The drafts of the interfaces that have a patch."""
    structure = draft.tables.structure
    for number, one in enumerate((structure.interface if structure is not None else ()) or ()):
        if one.contact is not None:
            yield OfInterface(draft, number, one)


def check_contacts(draft: Draft) -> None:
    """Say every mistake of [contact] and of the patches of interfaces by themselves."""
    for one in (draft, *of_interfaces(draft)):
        if one.tables.contact is not None:
            _contact(one)
            _load_line(one)


def _contact(draft: Draft) -> None:
    contact = draft.tables.contact
    load, approach = draft.given("contact.load"), draft.given("contact.approach")
    if load and approach:
        draft.say(
            "contact.approach", "[contact.approach] and contact.load exclude each other: keep one"
        )
    if not load and not approach:
        draft.lacks("contact.load", "or [contact.approach] instead")
    outlines(draft)
    if contact.height and contact.length and contact.height > TALLEST * contact.length:
        draft.say(
            "contact.height",
            f"{contact.height:g} m is more than {TALLEST} times contact.length, but the stress "
            "is noticeable only to a depth of a few times contact.length; use at most "
            f"{TALLEST * contact.length:.3g} m, and represent the rest of the height by a "
            "spring of the structure",
        )
    flat = flat_of(contact)
    if contact.element_size and flat and contact.element_size > flat:
        name = "contact.length =" if flat == contact.length else "the interface length of"
        draft.say(
            "contact.element_size", f"{contact.element_size} m is longer than {name} {flat} m"
        )
    if (
        contact.element_size
        and contact.length
        and contact.length > MOST_ELEMENTS * contact.element_size
    ):
        draft.say(
            "contact.element_size",
            f"elements of {contact.element_size:g} m on a length of {contact.length:g} m "
            f"are more than {MOST_ELEMENTS}; use at least "
            f"{contact.length / MOST_ELEMENTS:.3g} m, or leave this key out",
        )
    if contact.element_size and contact.mesh:
        draft.remark(
            "contact.element_size is not used, because the file of contact.mesh gives the elements"
        )
    pieces = [("contact.coating", contact.coating, contact.height)]
    for name in ("upper", "lower"):
        if piece := getattr(contact, name):
            own = piece.coating if piece.coating is not None else contact.coating
            at = f"contact.{name}.coating" if piece.coating is not None else f"contact.{name}"
            pieces.append((at, own, piece.height or contact.height))
    for at, coating, height in pieces:
        thickness = getattr(coating, "thickness", None)
        if thickness and height and thickness >= height:
            key = f"{at}.thickness" if at.endswith("coating") else f"{at}.height"
            draft.say(
                key,
                f"the coating of {thickness} m must be thinner than its piece, which is {height} m high",
            )
    if contact.holder and not draft.given("contact.holder.rotational_stiffness"):
        if not draft.given("contact.holder.tangential_stiffness"):
            draft.say(
                "contact.holder", "rotational_stiffness, tangential_stiffness or both are needed"
            )
    if contact.step and contact.step.at is not None and flat and abs(contact.step.at) >= flat / 2:
        draft.say(
            "contact.step.at",
            f"{contact.step.at} m lies outside the patch: |`at`| < length/2 is needed",
        )
    if contact.strips and draft.given("contact.strips.offset"):
        _free_roll(draft, contact)
    if contact.asperities:
        _needs(draft, "contact.asperities", contact.asperities, "law", ASPERITIES)
        if contact.asperities.law == "hertz":
            _peaks(draft)
        if draft.given("contact.asperities.cutoff") and not any(
            draft.given(f"contact.{one}")
            for one in ("profile", "asperities.from", "asperities.rms_height")
        ):
            draft.say(
                "contact.asperities.cutoff",
                "separates the long waves of a trace from the short ones, but the "
                "scene has no trace: add [contact.profile] or `from`, or leave this "
                "key out",
            )
        bare = (
            contact.asperities.law == "exponential" and contact.asperities.normal_stiffness is None
        )
        if contact.approach and bare:
            draft.lacks("contact.asperities.normal_stiffness", "law 'exponential' with [contact.approach] needs this "
                                                               "stiffness at first touch, because the approach is "
                                                               "measured from first touch")  # fmt: skip


def _peaks(draft: Draft) -> None:
    """The peaks of Hertz' law are told in one of the ways of PEAKS, whole."""
    at, told = (
        "contact.asperities",
        [way for way in PEAKS if any(draft.given(f"contact.asperities.{one}") for one in way)],
    )
    if len(told) > 1:
        second = next(one for one in told[1] if draft.given(f"{at}.{one}"))
        draft.say(
            f"{at}.{second}",
            f"describes the same peaks as {', '.join(told[0])}; keep only one description of "
            "the peaks",
        )
    for one in (told or PEAKS)[0]:
        if len(told) < 2 and not draft.given(f"{at}.{one}"):
            others = (
                ""
                if told
                else "; instead you can give `from`, or rms_height, rms_slope and rms_curvature"
            )
            draft.lacks(f"{at}.{one}", f"law 'hertz' needs this key{others}")


def _free_roll(draft: Draft, contact) -> None:
    """A load line over the width leaves the roll free, which a load alone determines, and two strips at least."""
    at, strips = "contact.strips.offset", contact.strips
    if draft.given("contact.strips.roll"):
        draft.say(
            at,
            "`offset` leaves the rotation about x free, but contact.strips.roll prescribes this rotation: "
            "keep only one of these two keys",
        )
    if draft.given("contact.approach"):
        draft.say(at, "a load line needs a load: use contact.load in place of [contact.approach]")
    if strips.count is not None and strips.count < 2:
        draft.say(
            at, f"{strips.count} strip cannot resist a rotation about x: raise contact.strips.count"
        )
    elif strips.count and contact.width and strips.offset is not None:
        most = outermost(contact.width, strips.count)
        if abs(strips.offset) >= most:
            draft.say(
                at,
                f"{strips.offset} m lies beyond the middle of the outermost strip: |offset| < {most:.6g} m "
                "is needed; raise contact.strips.count or lower the offset",
            )


def _load_line(draft: Draft) -> None:
    contact, line = draft.tables.contact, draft.tables.contact.load_line
    if not line:
        return
    at = "contact.load_line"
    offset, moment = draft.given(f"{at}.offset"), draft.given(f"{at}.moment")
    if offset and moment:
        draft.say(f"{at}.moment", "offset and moment exclude each other: keep one")
    if not offset and not moment:
        draft.lacks(f"{at}.offset", "or load_line.moment instead")
    if draft.given("contact.tilt.angle") and not draft.given("contact.holder"):
        draft.say(at, "cannot be used with contact.tilt.angle unless [contact.holder] is given: a piece that is free "
                      "to rotate has no prescribed angle; leave out one of these two keys, or add the spring of "
                      "[contact.holder]")  # fmt: skip
    flat = flat_of(contact)
    half = flat / 2 if flat else None
    if half and line.offset is not None and abs(line.offset) >= half:
        draft.say(
            f"{at}.offset",
            f"{line.offset} m lies outside the patch: |offset| < length/2 = {half} m is needed",
        )
    if (
        half
        and line.moment
        and contact.load is not None
        and abs(line.moment) >= half * contact.load
    ):
        draft.say(f"{at}.moment", f"{line.moment} N m divided by the load {contact.load} N puts the load line outside "
                                  f"the patch: |moment|/load < length/2 = {half} m is needed")  # fmt: skip
