"""What stands above the numbers of a text file: names and units of its columns, or size and units of a matrix.

A line above the first row of numbers is a comment (#, % or //) or text. One that names x and z with their units ends
the head. Otherwise names and units may stand in lines of their own, and `# Width: 12.34 um` or `pixel size = 0.5 um`
tell of a matrix of heights, as Gwyddion, SPIP, Attocube and Nova write them, in English or in German.
"""

import re
from typing import NamedTuple

from ...core import PatchfemError
from ...inputs.cells import NUMBER
from .raw import shown
from .units import factor_of

WIDEST = 1000  # characters of a line of columns
DEEPEST = 500  # lines of a head
NAME = 80  # characters of the name of a column and its unit
EXAMPLE = "write the header as `x [um],z [um]`"
SIGNS = (";", ",", "\t", "|")
COMMENT = ("#", "%", "//")
COMMA = re.compile(r"[+-]?[0-9]*,[0-9]+(?:[eE][+-]?[0-9]+)?")
LOST = re.compile(r"(?:[+-]?nan|\*+)?", re.IGNORECASE)
VOID = re.compile(rf"{LOST.pattern}|bad", re.IGNORECASE)  # a missing height of a matrix
NAMES = {"x": ("x", "x axis", "x-achse", "distance", "position", "lateral", "lateral position", "abstand", "weg",
               "strecke", "position x"),
         "y": ("y", "y axis", "y-achse", "position y"),
         "z": ("z", "z axis", "z-achse", "height", "heights", "höhe", "hoehe", "profile", "profil"),
         "index": ("index", "no", "no.", "nr", "nr.", "number", "nummer", "sample", "point", "punkt", "#"),
         "valid": ("valid", "gültig")}
NO_UNIT = ("", "-", "[-]", "1", "[1/0]")  # of an index, in a line of units
_ROLES = {name: role for role, names in NAMES.items() for name in names}
_COLUMN = re.compile(r"(\w[\w .-]*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\)|[_/]\s*(\w+)|\s+in\s+(\w+))")
_CELL = re.compile(r"[^\s\[\](]+\s*(?:\[[^\]]*\]|\([^)]*\))|[^\W\d_]+\s+in\s+[^\W\d_]+|\S+")
_NUMERIC = re.compile(r"(?=[^0-9]*[0-9])[0-9+\-.,;|eE \t*naNbdBAD]+")
_VALUE = re.compile(r"\s*([+-]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?(?![0-9.,]))?\s*[\[(]?"
                    r"\s*([^\W\d_]*)")
_FACTS = {  # what a head may say of a matrix -> how it is written before a colon or a sign of equality
    "width": "width|breite|x[- ]length|x[- ]länge", "height": "height|höhe|y[- ]length|y[- ]länge",
    "columns": "x-pixels|nx|w", "rows": "y-pixels|ny|h",
    "step_x": "pixel[ _]size(?: x)?|pixelgröße(?: x)?|scale x|x[- ]step|step x|x[- ]spacing|spacing x|x-schrittweite",
    "step_y": "pixel[ _]size y|pixelgröße y|scale y|y[- ]step|step y|y[- ]spacing|spacing y|y-schrittweite",
    "lateral": "lateral units?|laterale einheit(?:en)?|x[- ]unit|unit x|x-einheit",
    "unit_y": "y[- ]unit|unit y|y-einheit",
    "value": "value units?|einheiten|wert-?einheit(?:en)?|z[- ]unit|unit (?:z|data)|z-einheit",
    "bit2nm": "bit2nm", "format": "file format",
    "scale": "scale data", "scaled": "datascaleneeded", "factor": r"height\s+conversion\s+factor"}
_FACTS = {name: re.compile(rf"(?<![\w-])(?:{words})\s*(?:\(->\s*(?P<of>\w+)\s*\))?\s*[:=：](?P<is>.*)", re.IGNORECASE)
          for name, words in _FACTS.items()}
_THOUSANDS = re.compile("[1-9][0-9]{0,2},[0-9]{3}")  # or a decimal comma, unless the words are German
_GERMAN = re.compile("breite|höhe|länge|größe|schritt", re.IGNORECASE)


