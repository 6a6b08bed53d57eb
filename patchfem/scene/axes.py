"""Values of a key for the cases of a sweep: lists and ranges, as in --over and in [sweep].

A text such as ``1 mm..9 mm:5, 12 mm`` becomes an `Axis`. If values are drawn at random, ``1 mm..9 mm`` and
``5 mm +- 4 mm`` become a `SampledRange`.
"""

from __future__ import annotations

import re
from array import array
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple, get_origin

from ..core import PatchfemError
from .keys import quantities
from .keys.lookup import (
    LIMITS_BY_ERROR_TYPE,
    find_key,
    is_table_or_value,
    require_key,
    validate_value,
)
from .keys.types import (
    attributes_by_key,
    find_inner_table,
    find_quantity_kind,
    is_array_attribute,
    list_key_types,
    list_required_keys,
)
from .reader import read_set_value

LENGTH_KEY = "drive.displacement"  # key of a length whose values `read_lengths` reads
# Largest number of values in one range; the cases of a larger sweep would exhaust the memory.
MAX_RANGE_VALUES = 10_000_000
# Ratio of the ends of a range of positive numbers; at and above it the range is logarithmic by default.
MIN_LOG_RATIO = 10
MAX_SUGGESTED_KEYS = 4  # largest number of keys of a table that a message suggests
# Number of significant digits of a value, so that a tenth of a range is
# 0.1 and not 0.1000000000000001.
SIGNIFICANT_DIGITS = 15
# Magnitude below which a whole number without a unit is written without a decimal point.
MAX_EXACT_INTEGER = 1e15
_NUMBER_PATTERN = r"[-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?"
_RANGE_PATTERN = re.compile(r"(.*?)\s*\.\.\s*(.*?)\s*(?::\s*([0-9]*)\s*(log|lin)?)?")
_QUANTITY_PATTERN = re.compile(rf"{_NUMBER_PATTERN}\s*(.*)")
_TOLERANCE_PATTERN = re.compile(
    rf"({_NUMBER_PATTERN})\s*(.*?)\s*(?:\+/?-|±)\s*([0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(.*)"
)
_PLAIN_NUMBER_PATTERN = re.compile(
    r"[-+]?(0|[1-9][0-9]{0,14})(\.[0-9]{1,20})?([eE][-+]?[0-9]{1,2})?"
)
_OPENING_BRACKETS = {"]": "[", "}": "{"}


class FormattedNumbers(Sequence):
    """Sequence of numbers, each formatted as text only when it is accessed.

    Parameters
    ----------
    numbers : array of float64
        Numbers in this unit.
    unit : str
        Unit of the scene; "" for plain numbers.
    """

    __slots__ = "numbers", "unit"

    def __init__(self, numbers: array, unit: str):
        self.numbers = numbers
        self.unit = unit

    def __len__(self) -> int:
        return len(self.numbers)

    def __getitem__(self, index: int | slice) -> str | list[str]:
        if isinstance(index, slice):
            return [_format_with_unit(number, self.unit) for number in self.numbers[index]]
        return _format_with_unit(self.numbers[index], self.unit)


@dataclass(frozen=True, slots=True)
class Axis:
    """Swept key with its values.

    - key: dotted key of the scene.
    - texts: values as a scene writes them.
    - values: floats in SI; the strings if they are not numbers.
    - unit: SI unit of the values; "1" for plain numbers, "" for strings.
    """

    key: str
    texts: Sequence[str]
    values: Sequence[float | str]
    unit: str

    @property
    def name(self) -> str:
        """Name of the variable for the key, with underscores in place of dots."""
        return re.sub(r"\W", "_", self.key)


