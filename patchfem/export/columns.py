"""Rows of an answer, and from them its CSV files and the tables of its page.

A source names the rows: a dimension of the arrays, a list of objects in the details, or the curves of a backbone. A row is a
dict: column -> quantity, number or text. CSV files and tables select columns by their heading lines in rows.toml.
"""

import csv
import io

import numpy as np

from ..formatting import format_number
from . import quantities
from .answer import Answer, Quantity, Variable
from .rows import CSV_FILES, TABLES, Column, CsvFile, parse_columns

# Number of these units in one SI unit
CSV_UNITS_PER_SI_UNIT = {"g": 1 / 9.80665, "mil": 1 / 25.4e-6}
# cells of a column of a CSV file by its heading. A missing cell is None or "".
Lists = dict[str, list[str | float | None]]
# cells of a row by column
Cells = dict[str, Quantity | str | float]
# table of a page: `title`, `headings`, and `rows` of strings
Table = dict[str, str | list[str] | list[list[str]]]
# endings of the names of arrays with the error or the interval of another array
ERROR_AND_INTERVAL_ENDINGS = ("error", "low", "high")


def list_rows(answer: Answer, source: str) -> list[Cells]:
    """Return the rows of a source.

    `source` is "curves" for the curves of a backbone below each other, the name of a dimension, or a path in the
    details, such as "pressed/measures", which leads to a list, or to objects or lists by name.
    """
    if source == "curves":
        return _stack_curves(answer)
    content = answer.details
    for key in source.split("/"):
        content = content.get(key) if isinstance(content, dict) else None
    if isinstance(content, dict):
        content = [
            {"name": name.replace("_", " "), **row}
            for name, entry in content.items()
            for row in (entry if isinstance(entry, list) else [entry])
        ]
    if isinstance(content, list):
        # the quantities of an object may be in an object of their own
        rows = [row | row.get("measures", {}) for row in content]
        return [{key: make_quantity(one) for key, one in row.items()} for row in rows]

    variables = {name: one for name, one in answer.data.items() if one.dims == (source,)}
    columns = {name: list_cells(one) for name, one in variables.items()}
    for name, variable in variables.items():
        if variable.values.dtype.kind == "f":
            ends = [variables.get(f"{name}_{end}") for end in ERROR_AND_INTERVAL_ENDINGS]
            numbers = [[None] * len(variable.values) if one is None else one.values for one in ends]
            columns[name] = [
                Quantity(value, variable.unit, *parts)
                for value, *parts in zip(variable.values, *numbers, strict=True)
            ]
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def list_cells(variable: Variable) -> list[str | float]:
    """Return the elements of a variable of one dimension, with codes as their meanings."""
    cells = np.asarray(variable.values).tolist()
    return [variable.meanings[code] for code in cells] if variable.meanings else cells


def _stack_curves(answer: Answer) -> list[Cells]:
    """Return the points of all curves of a backbone, one below the other, as rows of a table.

    There is a curve for each method, and for each value of a key that was varied. A row has the labels of its curve, the
    method, and the columns of the curve.
    """
    details = answer.details
    rows = []
    for case in details.get("cases", [details]):
        labels = {details["key"]: case["value"]} if "key" in details else {}
        for method, curve in case["curves"].items():
            # the band is that of the recommended curve
            band = {name: [None] * len(curve["amplitude"]) for name in case["band"] or ()}
            known = band | curve | (case["band"] if method == case["method"] else {})
            points = zip(*known.values(), strict=True)
            first = {"labels": labels, "method": method}
            rows += [first | dict(zip(known, point)) for point in points]
    return rows


def make_quantity(content):
    """Return an object of a JSON file as a quantity if it is one; other content is unchanged."""
    if not isinstance(content, dict) or "value" not in content:
        return content
    known = ("value", "unit", *ERROR_AND_INTERVAL_ENDINGS)
    return Quantity(**{key: content[key] for key in known if key in content})


def format_curves(answer: Answer) -> dict[str, str]:
    """Return the CSV files of an answer: name -> text.

    A column is headed by its name and its unit in brackets, in SI units if the table names no other unit. A missing number
    is an empty cell.
    """
    texts = {}
    for name, file in CSV_FILES.get(answer.kind, {}).items():
        lists = _list_columns(list_rows(answer, file.source), file)
        if len(lists) > 1:
            texts[name] = format_csv(lists)
    return texts