class Head(NamedTuple):
    """What stands above the rows of a text.

    lines: (number, text without its comment sign, whether it was a comment); named: cells of the line that names x and
    z with their units, where there is one; row: cells of the first row of numbers, where there is none; delimiter: of
    either, None for blanks; number: lines above the rows; start: place of the rows in the text.
    """

    lines: list
    named: list
    row: list
    delimiter: str | None
    number: int
    start: int

    def beside(self, count: int) -> tuple:
        """(line number, cells) of the last line of `count` names, cells of the last line of as many units; (0, [])
        and [] where there are none."""
        names, units = (0, []), []
        for number, line, comment in self.lines:
            cells, delimiter = split(line)
            known = named(cells)
            if len(cells) != count:
                continue
            if any(factor_of(cell) for cell in cells) and all(factor_of(cell) or cell in NO_UNIT for cell in cells):
                units = cells
            elif known or not (comment or delimiter != self.delimiter or re.search(r"[:=：]", line)):
                names = number, cells
        return names, units

    def facts(self, path) -> dict:
        """name of `_FACTS` -> (number or None, word behind it), of the first line that tells it; PatchfemError for
        1,234, which may be a thousand or one, where no row has a decimal comma."""
        found = {}
        for at, line, _ in self.lines:
            for name, pattern in _FACTS.items():
                if name not in found and (said := pattern.search(line)):
                    value = _VALUE.match(said["is"])
                    if _THOUSANDS.fullmatch(value[1] or "") and not _GERMAN.search(said[0]) \
                            and not any("," in cell for cell in self.row):
                        raise PatchfemError(f"{path}:{at}: '{shown(line)}': the comma in {value[1]} may be a decimal "
                                            "comma or a thousands separator; write a decimal point, or leave out the "
                                            "comma")
                    number = value[1] and float(value[1].replace(",", "."))
                    found[name] = number, said["of"] or value[2]
        return found


def head_of(path, text: str) -> Head:
    """The head of a text; PatchfemError where no row of numbers follows it."""
    start = number = 0
    lines = []
    while start < len(text) and number < DEEPEST:
        stop = text.find("\n", start)
        stop = len(text) if stop < 0 else stop
        line, number = text[start:stop].strip(), number + 1
        comment = line.startswith(COMMENT)
        if len(line) > WIDEST and not comment:
            if not _NUMERIC.fullmatch(line):
                raise PatchfemError(f"{path}:{number}: a line is {len(line)} characters long; two columns are needed, "
                                    f"{EXAMPLE}")
        plain = line[:WIDEST].lstrip("#%/").strip() if comment else line
        names, cells, delimiter = ([], [], None) if len(plain) > WIDEST else names_of(plain, comment)
        if names:
            return Head(lines, names, [], delimiter, number, stop + 1)
        if not comment and line.strip(" \t,;|"):
            cells, delimiter = split(line)
            if cells[0] and all(is_number(cell, delimiter) for cell in cells) and any(map(str.isdigit, line)):
                return Head(lines, [], cells, delimiter, number - 1, start)
        if plain:
            lines.append((number, plain, comment))
        start = stop + 1
    if all(comment for *_, comment in lines):
        raise PatchfemError(f"{path}: no data, only comments")
    raise PatchfemError(f"{path}: no row of numbers in the first {number} lines; {EXAMPLE} above rows of two numbers")


def named(cells: list) -> bool:
    """Whether cells name two columns of a trace or a scan."""
    roles = {role_of(cell)[0] for cell in cells} & {"x", "y", "z", "index"}
    return len(roles) > 1


def names_of(line: str, comment: bool) -> tuple:
    """Cells of a line that names x and z, and what else it names, with their units, else []; all cells; the delimiter.

    The last column of a comment may go on with other words, which are left out.
    """
    cells, delimiter = split(line)
    if comment and len(cells) > 1:
        last = next((k for k, cell in enumerate(cells) if k and role_of(cell)[1] is None), None)
        more = None if last is None else _COLUMN.match(cells[last][:NAME])
        if more and cells[last][more.end():][:1].isspace():
            cells = [*cells[:last], more[0]]
    roles = [role_of(cell) for cell in cells]
    with_units = [role for role, unit in roles if unit is not None]
    good = 1 < len(with_units) < 4 and all(unit is not None or role in ("index", "valid") for role, unit in roles) \
        and not (comment and {"x", "y", "z"}.isdisjoint(with_units))
    return (cells if good and len(cells) < 5 else []), cells, delimiter


def role_of(cell: str) -> tuple:
    """(what a column is, its unit as it is written) by its name: x, y, z, index, valid, or the name in small letters;
    None where no unit stands beside it."""
    match = _COLUMN.fullmatch(cell) if len(cell) <= NAME else None
    name = (match[1] if match else cell).strip().lower()
    unit = next((part for part in match.groups()[1:] if part is not None), None) if match else None
    return _ROLES.get(name, name), None if unit is None else unit.strip()


def split(text: str) -> tuple:
    """Cells of a line without the empty ones at the end, and the delimiter between them, None for blanks."""
    for delimiter in (*SIGNS, None):  # numbers with a decimal comma stand apart by something else
        cells = trimmed(text.split(delimiter))
        if len(cells) > 1 and all(is_number(cell, delimiter) for cell in cells):
            return cells, delimiter
    delimiter = next((sign for sign in SIGNS if sign in text), None)
    return trimmed(text.split(delimiter) if delimiter else _CELL.findall(text)), delimiter


def trimmed(cells: list) -> list:
    """Cells without blanks around them and without the empty ones at the end."""
    cells = [cell.strip() for cell in cells]
    while cells and not cells[-1]:
        cells.pop()
    return cells


def is_number(cell: str, delimiter) -> bool:
    """Whether a cell is a number or a missing one; its decimal sign may be a comma where that parts no columns."""
    number = NUMBER.fullmatch(cell) or VOID.fullmatch(cell)
    return bool(number or (delimiter != "," and COMMA.fullmatch(cell)))
