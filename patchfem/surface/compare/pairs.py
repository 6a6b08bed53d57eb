"""A table of pairs of surfaces, before and after, and what the answers of several pairs have in the mean."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

from ...core import PatchfemError
from ...inputs.cells import cells_of, header_of, text_of
from ..quantity import Quantity, mean_of

HEADER = "before,after"
KINDS = {"scans": "areal scans", "run": "results folders", "place": "registered traces",
         "flanks": "traces compared by the unworn flanks of a "
                   "track", "nothing": "traces that cannot be registered to each other"}
AVERAGED = ("worn_volume", "grown_volume", "worn_share", "worn_depth_mean", "worn_depth_within", "worn_depth_max",
            "worn_area", "track_width", "track_depth", "track_depth_floor", "track_step", "track_area_gross",
            "track_area_net", "track_pile_up", "track_pile_up_left", "track_pile_up_right", "track_length",
            "track_volume", "amplitude_ratio", "slope_ratio")  # no places, which differ by how a trace was laid


class Asked(NamedTuple):
    """A line of a table of pairs: its number, both files as written and where they lie, direction, other cells."""

    line: int
    names: tuple
    paths: tuple
    direction: str
    labels: Mapping


def read_pairs(path) -> list[Asked]:
    """The pairs of a table with the columns before and after, files or results folders; they count from its folder.

    A column direction (x, y or empty) tells along which the traces of a pair run; other columns are kept as text, and a
    column group parts the means. PatchfemError for a table that is none, with file and line; Missing where it is not
    there.
    """
    path = Path(path)
    lines = text_of(path, "the table").split("\n")
    names, _ = header_of(path, lines[0], {}, tuple(HEADER.split(",")), HEADER, True)
    out, seen = [], {}
    for number, line in enumerate(lines[1:], 2):
        if not line.replace(",", "").strip():
            continue
        cells = cells_of(path, number, line, names)
        if empty := [name for name in HEADER.split(",") if not cells[name]]:
            raise PatchfemError(f"{path}:{number}: {empty[0]}: the name of a file is needed")
        if cells.get("direction", "") not in ("", "x", "y"):
            raise PatchfemError(f"{path}:{number}: direction: must be x, y or empty, not '{cells['direction'][:40]}'")
        pair = tuple(path.parent / cells[name] for name in HEADER.split(","))
        if pair in seen:
            raise PatchfemError(f"{path}:{number}: repeats the pair of line {seen[pair]}; this pair would count twice "
                                "in a mean")
        seen[pair] = number
        labels = {name: cell for name, cell in cells.items() if name not in ("before", "after", "direction")}
        out.append(Asked(number, tuple(cells[name] for name in HEADER.split(",")), pair, cells.get("direction", ""),
                         labels))
    if not out:
        raise PatchfemError(f"{path}: no pair below its header; a line such as `new.csv,worn.csv` is needed for each")
    return out


def each_pair(asked: list, answer: Callable, done: Callable | None = None) -> list[dict]:
    """What `answer(paths, direction)` gives of each pair, a dict, with the line of the table it stands in.

    A pair that fails has `outcome` "failed" and the reason as `message`; the others go on. done: takes the share that
    is done.
    """
    out = []
    for one in asked:
        own = {"line": one.line, "before": one.names[0], "after": one.names[1], "labels": dict(one.labels)}
        try:
            out.append({**answer(one.paths, one.direction), **own, "outcome": "done", "message": ""})
        except Exception as error:  # a defect of one pair must not cost the answers of the others
            known = isinstance(error, PatchfemError)
            text = str(error) if known else f"internal fault, please report it: {type(error).__name__}: {error}"
            out.append({**own, "direction": one.direction or None, "outcome": "failed", "message": text})
        if done is not None:
            done(len(out) / len(asked))
    return out


def numbers_of(row: dict) -> dict:
    """Name -> {value, low, high, unit} of the answer of a pair; of a scan's other direction as `amplitude_ratio_y`."""
    other = {f"{name}_{along}": part[name] for along, part in row.get("directions", {}).items()
             if along != row["direction"] for name in ("amplitude_ratio", "slope_ratio")}
    return {name: one for name, one in {**row, **other}.items() if isinstance(one, dict) and "value" in one}


def quantity(one: dict) -> Quantity:
    """A number of a pair as a `Quantity`."""
    return Quantity(one["value"], one["low"], one["high"], one["unit"], "", one.get("reason", ""))


def means_of(rows: list) -> list[tuple]:
    """(`group_of`, how many pairs, name -> `Mean`) of the answers of pairs, for each group of them."""
    groups = {}
    for row in rows:
        if row["outcome"] == "done":
            groups.setdefault(group_of(row), []).append(numbers_of(row))
    out = []
    for group, each in groups.items():
        names = dict.fromkeys(name for one in each for name in one if name.removesuffix("_x").removesuffix("_y")
                              in AVERAGED)
        found = {name: mean_of([quantity(one[name]) for one in each if one.get(name, {}).get("high") is not None],
                               "mean over the pairs") for name in names}
        out.append((group, len(each), {name: one for name, one in found.items() if one is not None}))
    return out


def group_of(row: dict) -> tuple:
    """(cell of the column group, direction, kind of `KINDS`) of the answer of a pair: depths that count from a place,
    from flanks, or over an area are means of different things, and so are measured and computed ones."""
    kind = row["reference"] or ("scans" if "worn_volume" in row else "nothing")
    return row["labels"].get("group", ""), "" if "worn_volume" in row else row["direction"] or "", kind