def _list_columns(rows: list[Cells], file: CsvFile) -> Lists:
    """Return the columns of a CSV file by heading, without those that no row has.

    The file definition names the columns, or else the rows have them.
    """
    lists = {}
    used_names = dict.fromkeys(name for row in rows for name in row)
    columns = [Column(name, name, "bare") for name in used_names]
    for column in parse_columns(file.columns) if file.columns else columns:
        if column.name == "labels":  # a column for each label
            labels = [row["labels"] for row in rows]
            names = dict.fromkeys(name for one in labels for name in one)
            lists |= {name: [one.get(name, "") for one in labels] for name in names}
        elif column.name in used_names:
            lists |= _list_column(rows, column)
    for name in used_names if file.has_intervals else ():
        if any(isinstance(row.get(name), Quantity) for row in rows):
            for part in ("value", "low", "high"):
                heading = name if part == "value" else f"{name}_{part}"
                lists |= _list_column(rows, Column(heading, name), part)
    return lists


def _list_column(rows: list[Cells], column: Column, quantity_part: str = "value") -> Lists:
    """Return a column of numbers or texts: its heading with the unit, and a cell for each row.

    `rows` have the cells by name, and `quantity_part` of a quantity is "value", "low" or "high".
    """
    heading = column.heading
    cells = [row.get(column.name) for row in rows]
    sized = [cell for cell in cells if isinstance(cell, Quantity)]
    if not sized:
        return {heading: cells}

    # numbers are in the unit of the heading, or in the SI unit, which then follows the name
    unit = heading.partition("[")[2].rstrip("]")
    if not unit and column.style != "bare" and sized[0].unit not in ("", "1"):
        heading = f"{heading} [{sized[0].unit}]"
    numbers = [getattr(cell, quantity_part, None) for cell in cells]
    scale = CSV_UNITS_PER_SI_UNIT.get(unit, 1.0)
    return {heading: [None if cell is None else cell * scale for cell in numbers]}


def format_csv(lists: Lists) -> str:
    """Return columns of equal length as CSV: heading -> cells."""
    output = io.StringIO()
    writer = csv.writer(output, lineterminator="\n")
    writer.writerow(lists)
    writer.writerows(zip(*lists.values(), strict=True))
    return output.getvalue()


def make_tables(answer: Answer) -> list[Table]:
    """Return the tables of an answer with `title`, `headings` and `rows` of strings, without tables that have no rows."""
    tables = []
    for table in TABLES.get(answer.kind, ()):
        rows = list_rows(answer, table.source)
        known = {name for row in rows for name in row}
        columns = [one for one in parse_columns(table.columns) if one.name in known]
        headings = [_find_heading(answer, column) for column in columns]
        largest = _find_largest(rows, columns)
        texts = []
        for row in rows:
            cells = zip(columns, headings, strict=True)
            texts.append([_format_cell(row, column, largest, heading) for column, heading in cells])
        tables.append({"title": table.title, "headings": headings, "rows": texts})
    return [table for table in tables if table["rows"]]


def _find_heading(answer: Answer, column: Column) -> str:
    """Return the text above a column of a table; the heading "*" stands for the description of the variable."""
    heading = answer.data[column.name].text if column.heading == "*" else column.heading
    return heading.replace("_", " ")


def _find_largest(rows: list[Cells], columns: list[Column]) -> dict[str, float]:
    """Return the largest magnitude of the quantities in each of some columns by name; 0 without any."""
    largest = {}
    for column in columns:
        cells = [row.get(column.name) for row in rows]
        values = [cell.value for cell in cells if isinstance(cell, Quantity) and cell.value]
        largest[column.name] = max(map(abs, values), default=0.0)
    return largest


def _format_cell(row: Cells, column: Column, largest: dict[str, float], heading: str) -> str:
    """Return a cell of a table as text.

    A missing value is a dash, and round-off beside the largest value of the column is 0.

    Parameters
    ----------
    row : dict
        Cells of the row by name.
    column : Column
        Column of the cell.
    largest : dict of str to float
        Largest magnitude in each column.
    heading : str
        Text above the column. If it is a description, what this names sets the display unit.
    """
    cell = row.get(column.name)
    if cell is not None and column.style == "quantity":
        cell = make_quantity(row)
    if column.style == "rounded":
        number = getattr(cell, "value", cell)
        if number is not None and abs(number) <= quantities.VALUE_ROUND_OFF:
            return "0"
        return "-" if number is None else format_number(number, 3)
    if cell is None:
        return "-"
    if isinstance(cell, Quantity):
        if cell.value and abs(cell.value) <= quantities.VALUE_ROUND_OFF * largest[column.name]:
            return "0"
        name = heading.replace(" ", "_") if column.heading == "*" else column.name
        return quantities.format_quantity(name, cell)
    if isinstance(cell, float):
        return f"{100 * cell:+.3g} %" if column.style == "percent" else format_number(cell, 6)
    return str(cell).replace("_", " ") if column.style == "name" else str(cell)
