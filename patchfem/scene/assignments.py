"""Values that are given to keys beside the tables of a scene: the only parser of ``table.key=values``.

--over, --free, the table [sweep] and the arguments of Python give a key a list of values, ``26 lbf, 100 N``, or a range.
A range with a number of values, ``1 mm..9 mm:5``, stands for these values. A range without it, ``1 mm..9 mm``, is one
from which random values are drawn, or in which a fit varies the key.
"""

from __future__ import annotations

import re
from array import array
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from math import prod
from typing import NamedTuple, get_origin

from ..core import PatchfemError
from .keys import quantities
from .keys.lines import split_assignment, split_key
from .keys.lookup import LIMITS_BY_ERROR_TYPE, validate_value
from .keys.removed import describe_removed
from .keys.types import Key, list_keys, list_required_keys
from .keys.values import TomlTable, TomlValue
from .reader import is_toml, read_set_value
from .suggestions import require_key

# keys of a length and of a force whose values `read_positive_values` reads, with an example
POSITIVE_KEYS = {
    "length": ("drive.displacement", "1 um..1 mm:9"),
    "force": ("drive.force", "1 N..100 N:9"),
}
# Largest number of cases of a sweep; the hashes and columns of more cases take gigabytes.
MAX_CASES = 3_000_000
# Pattern of a number
_NUMBER_PATTERN = r"[-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?"
# Pattern of a range: first..last, with :count and the spacing log or lin
_RANGE_PATTERN = re.compile(r"(.*?)\s*\.\.\s*(.*?)\s*(?::\s*([0-9]*)\s*(log|lin)?)?")
# Pattern of a number with a unit
_QUANTITY_PATTERN = re.compile(rf"{_NUMBER_PATTERN}\s*(.*)")


class Form(NamedTuple):
    """Form of the text after ``table.key=`` that an option of a command accepts.

    - option: name of the option in messages.
    - usage: what messages say is needed, with an example.
    - has_lists: whether a list of values is accepted.
    - has_ranges: whether a range without a number of values is accepted.
    """

    option: str
    usage: str
    has_lists: bool
    has_ranges: bool


LIST_FORM = Form(
    "--over",
    "table.key=v1,v2,... or table.key=low..high:n, such as contact.tilt.angle=1e-6 rad..1e-2 rad:9",
    has_lists=True,
    has_ranges=False,
)
RANDOM_FORM = LIST_FORM._replace(has_ranges=True)
BOUNDS_FORM = Form(
    "--free",
    "table.key=low..high, such as friction.bond_length=0.2 um..20 um",
    has_lists=False,
    has_ranges=True,
)


