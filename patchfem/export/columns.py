"""CSV files of the curves of an answer, and the rows of its tables."""

import csv
import io

import numpy as np

from .answer import Answer, JsonObject, Quantity, Variable, Variables
from .charts.table import CSV_FILES, CSV_UNITS, Column, parse_columns

# cells of the columns of a CSV file by heading
Lists = dict[str, list[str | float]]
# cells of a row of a table by column
Cells = dict[str, Quantity | str | float]


def format_curves(answer: Answer) -> dict[str, str]:
    """Return the CSV files of an answer: name -> text.

    A column is headed by its name and its unit in brackets, in SI units if the table names no other unit. A missing number
    is an empty cell.
    """
    texts = {}
    for name, file in CSV_FILES.get(answer.kind, {}).items():
        columns = parse_columns(file.columns)
        if not file.source:
            lists = _list_variables(answer.data, columns)
        elif file.source == "curves":
            lists = _stack_curves(answer.details, columns)
        elif file.source in answer.details:
            lists = _list_objects(answer.details[file.source], columns, file.nested)
        else:
            rows = {key: one for key, one in answer.data.items() if one.dims == (file.source,)}
            lists = {key: list_cells(one) for key, one in rows.items()}
        if lists:
            texts[name] = format_csv(lists)
    return texts


def format_csv(lists: Lists) -> str:
    """Return columns of equal length as CSV: heading -> cells."""
    output = io.StringIO()
    writer = csv.writer(output, lineterminator="\n")
    writer.writerow(lists)
    writer.writerows(zip(*lists.values(), strict=True))
    return output.getvalue()


def list_cells(variable: Variable) -> list[str | float]:
    """Return the cells of a column; "" for a missing number."""
    cells = np.asarray(variable.values).tolist()
    if variable.meanings:
        return [variable.meanings[code] for code in cells]
    return ["" if cell != cell else cell for cell in cells]  # only NaN differs from itself


def add_unit(name: str, unit: str) -> str:
    """Return the heading of a column: its name, and its unit in brackets."""
    return f"{name} [{unit}]" if unit not in ("", "1") else name


def _list_variables(data: Variables, columns: list[Column]) -> Lists:
    """Return columns of variables; {} if there are less than two."""
    lists = {}
    for column in columns:
        variable = data.get(column.name)
        if variable is None:
            continue
        unit = column.heading.partition("[")[2].rstrip("]")
        if unit:
            scaled = Variable(variable.dims, variable.values * CSV_UNITS[unit])
            lists[column.heading] = list_cells(scaled)
        else:
            lists[add_unit(column.heading, variable.unit)] = list_cells(variable)
    return lists if len(lists) > 1 else {}


def _list_objects(rows: list[JsonObject], columns: list[Column], nested: str) -> Lists:
    """Return columns of a list of objects: texts, and the value and the interval of each quantity."""
    lists = {}
    for name in (column.name for column in columns):
        if name == "labels":  # a column for each label
            labels = dict.fromkeys(label for row in rows for label in row["labels"])
            lists |= {label: [row["labels"].get(label, "") for row in rows] for label in labels}
        else:
            lists[name] = [row.get(name) or "" for row in rows]
    rows = [row[nested] if nested else row for row in rows]
    units = {name: cell["unit"] for row in rows for name, cell in row.items() if _is_number(cell)}
    for name, unit in units.items():
        for key, suffix in (("value", ""), ("low", "_low"), ("high", "_high")):
            numbers = (row.get(name, {}).get(key) for row in rows)
            lists[add_unit(name + suffix, unit)] = list(map(_write_number, numbers))
    return lists


def _is_number(cell) -> bool:
    """Return whether a value of an object is a quantity."""
    return isinstance(cell, dict) and "value" in cell


def _stack_curves(details: JsonObject, columns: list[Column]) -> Lists:
    """Return columns with the curves of all methods, and of all values of a key, below each other."""
    key = details.get("key", "")
    lists = {key: []} if key else {}
    lists["method"] = []
    cases = zip(details.get("values", [""]), details.get("cases", [details]), strict=True)
    for value, case in cases:
        for method, curve in case["curves"].items():
            size = len(curve["amplitude"])
            if key:
                lists[key] += [value] * size
            lists["method"] += [method] * size
            # the band is that of the recommended curve
            known = curve | case["band"] if method == case["method"] else curve
            for column in columns:
                cells = known.get(column.name, [None] * size)
                lists.setdefault(column.heading, []).extend(map(_write_number, cells))
    return lists


def _write_number(number: float | None) -> float | str:
    """Return a number as a cell of a CSV file; "" for a missing one."""
    return "" if number is None else number


def list_rows(answer: Answer, source: str) -> list[Cells]:
    """Return the rows of a table: a list, or objects or lists by name in the details, or the variables of a dimension.

    source: as in `Table`.
    """
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
    columns = {}
    for name, variable in variables.items():
        columns[name] = list_cells(variable)
        if variable.values.dtype.kind == "f":
            ends = [end for end in ("error", "low", "high") if f"{name}_{end}" in variables]
            lists = [variables[f"{name}_{end}"].values for end in ends]
            columns[name] = [
                Quantity(value, variable.unit, **dict(zip(ends, numbers, strict=True)))
                for value, *numbers in zip(variable.values, *lists, strict=True)
            ]
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def make_quantity(content):
    """Return an object of a JSON file as a quantity if it is one; other content is unchanged."""
    if not _is_number(content):
        return content
    known = ("value", "unit", "error", "low", "high")
    return Quantity(**{key: content[key] for key in known if key in content})
