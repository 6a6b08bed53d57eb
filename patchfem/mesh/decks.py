"""Tagged meshes from Abaqus and CalculiX decks (.inp).

Cells are tagged by element sets, edges by node sets, by element sets of line elements, or by surfaces of elements. Names
are compared without case, because Abaqus writes them in capitals. meshio reads neither surfaces nor sets of sets.
"""

import re

import numpy as np

from ..core import PatchfemError
from .checks import CELL_TAGS, EDGE_TAGS, TaggedBlock, TaggedMesh
from .elements import ELEMENTS

TAG_HELP = (
    "for the cells, names of *ELSET; for `interface` and `far`, names of *NSET, of *SURFACE of type ELEMENT or of "
    "*ELSET made of line elements"
)
PLANE_ELEMENT = re.compile(
    r"(?:CPE|CPS|CPEG|CAX|S|STRI|M3D|R3D|SFM3D)([3468])(?:M|R|H|I|RH|IH|MH|RS|RSW|R5|5)?$"
)
# Numbers of nodes of line elements
LINE_ELEMENTS = {"T2D2": 2, "T3D2": 2, "B21": 2, "B31": 2, "R2D2": 2, "RAX2": 2, "SAX1": 2}
LINE_ELEMENTS |= {"T2D3": 3, "T3D3": 3, "B22": 3, "B32": 3, "SAX2": 3}
KINDS = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8"}
UNSUPPORTED_KEYWORDS = ("INCLUDE", "SYSTEM", "NGEN", "NFILL", "ELGEN", "NCOPY", "ELCOPY")
# Largest ratio of the members of a set to the lines of the deck; since a set may repeat members of
# other sets, a short deck could otherwise name any number of members
MAX_SET_SIZE_RATIO = 64


class Deck:
    """Nodes, elements, sets and surfaces in an Abaqus or CalculiX deck."""

    def __init__(self, text: str):
        self.nodes: dict[int, list[float]] = {}
        self.elements: dict[int, list[int]] = {}
        self.lines: dict[int, list[int]] = {}
        self.sets: dict[str, dict[str, list]] = {"NSET": {}, "ELSET": {}}
        self.surfaces: dict[str, list[list[str]]] = {}
        self.max_members = MAX_SET_SIZE_RATIO * (text.count("\n") + 1)
        for keyword, parameters, lines in _split_blocks(text):
            self._add(keyword, parameters, lines)

    def _add(self, keyword: str, parameters: dict, lines: list) -> None:
        """Add the contents of a keyword block to the deck."""
        if keyword in UNSUPPORTED_KEYWORDS:
            raise PatchfemError(
                f"*{keyword} is not supported yet; write a flat deck (without parts and instances)"
            )
        if keyword == "NODE":
            new = {int(line[0]): [float(word) for word in line[1:] if word] for line in lines}
            self._add_numbered(self.nodes, new, "a node", "NSET", parameters)
        elif keyword == "ELEMENT":
            kind = parameters.get("TYPE", "").upper()
            known = self.lines if kind.removesuffix("H") in LINE_ELEMENTS else self.elements
            new = _read_elements(kind, lines)
            self._add_numbered(known, new, "an element", "ELSET", parameters)
        elif keyword in self.sets and keyword in parameters:
            members = self._read_members(keyword, "GENERATE" in parameters, lines)
            self.sets[keyword].setdefault(parameters[keyword].lower(), []).extend(members)
        elif keyword == "SURFACE":
            self.surfaces.setdefault(parameters.get("NAME", "").lower(), []).extend(lines)

    def _add_numbered(self, known: dict, new: dict, what: str, kind: str, parameters: dict) -> None:
        """Add numbered nodes or elements, and their numbers to the set that the block names."""
        if new.keys() & known.keys():
            raise PatchfemError(
                f"{what} number is given twice (several parts are not supported yet: write a flat deck)"
            )
        known.update(new)
        if kind in parameters:
            self.sets[kind].setdefault(parameters[kind].lower(), []).extend(new)

    def _read_members(self, kind: str, is_range: bool, lines: list) -> list[int]:
        """Return the node or element numbers of a set, which may contain other sets."""
        members = []
        for line in lines:
            words = [word for word in line if word]
            if is_range:
                first, last, step = ([*map(int, words), 1])[:3]
                if step < 1 or (last - first) // step >= self.max_members:
                    raise PatchfemError(
                        f"GENERATE from {first} to {last} by {step}: this range is longer than the deck"
                    )
                members += range(first, last + 1, step)
                continue
            for word in words:
                if not word.isdigit() and word.lower() not in self.sets[kind]:
                    raise PatchfemError(f"a set names the unknown set {word}")
                members += [int(word)] if word.isdigit() else self.sets[kind][word.lower()]
                if len(members) > self.max_members:
                    raise PatchfemError("a set names more members than the deck has")
        return members

    def tag_mesh(self) -> TaggedMesh:
        """Convert the deck to a mesh with named groups."""
        position = {number: k for k, number in enumerate(self.nodes)}
        tag_of_element = {}
        for tag in CELL_TAGS:
            for number in self.sets["ELSET"].get(tag, ()):
                if tag_of_element.setdefault(number, tag) != tag:
                    raise PatchfemError(
                        f"element {number} is tagged {tag_of_element[number]} and {tag}"
                    )

        def find(owner: str, numbers) -> list[int]:
            """Return the positions of nodes by their numbers; `owner` begins the message."""
            for number in numbers:
                if number not in position:
                    raise PatchfemError(
                        f"{owner} names node {number}, which the file does not define"
                    )
            return [position[number] for number in numbers]

        blocks = []
        for size, kind in KINDS.items():
            numbers = [number for number, nodes in self.elements.items() if len(nodes) == size]
            cells = [find(f"element {number}", self.elements[number]) for number in numbers]
            names = [tag_of_element.get(number, "") for number in numbers]
            if cells:
                blocks.append(TaggedBlock(kind, np.array(cells, np.int64), np.array(names, str)))
        nodes = {
            tag: np.array(find(tag, self._find_edge_nodes(tag)), np.int64) for tag in EDGE_TAGS
        }
        dimensions = {len(coordinates) for coordinates in self.nodes.values()}
        if dimensions - {2} and dimensions - {3}:
            raise PatchfemError("either all nodes need two coordinates, or all nodes need three")
        points = np.array(list(self.nodes.values()), float) if self.nodes else np.empty((0, 2))
        return TaggedMesh(points, blocks, nodes, TAG_HELP)

    def _find_edge_nodes(self, tag: str) -> list[int]:
        """Return the numbers of the nodes of a tagged edge, from node sets, line elements and surfaces."""
        numbers = list(self.sets["NSET"].get(tag, ()))
        for element in self.sets["ELSET"].get(tag, ()):
            if element in self.elements:
                raise PatchfemError(
                    f"{tag} contains element {element}, which is not a line element"
                )
            numbers += self.lines.get(element, ())
        for words in self.surfaces.get(tag, ()):
            member = words[0]
            side = int(words[1].upper().removeprefix("S"))
            elements = (
                [int(member)] if member.isdigit() else self.sets["ELSET"].get(member.lower(), ())
            )
            for element in elements:
                nodes = self.elements.get(element, ())
                n_corners = ELEMENTS[KINDS[len(nodes)]].n_corners
                numbers += [nodes[side - 1], nodes[side % n_corners]]
        return numbers