@dataclass(frozen=True, slots=True)
class Axis:
    """Key of a scene that a sweep varies, with its values.

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
class Range:
    """Key with the range in which its value is drawn or fitted, or over which the values of a sweep are spread.

    - key: dotted key of the scene.
    - low, high: ends in SI; `low` is the end that is written first.
    - kind: kind of quantity; None for a plain number.
    - ends: both ends in `written_unit`, "" for plain numbers; () if the range was not written.
    - count: number of values; 0 if none is given.
    - is_log: whether the values are spaced logarithmically.
    """

    key: str
    low: float
    high: float
    kind: str | None
    ends: tuple[float, ...] = ()
    written_unit: str = ""
    count: int = 0
    is_log: bool = False

    @property
    def unit(self) -> str:
        """SI unit of the key, or "1" for a number without unit."""
        return quantities.find_si_unit(self.kind)

    @property
    def text(self) -> str:
        """Both ends as a scene writes them."""
        return "..".join(self.format_values((0, 1)))

    def format_values(self, fractions: Iterable[float]) -> list[str]:
        """Return the values at fractions of the range, from 0 (`low`) to 1 (`high`), as a scene writes them."""
        first, last = self.ends
        if self.is_log:
            numbers = (first ** (1 - part) * last**part for part in fractions)
        else:
            numbers = (first * (1 - part) + last * part for part in fractions)
        return [_format_with_unit(number, self.written_unit) for number in numbers]

    def format_assignment(self, value: float) -> str:
        """Return the assignment that sets the key to a value in SI units."""
        text = quantities.format_si(value, self.kind) if self.kind else repr(float(value))
        return f"{self.key}={text}"

    def make_axis(self, fractions: Iterable[float]) -> Axis:
        """Return the key with its values at fractions of the range, from 0 (`low`) to 1 (`high`)."""
        texts = self.format_values(fractions)
        values = array("d", map(_ValueReader(self.key, texts).read, texts))
        return Axis(self.key, texts, values, self.unit)


def read_assignments(
    texts: Iterable[str], form: Form = LIST_FORM
) -> tuple[list[Axis | Range], list[str]]:
    """Read strings ``table.key=values``.

    Parameters
    ----------
    texts : iterable of str
        Values of the option.
    form : Form
        What the option accepts. Without lists of values, commas separate several assignments in one string.

    Returns
    -------
    axes : list of Axis or Range
        A Range for a key with a range without a number of values, else an Axis with the values.
    mistakes : list of str
        A sentence for each mistake.
    """
    axes: list[Axis | Range] = []
    mistakes = []
    texts = list(texts)
    if texts and not form.has_lists:
        texts = ",".join(texts).split(",")
    for text in texts:
        key, values = split_assignment(text)
        if key and values:
            _append_values(axes, mistakes, f"{form.option} {key}", (key, values), form)
        else:
            mistakes.append(f"{form.option} {text}: write {form.usage}")
    if not (texts or form.has_lists):
        mistakes.append(f"{form.option}: at least one range is needed, {form.usage}")
    counts = Counter(item.key for item in axes)
    mistakes += [f"{form.option} {key}: is given twice" for key in counts if counts[key] > 1]
    return axes, mistakes


def read_table(table: TomlValue) -> tuple[list[Axis], list[tuple[str, str]]]:
    """Return the axes of a table [sweep] read from TOML, and (key, sentence) for each of its mistakes."""
    if not isinstance(table, dict) or not table:
        example = '"contact.tilt.angle" = "1e-6 rad..1e-2 rad:9"'
        return [], [("sweep", f"keys with their values are needed, such as {example}")]
    axes: list[Axis] = []
    mistakes = []
    for key, values in _flatten_table(table):
        sentences: list[str] = []
        if isinstance(values, list):
            values = ",".join(map(str, values))
        if isinstance(values, str):
            _append_values(axes, sentences, "", (key, values), LIST_FORM)
        else:
            sentences.append('the values must be a string, such as "0.1..0.6:6"')
        mistakes += [(f"sweep.{key}", sentence) for sentence in sentences]
    return axes, mistakes


def read_positive_values(text: str, name: str, kind: str = "length") -> list[float]:
    """Return the values of a range ``a..b:n`` or of a list in rising order.

    All are above 0.

    Raises PatchfemError, whose message begins with `name`, for any other text.

    `kind` is "length" [m] or "force" [N].
    """
    key, example = POSITIVE_KEYS[kind]
    try:
        axis = read_values(key, text)
    except ValueError as error:
        raise PatchfemError(f"{name}: {error}") from None
    values = sorted(axis.values)
    if values[0] <= 0:
        raise PatchfemError(
            f"{name}: {values[0]:g} {axis.unit}; {kind}s above 0 are needed, such as {example}"
        )
    return values


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
        If the key does not accept a value.
    """
    texts = tuple(texts)
    reader = _ValueReader(key, texts)
    values = [reader.read(text) for text in texts]
    if distinct and len(set(values)) < len(values):
        twice = next(k for k, value in enumerate(values) if values.index(value) < k)
        raise ValueError(f"{texts[twice]} is given twice")
    if all(isinstance(value, float) for value in values):
        unit = quantities.find_si_unit(reader.known.kind)
        return Axis(key, texts, array("d", values), unit)
    return Axis(key, texts, texts, "")


def read_values(key: str, text: str, form: Form = LIST_FORM) -> Axis | Range:
    """Parse the values of a key, which the text of an option lists or gives as a range.

    Parameters
    ----------
    key : str
        Dotted key of a scene.
    text : str
        The values as an option writes them.
    form : Form
        What the option accepts.

    Returns
    -------
    Axis or Range
        A Range for a range without a number of values, else an Axis with the values.

    Raises
    ------
    ValueError
        If the text is no value, list or range of the key.
    """
    pieces = _split_at_commas(text)
    reader = _ValueReader(key, pieces)
    if not text.strip():
        raise ValueError("at least one value is needed")
    if not (form.has_lists or reader.is_number):
        raise ValueError(
            "is not a number that can vary; only quantities and plain numbers can be free"
        )
    # The sign of a tolerance
    if reader.is_number and re.search(r"\+/?-|±", text):
        raise ValueError(describe_removed("value with a tolerance", f"{text}: a tolerance"))
    if form.has_ranges and len(pieces) == 1:
        spread = reader.parse_range(text.strip())
        if spread is not None:
            reader.check_range(spread, form)
            return spread
    if not form.has_lists:
        raise ValueError(f"{text}: a range is needed, {form.usage}")
    return make_axis(key, chain.from_iterable(map(reader.list_values, pieces)))


