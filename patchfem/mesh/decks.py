"""Tagged meshes from Abaqus and CalculiX decks (.inp).

Names are compared without case, because Abaqus writes them in capitals.
"""

import re
from typing import NamedTuple

import numpy as np

from ..core import PatchfemError
from .anymesh import CELL_TAGS, EDGE_TAGS, TaggedMesh

HOW_TAGGED = (
    "for the cells, names of *ELSET; for `interface` and `far`, names of *NSET or of *ELSET made of "
    "line elements"
)
PLANE_ELEMENT = re.compile(
    r"(?:CPE|CPS|CPEG|CAX|S|STRI|M3D|R3D|SFM3D)([34])(?:R|H|I|RH|IH|RS|RSW|R5)?$"
)
LINE_ELEMENT = re.compile(r"(?:T2D2|T3D2|B21|B31|R2D2|RAX2|SAX1)H?$")
UNSUPPORTED_KEYWORDS = ("INCLUDE", "SYSTEM", "NGEN", "NFILL", "ELGEN", "NCOPY", "ELCOPY")
# Largest ratio of the members of a set to the number of nodes and elements; since a set may repeat
# members of other sets, a short deck could otherwise name any number of members
MAX_SET_SIZE_RATIO = 4


class DeckBlock(NamedTuple):
    """Keyword in a deck with its parameters and data lines."""

    keyword: str
    parameters: dict
    lines: list


class Deck:
    """Nodes, elements and sets in an Abaqus or CalculiX deck."""

    def __init__(self):
        self.nodes: dict[int, list[float]] = {}
        self.elements: dict[int, list[int]] = {}
        self.node_sets: dict[str, list[int]] = {}
        self.element_sets: dict[str, list[int]] = {}

    def add(self, block: DeckBlock) -> None:
        """Add the contents of a keyword block to the deck."""
        keyword, parameters, lines = block
        if keyword in UNSUPPORTED_KEYWORDS:
            raise PatchfemError(
                f"*{keyword} is not supported yet; write a flat deck (without parts and instances)"
            )
        if keyword == "NODE":
            nodes = {int(line[0]): [float(word) for word in line[1:] if word] for line in lines}
            if nodes.keys() & self.nodes.keys():
                raise PatchfemError(
                    "a node number is given twice (several parts are not supported yet: write a "
                    "flat deck)"
                )
            self.nodes |= nodes
            _extend_set(self.node_sets, parameters.get("NSET"), list(nodes))
        elif keyword == "ELEMENT":
            elements = _read_elements(parameters.get("TYPE", "").upper(), lines)
            if elements.keys() & self.elements.keys():
                raise PatchfemError("an element number is given twice")
            self.elements |= elements
            _extend_set(self.element_sets, parameters.get("ELSET"), list(elements))
        elif keyword == "NSET":
            members = self._read_set(block, self.node_sets, len(self.nodes))
            _extend_set(self.node_sets, parameters.get(keyword), members)
        elif keyword == "ELSET":
            members = self._read_set(block, self.element_sets, len(self.elements))
            _extend_set(self.element_sets, parameters.get(keyword), members)

    def _read_set(self, block: DeckBlock, sets: dict, max_range: int) -> list[int]:
        """Return the node or element numbers of a set, which may contain other sets."""
        members = []
        if "GENERATE" in block.parameters:
            for line in block.lines:
                first, last, step = ([int(word) for word in line if word] + [1])[:3]
                if step < 1 or (last - first) // step >= max_range:
                    raise PatchfemError(
                        f"GENERATE from {first} to {last} by {step}: this range is longer than the deck"
                    )
                members += range(first, last + 1, step)
            return members
        for line in block.lines:
            for word in filter(None, line):
                if word.isdigit():
                    members.append(int(word))
                elif word.lower() not in sets:
                    raise PatchfemError(f"a set names the unknown set {word}")
                else:
                    members += sets[word.lower()]
                    if len(members) > MAX_SET_SIZE_RATIO * (len(self.nodes) + len(self.elements)):
                        raise PatchfemError("a set names more members than the deck has")
        return members

    def tagged_mesh(self) -> TaggedMesh:
        """Convert the deck to a mesh with named groups."""
        position = {number: k for k, number in enumerate(self.nodes)}

        def find_nodes(owner: str, numbers) -> list[int]:
            """Return the positions of nodes by their numbers; `owner` begins the message."""
            for number in numbers:
                if number not in position:
                    raise PatchfemError(
                        f"{owner} names node {number}, which the file does not define"
                    )
            return [position[number] for number in numbers]

        dimensions = {len(coordinates) for coordinates in self.nodes.values()}
        if dimensions - {2} and dimensions - {3}:
            raise PatchfemError("either all nodes need two coordinates, or all nodes need three")
        tag_of_element = {}
        for tag in CELL_TAGS:
            for number in self.element_sets.get(tag, ()):
                if tag_of_element.setdefault(number, tag) != tag:
                    raise PatchfemError(
                        f"element {number} is tagged {tag_of_element[number]} and {tag}"
                    )
        cells = {3: [], 4: []}
        names = {3: [], 4: []}
        for number, corners in self.elements.items():
            if len(corners) > 2:
                cells[len(corners)].append(find_nodes(f"element {number}", corners))
                names[len(corners)].append(tag_of_element.get(number, ""))
        edges = {}
        for tag in EDGE_TAGS:
            numbers = list(self.node_sets.get(tag, ()))
            for number in self.element_sets.get(tag, ()):
                corners = self.elements.get(number, ())
                if len(corners) != 2:
                    raise PatchfemError(
                        f"{tag} contains element {number}, which is not a line element"
                    )
                numbers += corners
            edges[tag] = np.array(find_nodes(tag, numbers), np.int64)
        points = np.array(list(self.nodes.values()), float) if self.nodes else np.empty((0, 2))
        return TaggedMesh(
            points,
            np.array(cells[3], np.int64).reshape(-1, 3),
            np.array(cells[4], np.int64).reshape(-1, 4),
            np.array(names[3] + names[4], str),
            edges,
            HOW_TAGGED,
        )