def read_deck(text: str) -> TaggedMesh:
    """Read a flat Abaqus or CalculiX deck: *NODE, *ELEMENT, *NSET, *ELSET with GENERATE, and *SURFACE.

    Parameters
    ----------
    text : str

    Returns
    -------
    TaggedMesh

    Raises
    ------
    PatchfemError
        If the deck contains keywords or elements that are not supported, or numbers that it does not define.
    """
    return Deck(text).tag_mesh()


def _split_blocks(text: str):
    """Yield (keyword, parameters, data lines) of the keyword blocks in a deck; skip comments and empty lines."""
    keyword = ""
    parameters = {}
    lines = []
    for line in text.splitlines():
        if not line.strip() or line.startswith("**"):
            continue
        words = [word.strip() for word in line.split(",")]
        if not line.lstrip().startswith("*"):
            lines.append(words)
            continue
        yield keyword, parameters, lines
        keyword = words[0].lstrip("*").strip().upper()
        parameters = {}
        lines = []
        for word in words[1:]:
            key, _, value = word.partition("=")
            parameters[key.strip().upper()] = value.strip().strip('"')
    yield keyword, parameters, lines


def _read_elements(kind: str, lines) -> dict[int, list[int]]:
    """Return the nodes of elements of one type, by element number."""
    plane = PLANE_ELEMENT.match(kind)
    n_nodes = int(plane[1]) if plane else LINE_ELEMENTS.get(kind.removesuffix("H"))
    if n_nodes is None:
        raise PatchfemError(
            f"{kind or 'untyped'} elements; only plane triangles and quadrilaterals of first or second order and line "
            "elements can be used"
        )
    numbers = np.array([int(word) for line in lines for word in line if word], np.int64)
    if numbers.size % (n_nodes + 1):
        raise PatchfemError(f"{kind} elements do not all have {n_nodes} nodes")
    return {row[0]: row[1:] for row in numbers.reshape(-1, n_nodes + 1).tolist()}