def require_possible_count(n_cases: int) -> None:
    """Raise ValueError if a sweep of so many cases is not possible."""
    if n_cases > MAX_CASES:
        raise ValueError(
            f"the sweep has {n_cases} cases, more than the largest number possible ({MAX_CASES}); give fewer values "
            "for each key, or draw N cases from the ranges with --sobol N"
        )


def _count_values(text: str) -> int:
    """Return the number of values in a list of values and ranges."""
    ranges = map(_RANGE_PATTERN.fullmatch, _split_at_commas(text))
    return sum(int(match[3] or 1) if match else 1 for match in ranges)


def _append_values(
    given: list[Axis | Range],
    mistakes: list[str],
    name: str,
    assignment: tuple[str, str],
    form: Form,
) -> None:
    """Read the values of a key, and append them to `given`, or the mistake in them to `mistakes`.

    `assignment` are the key and the text of its values, and `form` is what the option accepts. `name` is the option,
    which the text of a mistake begins with, or "".
    """
    try:
        # Counted before the ranges are expanded, which takes a minute for ten million values.
        n_cases = prod(len(item.texts) for item in given if isinstance(item, Axis))
        require_possible_count(n_cases * _count_values(assignment[1]))
        given.append(read_values(*assignment, form))
    except ValueError as error:
        mistakes.append(f"{name}: {error}" if name else str(error))


class _ValueReader:
    """Reader of the values of one key.

    - key: dotted key of a scene.
    - known: record of the key.
    - is_number: whether a value is a single number, with or without unit.

    A key that no scene has, or that is a table, raises ValueError.
    """

    def __init__(self, key: str, texts: Sequence[str]) -> None:
        self.key = key
        self.known = _find_value_key(key, texts)
        types = self.known.types
        is_single = self.known.inner is None and tuple not in map(get_origin, types)
        self.is_number = is_single and (float in types or int in types)
        self.takes_float = float in types

    def read(self, text: str) -> float | str:
        """Convert a text to SI; a text that is not a number is unchanged. Raise ValueError for a wrong value."""
        known = self.known
        if self.is_number and known.kind is not None:
            return quantities.parse_quantity(text, known.kind)
        # Most drawn values are plain numbers; `read_set_value` is slow for thousands of them.
        is_plain = self.is_number and self.takes_float
        if is_plain and re.fullmatch(quantities.NUMBER_PATTERN, text):
            return float(text)
        value = quantities.read_percentage(read_set_value(self.key, text))
        if isinstance(value, dict) and known.inner is not None:
            return text
        has_number = isinstance(value, int | float) and not isinstance(value, bool)
        number = float(value) if has_number else text
        validate_value(
            self.key, number if has_number and self.takes_float else value, LIMITS_BY_ERROR_TYPE
        )
        return number

    def list_values(self, piece: str) -> list[str]:
        """Return the values of one part of a list, as a scene writes them.

        `piece` is the text between two commas: a range ``1..9 mm:5`` stands for its values, any other text for itself.
        """
        if not piece:
            raise ValueError("there is no value between two commas")
        spread = self.parse_range(piece)
        if spread is None:
            return [piece]
        if not 2 <= spread.count <= MAX_CASES:
            raise ValueError(
                f"{spread.text}: give the number of values after a colon, from 2 to {MAX_CASES}, such as :9"
            )
        return spread.format_values(k / (spread.count - 1) for k in range(spread.count))

    def parse_range(self, piece: str) -> Range | None:
        """Parse a text `piece` as a range such as ``1..9 mm:5``, or return None for any other text."""
        match = _RANGE_PATTERN.fullmatch(piece) if self.is_number else None
        if match is None:
            return None
        first, last, count, spacing = match.groups()
        # A bare number before the dots has the unit of the number after them, as in 1..9 mm.
        with_unit = _QUANTITY_PATTERN.fullmatch(last)
        if with_unit and re.fullmatch(_NUMBER_PATTERN, first):
            first = f"{first} {with_unit[1]}".rstrip()
        low, high = map(self.read, (first, last))

        # Both ends in the unit of the first one.
        kind = self.known.kind
        factor = 1.0
        unit = ""
        if kind is not None:
            _, unit = quantities.split_quantity(first)
            factor = quantities.UNIT_FACTORS[kind][quantities.normalize_unit(unit)]
        ends = tuple(_round_digits(end / factor) for end in (low, high))
        if ends[0] == ends[1]:
            raise ValueError(
                f"{first}..{last}: both ends are the same value; "
                "give different ends, or a single value"
            )
        is_log = _is_log(*ends, spacing)
        return Range(self.key, low, high, kind, ends, unit, int(count or 0), is_log)

    def check_range(self, spread: Range, form: Form) -> None:
        """Raise ValueError if the values of the key cannot lie anywhere between the ends of a range, `spread`.

        `form` is what the option accepts. Without lists of values the ends of the range are a lower and an upper bound.
        """
        if not self.takes_float:
            raise ValueError(
                f"{spread.text}: a key that takes whole numbers takes no range; list the values, such as 1,2,3"
            )
        if spread.count:
            raise ValueError(
                f"{spread.text}:{spread.count}: the values lie anywhere between the ends; leave out "
                f":{spread.count}"
            )
        if not form.has_lists:
            if not spread.low < spread.high:
                raise ValueError(f"{spread.text}: the low bound must lie below the high bound")
            texts = spread.format_values((0, 1)) if spread.kind else (spread.low, spread.high)
            for value in texts:
                validate_value(self.key, value)