@dataclass(frozen=True, slots=True)
class SampledRange:
    """Swept key with the range from which its random values are drawn.

    - key: dotted key of the scene.
    - low, high: ends of the range in `unit`.
    - unit: unit of the scene; "" for a plain number.
    - log: whether the logarithm of the values is uniformly distributed.
    """

    key: str
    low: float
    high: float
    unit: str
    log: bool

    def make_axis(self, fractions: Iterable[float]) -> Axis:
        """Return the swept key with the values at the given fractions of its range."""
        ends = _RangeEnds(self.low, self.high, self.unit)
        numbers = (_interpolate(ends, fraction, self.log) for fraction in fractions)
        texts = FormattedNumbers(array("d", numbers), self.unit)
        read_value = _make_value_reader(self.key)
        return Axis(self.key, texts, array("d", map(read_value, texts)), _find_si_unit(self.key))


class _RangeEnds(NamedTuple):
    """Both ends of a range of values, in a common unit."""

    low: Fraction | float
    high: Fraction | float
    unit: str


class _WrittenRange(NamedTuple):
    """Range of values as written by the user: ends, count and type of spacing."""

    low: str
    high: str
    count: str | None
    spacing: str | None

    @property
    def ends_text(self) -> str:
        """Both ends as the user wrote them."""
        return f"{self.low}..{self.high}"


def read_axes(
    texts: Iterable[str], *, sampled: bool = False
) -> tuple[list[Axis | SampledRange], list[str]]:
    """Read strings ``table.key=v1,v2,...``, where a value may be a range ``low..high:n``.

    Parameters
    ----------
    texts : iterable of str
    sampled : bool
        Whether values are drawn at random: a range without its number of values becomes a Span.

    Returns
    -------
    tuple
        The axes, and the sentences about mistakes.
    """
    axes: list[Axis | SampledRange] = []
    mistakes = []
    for text in texts:
        key, equals, values = (part.strip() for part in text.partition("="))
        if equals and key:
            _append_axis(axes, mistakes, key, values, sampled=sampled)
        else:
            mistakes.append(
                f"--over {text}: write table.key=v1,v2,... or table.key=low..high:n, such as "
                "contact.tilt.angle=1e-6 rad..1e-2 rad:9"
            )
    counts = Counter(axis.key for axis in axes)
    return axes, mistakes + [f"{key}: is given twice" for key in counts if counts[key] > 1]


def read_lengths(text: str, name: str) -> list[float]:
    """Return the lengths [m] of a range ``a..b:n`` or a list in rising order; all are above 0.

    Raises PatchfemError, whose message begins with `name`, for any other text.
    """
    try:
        lengths = sorted(_read_axis(LENGTH_KEY, text).values)
    except ValueError as error:
        lines = str(error).split("\n")
        raise PatchfemError("; ".join(f"{name}: {line}" for line in lines)) from None
    if lengths[0] <= 0:
        raise PatchfemError(
            f"{name}: {lengths[0]:g} m; lengths above 0 are needed, such as 1 um..1 mm:9"
        )
    return lengths


def read_table(table: Any) -> tuple[list[Axis | SampledRange], list[tuple[str, str]]]:
    """Return the axes of a table [sweep] read from TOML, and (key, sentence) for each of its mistakes."""
    if not isinstance(table, dict) or not table:
        example = '"contact.tilt.angle" = "1e-6 rad..1e-2 rad:9"'
        return [], [("sweep", f"keys with their values are needed, such as {example}")]
    axes: list[Axis | SampledRange] = []
    mistakes = []
    for key, values in _flatten_table(table):
        sentences: list[str] = []
        if isinstance(values, list):
            values = ",".join(map(str, values))
        if isinstance(values, str):
            _append_axis(axes, sentences, key, values)
        else:
            sentences.append('the values must be a string, such as "0.1..0.6:6"')
        mistakes += [(f"sweep.{key}", text.removeprefix(f"{key}: ")) for text in sentences]
    return axes, mistakes


def describe_ranges(texts: Iterable[str]) -> list[str]:
    """Return a sentence on the range given by each string ``table.key=value +- tolerance``."""
    sentences = []
    for text in texts:
        key, _, values = (part.strip() for part in text.partition("="))
        try:
            ends = _range_about(values)
        except ValueError:  # `read_axes` reports this mistake
            continue
        if ends:
            sentences.append(f"{key}: {values} is drawn evenly from {ends}")
    return sentences


