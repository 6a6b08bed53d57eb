"""Tagged meshes from Abaqus and CalculiX decks (.inp).

Cells are tagged by element sets, edges by node sets, by element sets of line elements, or by surfaces of elements. Names
are compared without case, because Abaqus writes them in capitals. meshio reads neither surfaces nor sets of sets.
"""

import re

import numpy as np

from ..core import PatchfemError
from .checks import CELL_TAGS, EDGE_TAGS, TaggedCells, TaggedMesh
from .elements import ELEMENTS

# How a deck contains tags, for messages
DECK_TAG_HELP = (
    "for the cells, names of *ELSET; for `interface` and `far`, names of *NSET, of *SURFACE of type ELEMENT or of "
    "*ELSET made of line elements"
)
PLANE_ELEMENT_PATTERN = re.compile(r"CP(?:E|S|EG)([3468])(?:M|R|H|I|RH|IH|MH)?$")
# Numbers of nodes of line elements, which only name edges
LINE_ELEMENT_NODE_COUNTS = {"T2D2": 2, "T3D2": 2, "B21": 2, "B31": 2, "R2D2": 2}
LINE_ELEMENT_NODE_COUNTS |= {"T2D3": 3, "T3D3": 3, "B22": 3, "B32": 3}
# Names of the elements in meshio by their number of nodes
MESHIO_PLANE_NAMES = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8"}
MESHIO_LINE_NAMES = {2: "line", 3: "line3"}


class Deck:
    """Nodes, elements, sets and surfaces in an Abaqus or CalculiX deck.

    - nodes: coordinates by node number
    - elements: element in meshio and its node numbers, by element number
    - sets: numbers by name, for node sets and element sets
    - surfaces: data lines by name

    The text of the deck is read block by block when the object is made. Names of sets and surfaces are in lower case.
    """

    def __init__(self, text: str):
        self.nodes: dict[int, list[float]] = {}
        self.elements: dict[int, tuple[str, list[int]]] = {}
        self.sets: dict[str, dict[str, list[int]]] = {"NSET": {}, "ELSET": {}}
        self.surfaces: dict[str, list[list[str]]] = {}
        # Largest ratio of the members of a set to the lines of the deck; since a set may repeat
        # members of other sets, a short deck could otherwise name any number of members
        self.max_members = 64 * (text.count("\n") + 1)
        for keyword, parameters, lines in _split_blocks(text):
            self._add(keyword, parameters, lines)

    def _add(self, keyword: str, parameters: dict[str, str], lines: list[list[str]]) -> None:
        """Add the contents of a keyword block to the deck.

        `parameters` are the words KEY=VALUE after the keyword, and `lines` the words of the data lines. Blocks that
        say nothing about nodes, elements, sets or surfaces are ignored.
        """
        if keyword in ("PART", "ASSEMBLY", "INSTANCE"):
            raise PatchfemError(
                f"*{keyword}: parts and instances are not read; in Abaqus/CAE "
                "mdb.models['Model-1'].setValues(noPartsInputFile=ON) writes a flat deck"
            )
        if keyword in ("INCLUDE", "SYSTEM", "NGEN", "NFILL", "ELGEN", "NCOPY", "ELCOPY"):
            raise PatchfemError(
                f"*{keyword} is not supported yet; write a flat deck (without parts and instances)"
            )
        # Lines are words: node number and coordinates, or element number and nodes
        if keyword == "NODE":
            kind = "NSET"
            new = [(int(line[0]), [float(word) for word in line[1:]]) for line in lines]
            members = _add_numbered(self.nodes, new, "node")
        elif keyword == "ELEMENT":
            kind = "ELSET"
            new = _read_elements(parameters.get("TYPE", "").upper(), lines)
            members = _add_numbered(self.elements, new, "element")
        elif keyword in self.sets:
            kind = keyword
            members = self._read_members(keyword, "GENERATE" in parameters, lines)
        else:
            if keyword == "SURFACE":
                self.surfaces.setdefault(parameters.get("NAME", "").lower(), []).extend(lines)
            return
        if kind in parameters:
            self.sets[kind].setdefault(parameters[kind].lower(), []).extend(members)

    def _read_members(self, kind: str, is_range: bool, lines: list[list[str]]) -> list[int]:
        """Return the numbers of the nodes or elements in a set, which may contain other sets.

        `kind` is "NSET" for nodes or "ELSET" for elements, and `lines` are the words of the data lines. A line lists
        numbers and names of other sets. If `is_range`, it has the first number, the last one, and optionally the step
        between them. PatchfemError is raised for a set with more than `max_members` members.
        """
        members = []
        for words in lines:
            if is_range:
                first, last, step = ([*map(int, words), 1])[:3]
                members += range(first, min(last, first + step * self.max_members) + 1, step)
            for word in () if is_range else words:
                members += self._find_members(kind, word)
            if len(members) > self.max_members:
                raise PatchfemError("a set names more members than the deck has")
        return members

    def _find_members(self, kind: str, word: str) -> list[int]:
        """Return the numbers that a word of a set or of a surface stands for.

        A word is a number, or the name of a set of the `kind` NSET (nodes) or ELSET (elements), whose members are returned.
        """
        if word.isdigit():
            return [int(word)]
        if word.lower() not in self.sets[kind]:
            raise PatchfemError(f"a set names the unknown set {word}")
        return self.sets[kind][word.lower()]

    def tag_mesh(self) -> TaggedMesh:
        """Convert the deck to a mesh with named groups."""
        # An element has one tag at most; without a tag it is reported later
        tags = {}
        for tag in (*CELL_TAGS, *EDGE_TAGS):
            for number in self.sets["ELSET"].get(tag, ()):
                if tags.setdefault(number, tag) != tag:
                    raise PatchfemError(f"element {number} is tagged {tags[number]} and {tag}")

        # Line elements, sets of nodes and sides of cells tag edges, by their nodes
        cells = {}
        edges = {}
        for tag in EDGE_TAGS:
            nodes = [*self.sets["NSET"].get(tag, ()), *self._list_side_nodes(tag)]
            if nodes:
                edges[tag] = nodes
        for number, (kind, nodes) in self.elements.items():
            tag = tags.get(number, "")
            if kind in ELEMENTS:
                cells.setdefault(kind, []).append((nodes, tag))
            else:
                edges.setdefault(tag, []).extend(nodes)

        # Node numbers become positions in the array of points
        position = {number: k for k, number in enumerate(self.nodes)}
        try:
            for kind, members in cells.items():
                nodes, names = zip(*members)
                rows = [[position[node] for node in cell] for cell in nodes]
                cells[kind] = TaggedCells(np.array(rows, np.int64), np.array(names, str))
            for tag, nodes in edges.items():
                edges[tag] = np.array([position[node] for node in nodes])
        except KeyError as error:
            raise PatchfemError(
                f"an element or a set names node {error}, which the file does not define"
            ) from None

        if len({len(coordinates) for coordinates in self.nodes.values()}) > 1:
            raise PatchfemError("either all nodes need two coordinates, or all nodes need three")
        points = np.array(list(self.nodes.values()), float).reshape(len(self.nodes), -1)
        return TaggedMesh(points, cells, edges, DECK_TAG_HELP)

    def _list_side_nodes(self, tag: str) -> list[int]:
        """Return both corner nodes of each element side in the surface with the name `tag`."""
        corners = []
        for member, side_name, *_ in self.surfaces.get(tag, ()):
            side = int(side_name.upper().removeprefix("S"))
            for element in self._find_members("ELSET", member):
                kind, nodes = self.elements[element]
                corners += [nodes[side - 1], nodes[side % ELEMENTS[kind].n_corners]]
        return corners


