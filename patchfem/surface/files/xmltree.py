"""Small XML files as a tree of names and texts: no document type, no entities, no deep nesting, no external files."""

from dataclasses import dataclass, field
from xml.parsers import expat

from ...core import PatchfemError
from .raw import reason

DEEPEST = 50  # elements inside one another
MOST = 500_000  # elements


@dataclass(slots=True)
class Node:
    """An element: its name without namespace, its text and its children."""

    name: str
    parts: list = field(default_factory=list)
    children: list = field(default_factory=list)

    def find(self, path: str) -> "Node | None":
        """The first descendant at a path of names, such as "Record1/Axes"."""
        node = self
        for name in path.split("/"):
            node = next((child for child in node.children if child.name == name), None)
            if node is None:
                return None
        return node

    def text(self, path: str, default: str) -> str:
        """The text at a path of names without blanks around it; the default where there is none."""
        node = self.find(path)
        return ("".join(node.parts).strip() if node is not None else "") or default

    def all(self, name: str) -> list:
        """The texts of all children of a name."""
        return ["".join(child.parts).strip() for child in self.children if child.name == name]


def parsed(path, data: bytes) -> Node:
    """The root of an XML text; PatchfemError where it is damaged, nested too deeply or declares a document type."""
    top = Node("")
    stack, count = [top], 0
    parser = expat.ParserCreate()

    def refuse(*_):
        raise PatchfemError(f"{path}: main.xml declares entities or a document type, which no surface needs; export "
                            "the surface anew")

    def start(name, _):
        nonlocal count
        count += 1
        if len(stack) > DEEPEST or count > MOST:
            raise PatchfemError(f"{path}: main.xml is nested deeper than {DEEPEST} or has more than {MOST} elements")
        node = Node(name.rpartition(":")[2])
        stack[-1].children.append(node)
        stack.append(node)

    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = parser.ExternalEntityRefHandler = refuse
    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: stack.pop()
    parser.CharacterDataHandler = lambda text: stack[-1].parts.append(text)
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, ValueError, UnicodeError, LookupError) as error:
        raise PatchfemError(f"{path}: main.xml is damaged ({reason(error)}); export the surface anew") from None
    return top.children[0]