def make_axis(key: str, texts: Iterable[str], *, distinct: bool = True) -> Axis:
    """Return a swept key with a given list of values.

    Parameters
    ----------
    key : str
        Dotted key of a scene.
    texts : iterable of str
        Values as a scene writes them. A value beyond the limits of the key is accepted here and refused by its case.
    distinct : bool
        Whether no value may stand twice.

    Raises
    ------
    ValueError
        With one line for each value that the key does not accept.
    """
    require_key(key)
    texts = tuple(texts)
    _refuse_table(key, texts)
    read_value = _make_value_reader(key)
    values = []
    mistakes = []
    for text in texts:
        try:
            values.append(read_value(text))
        except ValueError as error:
            mistakes.append(str(error))
    if not mistakes and distinct and len(set(values)) < len(values):
        twice = next(k for k, value in enumerate(values) if values.index(value) < k)
        mistakes.append(f"{texts[twice]} is given twice")
    if mistakes:
        raise ValueError("\n".join(mistakes))
    if all(isinstance(value, float) for value in values):
        return Axis(key, texts, tuple(values), _find_si_unit(key))
    return Axis(key, texts, texts, "")


def _append_axis(
    axes: list, mistakes: list, key: str, values: str, *, sampled: bool = False
) -> None:
    """Read a swept key, and append it to the list of axes or of mistakes."""
    try:
        axes.append(_read_axis(key, values, sampled=sampled))
    except ValueError as error:
        mistakes += [f"{key}: {line}" for line in str(error).split("\n")]


def _read_axis(key: str, text: str, *, sampled: bool = False) -> Axis | SampledRange:
    """Parse the values of a swept key; raise ValueError with all mistakes."""
    require_key(key)
    pieces = _split_at_commas(text)
    can_be_span = sampled and len(pieces) == 1
    texts: list[str] = []
    mistakes = []
    for piece in pieces:
        try:
            written_range = _find_range(key, piece, is_sampled=can_be_span)
            if written_range is None:
                texts.append(piece)
            elif can_be_span:
                return _make_span(key, written_range)
            else:
                texts += _list_range_values(key, written_range)
        except ValueError as error:
            mistakes.append(str(error))
    if mistakes:
        raise ValueError("\n".join(mistakes))
    return make_axis(key, texts)


def _find_range(key: str, piece: str, *, is_sampled: bool) -> _WrittenRange | None:
    """Parse a range such as ``1..9 mm:5``; return None for a single value."""
    if not piece:
        raise ValueError("there is no value between two commas")
    if not _holds_number(key):
        return None
    if about := _range_about(piece):
        if not is_sampled:
            raise ValueError(
                f"{piece}: write this range as {about}:9 for 9 values in it, or as {about} with --random"
            )
        piece = f"{about}:lin"
    match = _RANGE_PATTERN.fullmatch(piece) if ".." in piece else None
    if match is None:
        return None
    # A bare number before the dots has the unit of the number after them, as in 1..9 mm.
    written_range = _WrittenRange(*match.groups())
    low = _QUANTITY_PATTERN.fullmatch(written_range.low)
    high = _QUANTITY_PATTERN.fullmatch(written_range.high)
    if low and high and high[1] and not low[1]:
        return written_range._replace(low=f"{written_range.low} {high[1]}")
    return written_range


def _range_about(text: str) -> str:
    """Convert a value with tolerance such as "5 mm +- 1 mm" to a range, or return "" if there is no tolerance.

    Raises ValueError if the tolerance has another unit than the value.
    """
    match = _TOLERANCE_PATTERN.fullmatch(text)
    if match is None:
        return ""
    number, unit, width, width_unit = match.groups()
    try:
        middle = Fraction(number)
        half = Fraction(width)
    except ValueError:  # the string is not a number, such as 1.2.3
        return ""
    if width_unit not in ("%", "", unit):
        unit_of_value = f" ({unit})" if unit else ""
        raise ValueError(
            f"{text}: write the width in % or in the unit of the value{unit_of_value}, or the range as low..high"
        )
    if width_unit == "%":
        half = abs(middle) * half / 100
    return "..".join(_format_with_unit(float(end), unit) for end in (middle - half, middle + half))