def _add_numbered(contents: dict[int, object], entries: list, name: str) -> list[int]:
    """Add nodes or elements, pairs of a number and a content, to the contents by number, and return the numbers.

    PatchfemError is raised for a number given twice; `name` says of what.
    """
    for number, content in entries:
        if number in contents:
            raise PatchfemError(f"{name} {number} is given twice; number each once")
        contents[number] = content
    return [number for number, _ in entries]


def read_deck(text: str) -> TaggedMesh:
    """Read a flat Abaqus or CalculiX deck: *NODE, *ELEMENT, *NSET, *ELSET with GENERATE, and *SURFACE.

    Parameters
    ----------
    text : str
        Content of the file.

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
    """Yield (keyword, parameters, data lines) of the keyword blocks in the text of a deck.

    The parameters are {"KEY": "value"}, and each data line is a list of words. Comments and empty words are left out.
    """
    blocks = [("", {}, [])]
    for line in text.splitlines():
        words = [word.strip() for word in line.split(",") if word.strip()]
        if not words or line.startswith("**"):
            continue
        if not words[0].startswith("*"):
            blocks[-1][2].append(words)
            continue
        pairs = [word.partition("=") for word in words[1:]]
        parameters = {key.strip().upper(): value.strip().strip('"') for key, _, value in pairs}
        blocks.append((words[0].lstrip("*").strip().upper(), parameters, []))
    yield from blocks


def _read_elements(kind: str, lines) -> list[tuple[int, tuple[str, list[int]]]]:
    """Return number, meshio name and nodes of each element of one type.

    `kind` is the type in the deck, such as "CPE4", and `lines` are the words of the data lines. An element may
    continue over several lines.
    """
    plane = PLANE_ELEMENT_PATTERN.match(kind)
    n_nodes = int(plane[1]) if plane else LINE_ELEMENT_NODE_COUNTS.get(kind.removesuffix("H"))
    if n_nodes is None:
        raise PatchfemError(
            f"{kind or 'untyped'} elements cannot be used; the cells must be plane triangles or quadrilaterals of plane "
            "strain (CPE*) or plane stress (CPS*), of first or second order; line elements may name edges"
        )
    numbers = np.array([int(word) for line in lines for word in line], np.int64)
    if numbers.size % (n_nodes + 1):
        raise PatchfemError(f"{kind} elements do not all have {n_nodes} nodes")
    name = MESHIO_PLANE_NAMES[n_nodes] if plane else MESHIO_LINE_NAMES[n_nodes]
    return [(row[0], (name, row[1:])) for row in numbers.reshape(-1, n_nodes + 1).tolist()]