def _find_value_key(key: str, texts: Sequence[str]) -> Key:
    """Return the Key with a given dotted key, to which values can be assigned.

    `texts` are these values as written. ValueError, with suggestions, is raised if no scene has the key, or if it is a
    table without a value.
    """
    first = texts[0].partition("..")[0] if texts else ""
    known = require_key(key, read_set_value("", first))
    if known.accepts_value or (texts and all(text[:1] in ("{", "[", '"', "'") for text in texts)):
        return known
    suggested = list(dict.fromkeys([*list_required_keys(known.inner), *list_keys(known.inner)]))
    pieces = split_key(key)
    if known.is_array:
        # The last piece names the array, an item of it, or a key for which no item is named.
        if pieces[-1] in suggested:
            suggested = [pieces.pop()]
        if pieces[-1] == known.name:
            pieces.append("NAME")
    table = ".".join(pieces)
    raise ValueError(
        "is a table without a value of its own; choose a key of this table: "
        f"{', '.join(f'{table}.{inner_key}' for inner_key in suggested[:4])}"
    )


def _is_log(low: float, high: float, spacing: str | None) -> bool:
    """Return whether the values of a range are spaced logarithmically.

    `low` and `high` are the ends, and `spacing` is the word behind the range, such as "log", or None. Without it a range
    over a large ratio is logarithmic.
    """
    is_positive = low > 0 and high > 0
    if spacing is None and is_positive:
        # Ratio of the ends of a range of positive numbers; at and above it the range is logarithmic
        # by default.
        return _round_digits(max(low / high, high / low)) >= 10
    if spacing == "log" and not is_positive:
        raise ValueError("a logarithmic range needs both ends > 0")
    return spacing == "log"


def _flatten_table(table: TomlTable, table_key: str = "") -> list[tuple[str, TomlValue]]:
    """Return (dotted key, value) for a table whose keys may be dotted or quoted."""
    pairs = []
    for key, value in table.items():
        path = f"{table_key}.{key}" if table_key else key
        pairs += _flatten_table(value, path) if isinstance(value, dict) else [(path, value)]
    return pairs


def _split_at_commas(text: str) -> list[str]:
    """Split a text at commas outside of arrays, inline tables and quoted texts of TOML."""
    pieces = []
    opened = ""
    for part in text.split(","):
        opened += part
        # Sign that closes a list, an inline table or a text
        closing = {"[": "]", "{": "}", '"': '"', "'": "'"}.get(opened.strip()[:1])
        if closing is None or (closing in part and is_toml(opened)):
            pieces.append(opened.strip())
            opened = ""
        else:
            opened += ","
    return [*pieces, opened[:-1].strip()] if opened else pieces


def _format_with_unit(value: float, unit: str) -> str:
    """Format a value of a swept key with its unit."""
    # repr writes whole numbers below 1e16 without an exponent.
    return f"{repr(_round_digits(value)).removesuffix('.0')} {unit}".rstrip()


def _round_digits(value: float) -> float:
    """Return the number `value` rounded to 15 digits, so that a tenth of a range is 0.1 and not 0.1000000000000001."""
    return float(f"{value:.15g}")