def _flatten_table(table: dict, table_key: str = "") -> list[tuple[str, Any]]:
    """Return (dotted key, value) for a table whose keys may be dotted or quoted."""
    pairs = []
    for key, value in table.items():
        path = f"{table_key}.{key}" if table_key else key
        pairs += _flatten_table(value, path) if isinstance(value, dict) else [(path, value)]
    return pairs


def _refuse_table(key: str, texts: tuple) -> None:
    """Raise ValueError for values that are assigned to a table, and suggest its keys."""
    model, name = find_key(key)
    inner = find_inner_table(model, name)
    if inner is None or is_table_or_value(model, name):
        return
    if all(text.startswith(("{", "[", '"', "'")) for text in texts):
        return
    item = ".NAME" if is_array_attribute(model, name) else ""
    required = list_required_keys(inner)
    suggested = [
        *required,
        *(inner_key for inner_key in attributes_by_key(inner) if inner_key not in required),
    ]
    raise ValueError(
        "is a table without a value of its own; choose a key of this table: "
        f"{', '.join(f'{key}{item}.{inner_key}' for inner_key in suggested[:MAX_SUGGESTED_KEYS])}"
    )


def _find_si_unit(key: str) -> str:
    return quantities.find_si_unit(find_quantity_kind(*find_key(key)))


def _holds_number(key: str) -> bool:
    """Return whether the value of a key is a single number, with or without unit."""
    place = find_key(key)
    types = list_key_types(*place)
    is_single = find_inner_table(*place) is None and tuple not in map(get_origin, types)
    return is_single and (float in types or int in types)


def _split_at_commas(text: str) -> list[str]:
    """Split a text at commas outside brackets and quotes.

    A quote opens at the start of a value or inside brackets; anywhere else it is a character like others.
    """
    pieces = []
    brackets = []
    quote = ""
    start = 0
    is_escaped = False
    for index, sign in enumerate(text):
        if quote:
            quote = "" if sign == quote and not is_escaped else quote
            is_escaped = sign == "\\" and quote == '"' and not is_escaped
        elif sign in "\"'" and (brackets or not text[start:index].strip()):
            quote = sign
        elif sign in "[{":
            brackets.append(sign)
        elif sign in _OPENING_BRACKETS and brackets and brackets[-1] == _OPENING_BRACKETS[sign]:
            brackets.pop()
        elif sign == "," and not brackets:
            pieces.append(text[start:index].strip())
            start = index + 1
    return [*pieces, text[start:].strip()]


def _make_value_reader(key: str) -> Callable[[str], float | str]:
    """Return a function that converts the string of a value to SI; a string that is not a number is unchanged.

    The function raises ValueError if the key does not accept the text.
    """
    place = find_key(key)
    is_number = _holds_number(key)
    takes_float = float in list_key_types(*place)
    kind = find_quantity_kind(*place) if is_number else None
    if kind is not None:
        return lambda text: quantities.parse_quantity(text, kind)

    def read_value(text: str) -> float | str:
        if is_number and takes_float and _PLAIN_NUMBER_PATTERN.fullmatch(text):
            # Most drawn values are plain numbers; `read_set_value` is slow for thousands of them.
            return float(text)
        value = quantities.read_percentage(read_set_value(key, text))
        if isinstance(value, dict) and find_inner_table(*place) is not None:
            return text
        has_number = isinstance(value, int | float) and not isinstance(value, bool)
        validate_value(
            key, float(value) if has_number and takes_float else value, LIMITS_BY_ERROR_TYPE
        )
        return float(value) if has_number else text

    return read_value


