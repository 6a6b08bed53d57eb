"""Tables of pairs of surfaces before and after wear: reading of the table, and means over its pairs.

Read `read_pairs` first.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from ..core import PatchfemError
from ..inputs.tables import TableFormat, find_factors, read_text
from ..surface.quantity import Mean, Quantity, average_quantities

COLUMNS = ("before", "after")  # columns that every table has
DIRECTIONS = ("", "x", "y")
# Quantities that are averaged; positions are not, because they depend on where a trace begins.
AVERAGED_QUANTITIES = (
    "worn_depth_mean",
    "worn_volume",
    "grown_volume",
    "worn_share",
    "worn_depth_within",
    "worn_depth_max",
    "worn_area",
    "track_width",
    "track_depth",
    "track_depth_floor",
    "track_area_gross",
    "track_area_net",
    "track_pile_up",
    "amplitude_ratio",
    "slope_ratio",
)


class TableLine(NamedTuple):
    """Line of a table of pairs.

    line: its number; names: both files as written; paths: where they are; direction: "x", "y" or "";
    labels: the other cells by column.
    """

    line: int
    names: tuple[str, str]
    paths: tuple[Path, Path]
    direction: str
    labels: Mapping[str, str]


class Group(NamedTuple):
    """Properties that are equal for all pairs of a mean.

    label: cell of the column group; direction: "x", "y" or ""; kind: "scans", "run", "place", "flanks" or "nothing".
    Depths below a place, below flanks and over an area are different quantities, and so are computed ones.
    """

    label: str
    direction: str
    kind: str


class GroupMeans(NamedTuple):
    """Means over the pairs of a group: number of pairs, and the mean of each quantity by name."""

    count: int
    means: dict[str, Mean]


def read_pairs(table: Path) -> list[TableLine]:
    """Read pairs from a table whose columns before and after name files or results folders.

    Names are relative to the folder of the table. A column direction (x, y or empty) gives the axis along which the
    traces of a pair run; other columns are kept as text, and a column group separates the means.

    Raises
    ------
    Missing
        If the table is not there.
    PatchfemError
        If it is no such table, with file and line.
    """
    path = Path(table)
    text = read_text(path, "the table")
    find_factors(text, TableFormat({}, COLUMNS, ",".join(COLUMNS), "the table"))
    lines: dict[tuple, TableLine] = {}
    for number, row in text.iterate_rows(skips_blank=True):
        cells = dict(zip(text.names, row))
        names = tuple(cells.pop(column) for column in COLUMNS)
        direction = cells.pop("direction", "")
        if not all(names):
            column = COLUMNS[names.index("")]
            raise PatchfemError(f"{path}:{number}: {column}: the name of a file is needed")
        if direction not in DIRECTIONS:
            raise PatchfemError(
                f"{path}:{number}: direction: must be x, y or empty, not '{direction[:40]}'"
            )
        if names in lines:
            raise PatchfemError(
                f"{path}:{number}: repeats the pair of line {lines[names].line}; this pair would count twice in a mean"
            )
        paths = tuple(path.parent / name for name in names)
        lines[names] = TableLine(number, names, paths, direction, cells)
    if not lines:
        raise PatchfemError(
            f"{path}: no pair below its header; a line such as `new.csv,worn.csv` is needed for each"
        )
    return list(lines.values())


def average_pairs(rows: list[dict]) -> dict[Group, GroupMeans]:
    """Average the quantities of the pairs in each group.

    Parameters
    ----------
    rows : list of dict
        Content of compare.json of each pair, with `outcome` and `labels`. Only quantities with an interval count.
    """
    members: dict[Group, list[dict]] = {}
    for row in rows:
        if row["outcome"] == "done":
            members.setdefault(find_group(row), []).append(row)
    groups = {}
    for group, parts in members.items():
        means = {}
        for name in AVERAGED_QUANTITIES:
            known = [part[name] for part in parts if part.get(name, {}).get("high") is not None]
            values = [Quantity(q["value"], q["low"], q["high"], q["unit"], "") for q in known]
            if len(values) > 1:
                means[name] = average_quantities(values, "mean over the pairs")
        groups[group] = GroupMeans(len(parts), means)
    return groups


def find_group(row: dict) -> Group:
    """Return the group of a pair that was compared."""
    label = row["labels"].get("group", "")
    if "worn_volume" in row:
        return Group(label, "", "run" if row["reference"] == "run" else "scans")
    return Group(label, row["direction"] or "", row["reference"] or "nothing")