def read_deck(text: str) -> TaggedMesh:
    """Read a flat Abaqus or CalculiX deck: *NODE, *ELEMENT, *NSET and *ELSET, with GENERATE.

    Parameters
    ----------
    text : str

    Returns
    -------
    TaggedMesh

    Raises
    ------
    PatchfemError, ValueError
        If the text is not a flat deck with these keywords.
    """
    deck = Deck()
    for block in _split_blocks(text):
        deck.add(block)
    return deck.tagged_mesh()


def _split_blocks(text: str):
    """Yield the keyword blocks in a deck; skip comments and empty lines."""
    block = DeckBlock("", {}, [])
    for line in text.splitlines():
        if not line.strip() or line.startswith("**"):
            continue
        words = [word.strip() for word in line.split(",")]
        if not line.lstrip().startswith("*"):
            block.lines.append(words)
            continue
        yield block
        parameters = {}
        for word in words[1:]:
            key, _, value = word.partition("=")
            parameters[key.strip().upper()] = value.strip().strip('"')
        block = DeckBlock(words[0].lstrip("*").strip().upper(), parameters, [])
    yield block


def _read_elements(kind: str, lines) -> dict[int, list[int]]:
    """Return the nodes of elements of one type, by element number."""
    plane = PLANE_ELEMENT.match(kind)
    if plane:
        n_nodes = int(plane[1])
    elif LINE_ELEMENT.match(kind):
        n_nodes = 2
    else:
        raise PatchfemError(
            f"{kind or 'untyped'} elements; only linear triangles, quads and line elements can be used"
        )
    numbers = np.array([int(word) for line in lines for word in line if word], np.int64)
    if numbers.size % (n_nodes + 1):
        raise PatchfemError(f"{kind} elements do not all have {n_nodes} nodes")
    return {row[0]: row[1:] for row in numbers.reshape(-1, n_nodes + 1).tolist()}


def _extend_set(sets: dict, name: str | None, members: list) -> None:
    if name and members:
        sets[name.lower()] = sets.get(name.lower(), []) + members