def _read_ends(key: str, written_range: _WrittenRange) -> _RangeEnds:
    """Return the ends of a range as exact fractions in the unit of its first end."""
    kind = find_quantity_kind(*find_key(key))
    texts = written_range[:2]
    if kind is None:
        texts = tuple(str(quantities.read_percentage(text)) for text in texts)
        if any(re.fullmatch(quantities.NUMBER_PATTERN, text) is None for text in texts):
            raise ValueError(
                f"{written_range.ends_text}: both ends of this range must be plain numbers"
            )
        return _RangeEnds(*map(Fraction, texts), "")
    for text in texts:
        quantities.parse_quantity(text, kind)
    (low, unit), (high, high_unit) = map(quantities.split_quantity, texts)
    units = quantities.UNIT_FACTORS[kind]
    names = (quantities.normalize_unit(name) for name in (unit, high_unit))
    low_factor, high_factor = (Fraction(repr(units[name])) for name in names)
    return _RangeEnds(Fraction(low), Fraction(high) * high_factor / low_factor, unit)


def _require_range_ends(ends: _RangeEnds, written_range: _WrittenRange) -> None:
    if ends.low == ends.high:
        raise ValueError(f"{written_range.ends_text}: both ends are the same value")


def _is_log(ends: _RangeEnds, spacing: str | None) -> bool:
    """Return whether the values of a range are spaced logarithmically."""
    is_positive = ends.low > 0 and ends.high > 0
    if spacing is None and is_positive:
        return max(ends.low / ends.high, ends.high / ends.low) >= MIN_LOG_RATIO
    if spacing == "log" and not is_positive:
        raise ValueError("a logarithmic range needs both ends > 0")
    return spacing == "log"


def _list_range_values(key: str, written_range: _WrittenRange) -> list[str]:
    """Return the values of a range as strings in the unit of its first end."""
    ends = _read_ends(key, written_range)
    count = int(written_range.count) if written_range.count else 0
    if not 2 <= count <= MAX_RANGE_VALUES:
        raise ValueError(
            f"{written_range.ends_text}: give the number of values after a colon, from 2 to {MAX_RANGE_VALUES}, such as "
            ":9"
        )
    _require_range_ends(ends, written_range)
    is_log = _is_log(ends, written_range.spacing)
    values = (_interpolate(ends, Fraction(k, count - 1), is_log) for k in range(count))
    return [_format_with_unit(value, ends.unit) for value in values]


def _make_span(key: str, written_range: _WrittenRange) -> SampledRange:
    """Return the range from which random values of a key are drawn."""
    ends = _read_ends(key, written_range)
    if float not in list_key_types(*find_key(key)):
        raise ValueError(
            f"{written_range.ends_text}: a key that takes whole numbers takes no range; list the values, such as "
            "1,2,3"
        )
    if written_range.count:
        raise ValueError(
            f"{written_range.ends_text}:{written_range.count}: random values are drawn between the ends; leave out "
            f":{written_range.count}"
        )
    _require_range_ends(ends, written_range)
    log = _is_log(ends, written_range.spacing)
    return SampledRange(key, float(ends.low), float(ends.high), ends.unit, log)


def _interpolate(ends: _RangeEnds, fraction: Fraction | float, is_log: bool) -> float:
    """Return the value at a given fraction of the range of a key."""
    if not is_log:
        return float(ends.low + (ends.high - ends.low) * fraction)
    if fraction in (0, 1):
        return float(ends.high if fraction else ends.low)
    return float(ends.low) * (float(ends.high) / float(ends.low)) ** float(fraction)


def _format_with_unit(value: float, unit: str) -> str:
    """Format a value of a swept key with its unit."""
    number = float(f"{value:.{SIGNIFICANT_DIGITS}g}")
    if unit:
        return f"{repr(number).removesuffix('.0')} {unit}"
    is_whole = number.is_integer() and abs(number) < MAX_EXACT_INTEGER
    return repr(int(number)) if is_whole else repr(number)
