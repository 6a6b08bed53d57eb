"""A table of pairs of surfaces, before and after wear, and the means over several pairs."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

from ...core import PatchfemError
from ...inputs.cells import TableFormat, parse_header, read_text, split_cells
from ..quantity import Quantity, average_quantities

COLUMNS = ("before", "after")  # columns that every table has
# Basis of the answer for a pair, as printed; means are taken only over pairs with the same basis.
KINDS = {
    "scans": "areal scans",
    "run": "results folders",
    "place": "registered traces",
    "flanks": "traces compared by the unworn flanks of a track",
    "nothing": "traces that cannot be registered to each other",
}
# Quantities that are averaged; positions are not, because they depend on where a trace begins.
AVERAGED_QUANTITIES = (
    "worn_volume",
    "grown_volume",
    "worn_share",
    "worn_depth_mean",
    "worn_depth_within",
    "worn_depth_max",
    "worn_area",
    "track_width",
    "track_depth",
    "track_depth_floor",
    "track_step",
    "track_area_gross",
    "track_area_net",
    "track_pile_up",
    "track_pile_up_left",
    "track_pile_up_right",
    "track_length",
    "track_volume",
    "amplitude_ratio",
    "slope_ratio",
)


class TableLine(NamedTuple):
    """Line in a table of pairs.

    line: its number; names: both files as written; paths: where they are; direction: "x", "y" or "";
    labels: the other cells by column.
    """

    line: int
    names: tuple
    paths: tuple
    direction: str
    labels: Mapping


class Group(NamedTuple):
    """Properties that are equal for all pairs over which a mean is taken.

    label: cell of the column group; direction: "x", "y" or ""; kind: key of `KINDS`. Depths that count
    from a place, from flanks, or over an area are different quantities, and so are computed ones.
    """

    label: str
    direction: str
    kind: str


class GroupMeans(NamedTuple):
    """Means over the pairs of a group: number of pairs, and `Mean` by name."""

    group: Group
    count: int
    means: dict


def read_pairs(path) -> list[TableLine]:
    """Read pairs from a table whose columns before and after name files or results folders.

    Names are relative to the folder of the table. A column direction (x, y or empty) gives the axis along
    which the traces of a pair run; other columns are kept as text, and a column group separates the means.

    Raises
    ------
    Missing
        If the table is not there.
    PatchfemError
        If it is no such table, with file and line.
    """
    path = Path(path)
    header, *rows = read_text(path, "the table").split("\n")
    table = TableFormat({}, COLUMNS, ",".join(COLUMNS), "the table", has_label_units=True)
    columns, _ = parse_header(path, header, table)
    lines = []
    numbers = {}
    for number, row in enumerate(rows, 2):
        if not row.replace(",", "").strip():
            continue
        line = _read_line(path, number, split_cells(path, number, row, columns))
        if line.paths in numbers:
            raise PatchfemError(
                f"{path}:{number}: repeats the pair of line {numbers[line.paths]}; this pair would count twice "
                "in a mean"
            )
        numbers[line.paths] = number
        lines.append(line)
    if not lines:
        raise PatchfemError(
            f"{path}: no pair below its header; a line such as `new.csv,worn.csv` is needed for each"
        )
    return lines


def _read_line(path: Path, number: int, cells: dict) -> TableLine:
    """Check the cells of a line."""
    names = tuple(cells[column] for column in COLUMNS)
    for column, name in zip(COLUMNS, names):
        if not name:
            raise PatchfemError(f"{path}:{number}: {column}: the name of a file is needed")
    direction = cells.get("direction", "")
    if direction not in ("", "x", "y"):
        raise PatchfemError(
            f"{path}:{number}: direction: must be x, y or empty, not '{direction[:40]}'"
        )
    labels = {
        column: cell for column, cell in cells.items() if column not in (*COLUMNS, "direction")
    }
    return TableLine(number, names, tuple(path.parent / name for name in names), direction, labels)


def compare_pairs(
    lines: list, answer: Callable, report_progress: Callable | None = None
) -> list[dict]:
    """Compare each pair of a table.

    Parameters
    ----------
    lines : list of TableLine
    answer : callable
        answer(paths, direction) returns the plain data of a pair.
    report_progress : callable, optional
        Receives the fraction of the pairs that are done.

    Returns
    -------
    list of dict
        Plain data with the cells of the line. A pair that fails has `outcome` "failed" and the reason as
        `message`; the others continue.
    """
    rows = []
    for line in lines:
        before, after = line.names
        cells = {"line": line.line, "before": before, "after": after, "labels": dict(line.labels)}
        try:
            row = {**answer(line.paths, line.direction), **cells, "outcome": "done", "message": ""}
        except Exception as error:  # a defect of one pair must not lose the answers of the others
            reason = str(error)
            if not isinstance(error, PatchfemError):
                reason = f"internal fault, please report it: {type(error).__name__}: {error}"
            direction = line.direction or None
            row = {**cells, "direction": direction, "outcome": "failed", "message": reason}
        rows.append(row)
        if report_progress is not None:
            report_progress(len(rows) / len(lines))
    return rows


def collect_quantities(row: dict) -> dict:
    """Collect the quantities {value, low, high, unit} of a pair in a dict by name.

    Ratios in the other direction of a scan are named after it, such as `amplitude_ratio_y`.
    """
    values = dict(row)
    for direction, part in row.get("directions", {}).items():
        if direction != row["direction"]:
            for name in ("amplitude_ratio", "slope_ratio"):
                values[f"{name}_{direction}"] = part[name]
    return {
        name: data for name, data in values.items() if isinstance(data, dict) and "value" in data
    }


def parse_quantity(data: dict) -> Quantity:
    """Make a `Quantity` from its JSON data."""
    reason = data.get("reason", "")
    return Quantity(data["value"], data["low"], data["high"], data["unit"], "", reason)


def average_pairs(rows: list) -> list[GroupMeans]:
    """Average the quantities of the pairs in each group, given as the JSON data of `compare_pairs`."""
    groups = {}
    for row in rows:
        if row["outcome"] == "done":
            groups.setdefault(find_group(row), []).append(collect_quantities(row))
    return [GroupMeans(group, len(parts), _average(parts)) for group, parts in groups.items()]


def _average(parts: list) -> dict:
    """Average the quantities of several pairs that have an interval."""
    names = dict.fromkeys(name for part in parts for name in part)
    means = {}
    for name in names:
        if name.removesuffix("_x").removesuffix("_y") not in AVERAGED_QUANTITIES:
            continue
        known = [part[name] for part in parts if part.get(name, {}).get("high") is not None]
        mean = average_quantities([parse_quantity(data) for data in known], "mean over the pairs")
        if mean is not None:
            means[name] = mean
    return means


def find_group(row: dict) -> Group:
    """Find the group of a pair from its JSON data."""
    label = row["labels"].get("group", "")
    if "worn_volume" in row:
        return Group(label, "", row["reference"] or "scans")
    return Group(label, row["direction"] or "", row["reference"] or "nothing")
