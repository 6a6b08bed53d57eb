"""Quantities as text, and tables of quantities for the screen and for a page."""

from html import escape
from itertools import product
from typing import NamedTuple

import numpy as np

from ...formatting import UNIT_LADDERS, choose_unit, format_number
from ...surface.compare.reference import NO_LIMIT
from ...surface.quantity import Quantity
from ..pages.document import sentence_html, table_html

MAX_PLAIN_NUMBER = 1e6  # upper limit of numbers that are written without a power of ten
MIN_DIGITS = 3  # smallest number of significant digits, for a wide interval
MAX_DIGITS = 6  # largest number of significant digits, for a narrow interval
DIGITS_WITHOUT_INTERVAL = 5  # number of significant digits of a value without an interval
MISSING = "-"  # text in place of a missing value
UNITS = {**UNIT_LADDERS, "m2": (("um^2", 1e12),), "1": (("", 1.0),)}


class QuantityText(NamedTuple):
    """Value, interval and unit of a quantity as strings; the interval is "" if it is missing."""

    value: str
    interval: str
    unit: str

    @property
    def short(self) -> str:
        """The value with its unit."""
        return f"{self.value} {self.unit}".rstrip()

    @property
    def long(self) -> str:
        """The value with its unit, and the interval in brackets."""
        return f"{self.short} ({self.interval})" if self.interval else self.short


def format_quantity(quantity: Quantity, unit: tuple | None = None) -> QuantityText:
    """Format a quantity and its interval to two digits of the width of the interval.

    unit: (name, scale) such as ("um", 1e6); by default the unit that suits the largest of value and
    bounds.
    """
    value, low, high = quantity[:3]
    if value is None:
        return QuantityText(MISSING, "", "")
    bounds = [bound for bound in (low, high) if bound is not None]
    if unit is None:
        unit = choose_unit(
            UNITS[quantity.unit], max(map(abs, bounds if high is not None else (value, *bounds)))
        )
    name, scale = unit
    if low is None:
        return QuantityText(format_number(value * scale, DIGITS_WITHOUT_INTERVAL), "", name)
    if high is None:
        interval = f"{_format_below_million(low * scale, MIN_DIGITS)} .. {NO_LIMIT}"
        return QuantityText(_format_below_million(value * scale, MIN_DIGITS), interval, name)
    digits = _count_digits(low, high)
    text, *ends = (_format_below_million(number * scale, digits) for number in (value, low, high))
    return QuantityText(text, " .. ".join(ends), name)


def choose_common_unit(quantities: list) -> tuple:
    """Choose the unit (name, scale) that suits the largest bound of several quantities of one kind."""
    size = max(quantity.high for quantity in quantities)
    return choose_unit(UNITS[quantities[0].unit], size)


def _format_below_million(value: float, digits: int) -> str:
    """Write a number with `digits` digits; numbers below a million have no power of ten."""
    if value == 0 or not 1 <= abs(value) < MAX_PLAIN_NUMBER:
        return format_number(value, digits)
    return f"{value:.{max(digits - 1 - int(np.floor(np.log10(abs(value)))), 0)}f}"


def _count_digits(low: float, high: float) -> int:
    """Return the number of digits that resolves two digits of the width of an interval."""
    width = high - low
    size = max(abs(low), abs(high))
    if not width > 0 or not size > 0:
        return 4
    return int(np.clip(np.ceil(np.log10(size / width)) + 2, MIN_DIGITS, MAX_DIGITS))


def quantity_data(quantity: Quantity) -> dict:
    """Return a quantity as a dict in SI units, with the reason if it has no value."""
    data = {
        "value": quantity.value,
        "low": quantity.low,
        "high": quantity.high,
        "unit": quantity.unit,
    }
    return data if quantity.value is not None else {**data, "reason": quantity.reason}


class CsvColumns(NamedTuple):
    """Column headers that several tables of quantities share, and the cells of each table."""

    heads: list
    cells: list


def csv_columns(tables: list) -> CsvColumns:
    """Return each quantity with its bounds in SI as columns; a missing number becomes "".

    tables: dicts of name -> {value, low, high, unit}.
    """
    units = {}
    for quantities in tables:
        units |= {name: data["unit"] for name, data in quantities.items()}
    columns = list(product(units, (("value", ""), ("low", "_low"), ("high", "_high"))))
    heads = [f"{name}{suffix} [{units[name]}]" for name, (_, suffix) in columns]
    cells = []
    for quantities in tables:
        numbers = [quantities.get(name, {}).get(key) for name, (key, _) in columns]
        cells.append(["" if number is None else repr(number) for number in numbers])
    return CsvColumns(heads, cells)


class Row(NamedTuple):
    """Row of a table of quantities.

    Attributes
    ----------
    words : str
    quantity : Quantity
    unit : tuple or None
        (name, scale); by default the one that suits the quantity.
    more : tuple of str
        Cells between interval and unit.
    remark : str
        Text at the end of the row on the screen.
    meaning : str
        Last cell on a page.
    """

    words: str
    quantity: Quantity
    unit: tuple | None = None
    more: tuple = ()
    remark: str = ""
    meaning: str = ""


class QuantityTable(NamedTuple):
    """Rows of quantities, and the headers of the columns words, value, interval, more and unit."""

    heads: tuple
    rows: list

    def _cells(self) -> list:
        texts = [format_quantity(row.quantity, row.unit) for row in self.rows]
        return [
            (row.words, text.value, text.interval, *row.more, text.unit)
            for row, text in zip(self.rows, texts)
        ]

    def lines(self) -> list:
        """Return the table of quantities as lines of text, indented by two spaces."""
        cells = [("", *self.heads[1:]), *self._cells()]
        widths = [max(map(len, column)) for column in zip(*cells)]
        remarks = ["", *(row.remark for row in self.rows)]
        lines = []
        for (words, value, *others), remark in zip(cells, remarks):
            line = f"  {words:<{widths[0]}}  {value:>{widths[1]}}"
            line += "".join(f"  {text:<{width}}" for text, width in zip(others, widths[2:]))
            lines.append(f"{line}  {remark}".rstrip())
        return lines

    def html(self) -> str:
        """Return the table of quantities as HTML, with a column of meanings if there are any."""
        has_meaning = any(row.meaning for row in self.rows)
        rows = []
        for row, cells in zip(self.rows, self._cells()):
            line = [escape(cell) for cell in cells]
            if row.quantity.value is None:
                line[1] = "&ndash;"
            if has_meaning:
                line.append(f"<td class=soft>{sentence_html(row.meaning)}</td>")
            rows.append(line)
        numbers = [f">{head}" for head in self.heads[1:-1]]
        heads = (self.heads[0], *numbers, self.heads[-1], *(("meaning",) if has_meaning else ()))
        return table_html(heads, rows)
