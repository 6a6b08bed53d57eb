"""Tagged meshes from Abaqus and CalculiX decks (.inp), read line by line.

Names are compared without case, as Abaqus writes them in capitals.
"""

import re

import numpy as np

from ..core import PatchfemError
from .anymesh import CELLS, EDGES, Tagged

INP = "for the cells, names of *ELSET; for `interface` and `far`, names of *NSET or of *ELSET made of line elements"
FLAT = re.compile(r"(?:CPE|CPS|CPEG|CAX|S|STRI|M3D|R3D|SFM3D)([34])(?:R|H|I|RH|IH|RS|RSW|R5)?$")
LINE = re.compile(r"(?:T2D2|T3D2|B21|B31|R2D2|RAX2|SAX1)H?$")


def read_inp(text: str) -> Tagged:
    """Read a flat Abaqus or CalculiX deck: *NODE, *ELEMENT, *NSET, *ELSET (GENERATE too).

    PatchfemError or ValueError for what it cannot be.
    """
    nodes, elements, sets = {}, {}, {"NSET": {}, "ELSET": {}}
    for keyword, given, lines in _inp_blocks(text):
        if keyword in ("INCLUDE", "SYSTEM", "NGEN", "NFILL", "ELGEN", "NCOPY", "ELCOPY"):
            raise PatchfemError(
                f"*{keyword} is not supported yet; write a flat deck (without parts and instances)"
            )
        if keyword == "NODE":
            new = {int(line[0]): [float(v) for v in line[1:] if v] for line in lines}
            if new.keys() & nodes.keys():
                raise PatchfemError(
                    "a node number is given twice (several parts are not supported yet: write a "
                    "flat deck)"
                )
            nodes |= new
            _gather(sets["NSET"], given.get("NSET"), list(new))
        elif keyword == "ELEMENT":
            new = _inp_elements(given.get("TYPE", "").upper(), lines)
            if new.keys() & elements.keys():
                raise PatchfemError("an element number is given twice")
            elements |= new
            _gather(sets["ELSET"], given.get("ELSET"), list(new))
        elif keyword in sets:
            _gather(
                sets[keyword],
                given.get(keyword, ""),
                _inp_members(given, lines, sets[keyword], nodes, elements),
            )
    return _tagged(nodes, elements, sets["NSET"], sets["ELSET"], INP)


def _inp_blocks(text: str):
    keyword, given, lines = "", {}, []
    for line in text.splitlines():
        if not line.strip() or line.startswith("**"):
            continue
        words = [word.strip() for word in line.split(",")]
        if not line.lstrip().startswith("*"):
            lines.append(words)
            continue
        yield keyword, given, lines
        keyword, lines = words[0].lstrip("*").strip().upper(), []
        given = {
            key.strip().upper(): value.strip().strip('"')
            for key, _, value in (word.partition("=") for word in words[1:])
        }
    yield keyword, given, lines


def _inp_elements(kind: str, lines) -> dict:
    flat = FLAT.match(kind)
    size = int(flat[1]) if flat else 2 if LINE.match(kind) else 0
    if not size:
        raise PatchfemError(
            f"{kind or 'untyped'} elements; only linear triangles, quads and line elements can be used"
        )
    numbers = np.array([int(word) for line in lines for word in line if word], np.int64)
    if numbers.size % (size + 1):
        raise PatchfemError(f"{kind} elements do not all have {size} nodes")
    return {row[0]: row[1:] for row in numbers.reshape(-1, size + 1).tolist()}


def _inp_members(given: dict, lines, known: dict, nodes: dict, elements: dict) -> list:
    if "GENERATE" in given:
        there, out = nodes if "NSET" in given else elements, []
        for line in lines:
            first, last, step = ([int(word) for word in line if word] + [1])[:3]
            if step < 1 or (last - first) // step >= len(there):
                raise PatchfemError(
                    f"GENERATE from {first} to {last} by {step}: this range is longer than the deck"
                )
            out += range(first, last + 1, step)
        return out
    out = []
    for word in (word for line in lines for word in line if word):
        if word.isdigit():
            out.append(int(word))
        elif word.lower() in known:
            out += known[word.lower()]
            if len(out) > 4 * (len(nodes) + len(elements)):
                raise PatchfemError("a set names more members than the deck has")
        else:
            raise PatchfemError(f"a set names the unknown set {word}")
    return out


def _gather(sets: dict, name: str | None, members: list) -> None:
    if name and members:
        sets[name.lower()] = sets.get(name.lower(), []) + members


def _tagged(nodes: dict, elements: dict, node_sets: dict, element_sets: dict, how: str) -> Tagged:
    """The mesh with node numbers of the file turned into places.

    PatchfemError for a number that the file does not define, by that number.
    """
    place = {number: k for k, number in enumerate(nodes)}

    def places(what: str, numbers) -> list:
        strange = next((n for n in numbers if n not in place), None)
        if strange is not None:
            raise PatchfemError(f"{what} names node {strange}, which the file does not define")
        return [place[n] for n in numbers]

    sizes = {len(where) for where in nodes.values()}
    if sizes - {2} and sizes - {3}:
        raise PatchfemError("either all nodes need two coordinates, or all nodes need three")
    name = {}
    for tag in CELLS:
        for number in element_sets.get(tag, ()):
            if name.setdefault(number, tag) != tag:
                raise PatchfemError(f"element {number} is tagged {name[number]} and {tag}")
    cells, names, edges = {3: [], 4: []}, {3: [], 4: []}, {}
    for number, corners in elements.items():
        if len(corners) > 2:
            cells[len(corners)].append(places(f"element {number}", corners))
            names[len(corners)].append(name.get(number, ""))
    for tag in EDGES:
        numbers = list(node_sets.get(tag, ()))
        for number in element_sets.get(tag, ()):
            corners = elements.get(number, ())
            if len(corners) != 2:
                raise PatchfemError(f"{tag} contains element {number}, which is not a line element")
            numbers += corners
        edges[tag] = np.array(places(tag, numbers), np.int64)
    points = np.array(list(nodes.values()), float) if nodes else np.empty((0, 2))
    return Tagged(
        points,
        np.array(cells[3], np.int64).reshape(-1, 3),
        np.array(cells[4], np.int64).reshape(-1, 4),
        np.array(names[3] + names[4], str),
        edges,
        how,
    )
