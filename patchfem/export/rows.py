"""Rows of the answers of all verbs, from the table rows.toml: variables, quantities, charts, CSV files and tables of pages.

A new variable, quantity, chart, file or table is a new row. A chart names variables of the answer, and it is shown if the
answer has them. The columns of CSV files and tables are written as their heading line: "HEADING = NAME", or NAME alone if
both are equal.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from .. import __version__
from .answer import RUN_KINDS, Definition, JsonObject, Row, Variables, make_column


@dataclass(frozen=True, slots=True)
class Chart:
    """Chart of an answer.

    Several names in a string are separated by spaces.

    Attributes
    ----------
    title : str
        Heading of the chart.
    x : str
        Variable of the horizontal axis. Several names: the first one that the answer has.
    y : str
        Variables of the vertical axis. "NAME@X" is drawn against its own variable X.
    style : str
        "line", "points", "area", "map" (colours over x and the first dimension), "face" (a map of the last frame over x and
        y), "overlay" (a line for each element of the first dimension) or "film" (a map with a slider). Of a sweep:
        "relative" (the main measures and those of `y`, divided by their first value), "menu" (one measure at a time) or
        "maps" (the same over two keys).
    span : str
        "all", "cycles" (last three cycles), "run" (all cycles, if there are more) or "contact" (the loaded part of x).
    log : str
        Logarithmic axes: "", "x", "y" or "xy". "auto" decides by the values, also for the other axis of "x auto".
    by : str
        Variable of codes that colour the points of the first variable.
    marks : str
        Variables whose values are vertical lines.
    lines : str
        Further variables of the vertical axis, drawn as lines beside points.
    thin : str
        Variables of the vertical axis that are drawn thin, below the others, which are bold.
    x_label, y_label : str
        Names of the axes, or "" for the name of the variable, "*" for its description.
    caption : str
        Sentence below the chart, or "" for none.
    """

    title: str
    x: str
    y: str
    style: str = "line"
    span: str = "all"
    log: str = ""
    by: str = ""
    marks: str = ""
    lines: str = ""
    thin: str = ""
    x_label: str = ""
    y_label: str = ""
    caption: str = ""


class Column(NamedTuple):
    """Column of a CSV file or of a table.

    - heading: text above the column.
    - name: variable of the answer, or key in each row of its details.
    - style: "" for values as they are. In a table also "name" for words with underscores, "quantity" for a value with the
      unit, the error and the interval of its row, "rounded" for three digits, and "percent" for a relative change. In a CSV
      file also "bare" for a heading without the unit.
    """

    heading: str
    name: str
    style: str = ""


def parse_columns(line: str) -> list[Column]:
    """Return the columns of a heading line such as "x, height = before, at = value:quantity".

    Each part is NAME, HEADING = NAME or HEADING = NAME:STYLE, as the fields of `Column`. Without a heading the name is
    used.
    """
    columns = []
    for part in line.split(", "):
        heading, _, source = part.partition(" = ")
        name, _, style = (source or heading).partition(":")
        columns.append(Column(heading.partition(":")[0], name, style))
    return columns


class CsvFile(NamedTuple):
    """CSV file of an answer.

    - source: its rows (`columns.list_rows`).
    - columns: heading line (`parse_columns`), or "" for all columns of the rows. A heading may end in a unit of
      CSV_UNITS_PER_SI_UNIT. The name `labels` stands for the texts of an object, each of which has a column.
    - has_intervals: whether the columns NAME, NAME_low and NAME_high of all quantities of the rows follow.
    """

    source: str
    columns: str
    has_intervals: bool = False


class Table(NamedTuple):
    """Table of an answer.

    - title: heading.
    - source: its rows (`columns.list_rows`).
    - columns: heading line (`parse_columns`). The heading "*" is the description of the variable.
    """

    title: str
    source: str
    columns: str


def _repeat_for_runs(table: dict[str, Any]) -> dict[str, Any]:
    """Return a table by kind of answer, with the entry "run" under each kind of a run."""
    return dict.fromkeys(RUN_KINDS, table.get("run")) | table


_TABLES = tomllib.loads(Path(__file__).with_name("rows.toml").read_text(encoding="utf-8"))
# rows of the variables by name, for each group of answers
VARIABLES: dict[str, dict[str, Row]] = {
    group: {name: Row(*row) for name, row in rows.items()}
    for group, rows in _TABLES["variables"].items()
}
QUANTITIES = {name: Definition(*row) for name, row in _TABLES["quantities"].items()}
# places of the keys of JSON files in the record of the verb
DETAILS: dict[str, dict[str, str]] = _TABLES["details"]
# words of the measures in the headline of a run, by its kind
HEADLINES: dict[str, dict[str, str]] = _TABLES["headlines"]
CHARTS: dict[str, tuple[Chart, ...]] = _repeat_for_runs(
    {kind: tuple(Chart(**row) for row in rows) for kind, rows in _TABLES["charts"].items()}
)
CSV_FILES: dict[str, dict[str, CsvFile]] = {
    kind: {name: CsvFile(**row) for name, row in rows.items()}
    for kind, rows in _TABLES["csv_files"].items()
}
# what a file beside a page is, by its name or its ending
FILE_DESCRIPTIONS: dict[str, str] = _TABLES["files"]
# tables that stand below the charts
TABLES: dict[str, tuple[Table, ...]] = _repeat_for_runs(
    {kind: tuple(Table(**row) for row in rows) for kind, rows in _TABLES["tables"].items()}
)


def make_variables(group: str, **columns: Any) -> Variables:
    """Return arrays as the variables of their rows.

    Parameters
    ----------
    group : str
        Group of rows: "run", "fit", "cost" or "surface".
    **columns
        Arrays by name, or pairs of an array and its unit where the unit is not that of the row. A number that is None
        becomes NaN. NAME_error, NAME_low and NAME_high have the dimensions and the unit of NAME.
    """
    variables = {}
    for name, values in columns.items():
        row = VARIABLES[group].get(name)
        if row is None:
            row = VARIABLES[group][name.rpartition("_")[0]]._replace(text="")
        if isinstance(values, tuple):
            values, unit = values
            row = row._replace(unit=unit)
        variables[name] = make_column(name, values, row)
    return variables


def look_up(value, place: str):
    """Return the content of a place below an object, such as "window.extra.ledger.0", or None if it does not exist.

    The parts of the place are names of attributes, keys of dicts and indices.
    """
    for name in place.split("."):
        if isinstance(value, dict):
            value = value.get(name)
        else:
            value = value[int(name)] if name.isdigit() else getattr(value, name, None)
        if value is None:
            return None
    return value


def make_details(kind: str, record, **computed: Any) -> JsonObject:
    """Return the keys of a JSON file in the order of their rows.

    Parameters
    ----------
    kind : str
        Group of rows, such as "fit".
    record : object
        Record of the verb, in which the rows have their places.
    **computed
        Values of the keys that have no place in it, except the version.
    """
    computed["patchfem"] = __version__
    details = {}
    for name, place in DETAILS[kind].items():
        details[name] = computed[name] if name in computed else look_up(record, place)
    return details
