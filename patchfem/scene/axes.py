"""Values that a key takes from case to case: lists and ranges, as `--over` and the table [sweep] write them."""

from __future__ import annotations

import re
from array import array
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, get_origin

from ..core import PatchfemError
from .keys import quantities
from .keys.types import keys, kind_of, model_of, parts
from .reader import _set_value, held, is_value, known, owner_of

LIMITS = ("greater_than", "greater_than_equal", "less_than", "less_than_equal")
LENGTH = "drive.displacement"  # a key that holds one
MOST = 10_000_000  # values of one range
_RANGE = re.compile(r"(.*?)\s*\.\.\s*(.*?)\s*(?::\s*([0-9]*)\s*(log|lin)?)?")
_UNIT = re.compile(r"[-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?\s*(.*)")
_ABOUT = re.compile(
    r"([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(.*?)\s*(?:\+/?-|±)\s*([0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(.*)"
)
# a finite number of TOML
_PLAIN = re.compile(r"[-+]?(0|[1-9][0-9]{0,14})(\.[0-9]{1,20})?([eE][-+]?[0-9]{1,2})?")
_TEN = 10  # ratio of the ends from which a range of positive numbers is logarithmic unless it says otherwise
_ENDS = {"]": "[", "}": "{"}


class Written(Sequence):
    """Numbers as a scene would hold them, each written when it is asked for: texts of a million cases would fill the
    memory. numbers: float64 in this unit, "" of plain numbers."""

    __slots__ = "numbers", "unit"

    def __init__(self, numbers: array, unit: str):
        self.numbers, self.unit = numbers, unit

    def __len__(self) -> int:
        return len(self.numbers)

    def __getitem__(self, place: int | slice) -> str | list[str]:
        if isinstance(place, slice):
            return [_written(number, self.unit) for number in self.numbers[place]]
        return _written(self.numbers[place], self.unit)


@dataclass(frozen=True, slots=True)
class Axis:
    """A key with its values: texts as a scene would hold them; values: floats in SI, or the texts where these are no
    numbers; unit: that of the values in SI, "1" for plain numbers, "" for texts."""

    key: str
    texts: Sequence[str]
    values: Sequence[float | str]
    unit: str

    @property
    def name(self) -> str:
        """The key as a name of a variable: dots as underscores."""
        return re.sub(r"\W", "_", self.key)


@dataclass(frozen=True, slots=True)
class Span:
    """A key with the two ends between which values are drawn, both in the unit that is written behind them ("" of a
    plain number): evenly, or evenly in the logarithm."""

    key: str
    low: float
    high: float
    unit: str
    log: bool

    def axis(self, shares: Iterable[float]) -> Axis:
        """The values at shares of the way from low to high, each in [0, 1]."""
        texts = Written(
            array("d", (_between(self.low, self.high, share, self.log) for share in shares)),
            self.unit,
        )
        read = _reading(self.key)
        return Axis(self.key, texts, array("d", map(read, texts)), _unit_of(self.key))


def read(texts: Iterable[str], sampled: bool = False) -> tuple[list[Axis | Span], list[str]]:
    """(axes, mistakes) of texts `table.key=v1,v2,...`, where a value may be a range `low..high:n`.

    sampled: a range stands without its number of values and becomes a Span.
    """
    found, wrong = [], []
    for text in texts:
        key, equals, values = (part.strip() for part in text.partition("="))
        if not equals or not key:
            wrong.append(
                f"--over {text}: write table.key=v1,v2,... or table.key=low..high:n, such as "
                "contact.tilt.angle=1e-6 rad..1e-2 rad:9"
            )
            continue
        _add(found, wrong, key, values, sampled)
    named = [one.key for one in found]
    return found, wrong + [
        f"{key}: is given twice" for key in dict.fromkeys(named) if named.count(key) > 1
    ]


def lengths(text: str, name: str) -> list[float]:
    """Rising values [m] of "a..b:n" or a list, all above 0; PatchfemError names what is asked for."""
    try:
        values = sorted(_axis(LENGTH, text, False).values)
    except ValueError as error:
        raise PatchfemError(
            "; ".join(f"{name}: {line}" for line in str(error).split("\n"))
        ) from None
    if values[0] <= 0:
        raise PatchfemError(
            f"{name}: {values[0]:g} m; lengths above 0 are needed, such as 1 um..1 mm:9"
        )
    return values


def _add(found: list, wrong: list, key: str, values: str, sampled: bool) -> None:
    try:
        found.append(_axis(key, values, sampled))
    except ValueError as error:
        wrong += [f"{key}: {line}" for line in str(error).split("\n")]


def _axis(key: str, text: str, sampled: bool) -> Axis | Span:
    known(key)
    out, wrong = [], []
    pieces = _split(text)
    for piece in pieces:
        try:
            if not piece:
                raise ValueError("there is no value between two commas")
            if _is_number(key) and (ends := _around(piece)):
                if not sampled or len(pieces) > 1:
                    raise ValueError(
                        f"{piece}: write this range as {ends}:9 for 9 values in it, or as {ends} with "
                        "--random"
                    )
                piece = f"{ends}:lin"
            ends = _RANGE.fullmatch(piece) if ".." in piece and _is_number(key) else None
            if ends is None:
                out.append(piece)
            elif sampled and len(pieces) == 1:
                return _span(key, *_with_unit(*ends.groups()))
            else:
                out += _steps(key, *_with_unit(*ends.groups()))
        except ValueError as error:
            wrong.append(str(error))
    if wrong:
        raise ValueError("\n".join(wrong))
    return values_of(key, out)


def drawn_from(texts: Iterable[str]) -> list[str]:
    """Sentences on texts `table.key=value +- width` of drawn values: from which range these are drawn."""
    out = []
    for text in texts:
        key, _, values = (part.strip() for part in text.partition("="))
        try:
            ends = _around(values)
        except ValueError:  # `read` says so
            continue
        out += [f"{key}: {values} is drawn evenly from {ends}"] * bool(ends)
    return out


def _around(text: str) -> str:
    """The range `low..high` of a value with its width: of 0.3 +- 15 % 0.255..0.345, of 5 mm +- 1 mm 4.0 mm..6.0 mm; ""
    of another text, ValueError where the width has another unit."""
    found = _ABOUT.fullmatch(text)
    if found is None:
        return ""
    middle, unit, width, of = found.groups()
    try:
        middle, width = Fraction(middle), Fraction(width)
    except ValueError:  # 1.2.3
        return ""
    if of not in ("%", "", unit):
        raise ValueError(
            f"{text}: write the width in % or in the unit of the value{f' ({unit})' * bool(unit)}, or the "
            "range as low..high"
        )
    half = abs(middle) * width / 100 if of == "%" else width
    return "..".join(_written(float(end), unit) for end in (middle - half, middle + half))


def _with_unit(low: str, high: str, *rest) -> tuple:
    """The parts of a range; a bare number before the dots has the unit of the number behind them, as in 1..9 mm."""
    unit = _UNIT.fullmatch(high)
    bare = (
        unit is not None
        and unit[1]
        and _UNIT.fullmatch(low) is not None
        and not _UNIT.fullmatch(low)[1]
    )
    return (f"{low} {unit[1]}" if bare else low, high, *rest)


def values_of(key: str, texts: Iterable[str], distinct: bool = True) -> Axis:
    """The axis of these values; ValueError, a line per mistake, for values that the key cannot hold.

    A value beyond the limits of its key is no mistake here: its case says so. distinct: no value may stand twice.
    """
    known(key)
    texts, values, wrong = tuple(texts), [], []
    _no_table(key, texts)
    value = _reading(key)
    for text in texts:
        try:
            values.append(value(text))
        except ValueError as error:
            wrong.append(str(error))
    if not wrong and distinct and len(set(values)) < len(values):
        twice = next(
            text for place, text in enumerate(texts) if values.index(values[place]) < place
        )
        wrong.append(f"{twice} is given twice")
    if wrong:
        raise ValueError("\n".join(wrong))
    if not all(isinstance(value, float) for value in values):
        return Axis(key, texts, texts, "")
    return Axis(key, texts, tuple(values), _unit_of(key))


def _unit_of(key: str) -> str:
    kind = kind_of(*owner_of(key))
    return next(iter(quantities.KINDS[kind])) if kind else "1"


def of_table(table: Any) -> tuple[list[Axis | Span], list[tuple[str, str]]]:
    """(axes, mistakes as (key, message)) of the table [sweep] as it was written: "table.key" = "v1,v2,..."."""
    if not isinstance(table, dict) or not table:
        return [], [
            (
                "sweep",
                "keys with their values are needed, such as "
                '"contact.tilt.angle" = "1e-6 rad..1e-2 rad:9"',
            )
        ]
    found, wrong = [], []
    for key, values in _flat(table):
        if isinstance(values, list):
            values = ",".join(map(str, values))
        if not isinstance(values, str):
            wrong.append((f"sweep.{key}", 'the values must be a string, such as "0.1..0.6:6"'))
            continue
        mistakes: list[str] = []
        _add(found, mistakes, key, values, False)
        wrong += [(f"sweep.{key}", text.removeprefix(f"{key}: ")) for text in mistakes]
    return found, wrong


def _flat(table: dict, at: str = "") -> list[tuple[str, Any]]:
    """(dotted key, value) of a table whose keys may be dotted, in quotes or not."""
    out = []
    for key, value in table.items():
        path = f"{at}.{key}" if at else key
        out += _flat(value, path) if isinstance(value, dict) else [(path, value)]
    return out


def _no_table(key: str, texts: tuple) -> None:
    """ValueError, with keys that it holds, where a table is to take plain values."""
    model, name = owner_of(key)
    inner = model_of(model, name)
    if (
        inner is None
        or is_value(model, name)
        or all(text.startswith(("{", "[", '"', "'")) for text in texts)
    ):
        return
    items = ".NAME" if get_origin(model.model_fields[name].annotation) is tuple else ""
    first = sorted(
        keys(inner), key=lambda one: not inner.model_fields[keys(inner)[one]].is_required()
    )[:4]
    raise ValueError(
        "is a table without a value of its own; choose a key of this table: "
        f"{', '.join(f'{key}{items}.{one}' for one in first)}"
    )


def _types(key: str) -> tuple:
    model, name = owner_of(key)
    annotation = model.model_fields[name].annotation
    return (annotation, *parts(annotation))


def _is_number(key: str) -> bool:
    """Whether a key holds one number, with or without a unit."""
    model, name = owner_of(key)
    types = _types(key)
    return (
        model_of(model, name) is None
        and tuple not in map(get_origin, types)
        and (float in types or int in types)
    )


def _split(text: str) -> list[str]:
    """The text cut at its commas, but for those inside brackets and quotes.

    A quote opens a value or stands in brackets; elsewhere it is a sign like others.
    """
    pieces, open_, quote, begin, escaped = [], [], "", 0, False
    for place, sign in enumerate(text):
        if quote:
            quote = "" if sign == quote and not escaped else quote
            escaped = sign == "\\" and quote == '"' and not escaped
        elif sign in "\"'" and (open_ or not text[begin:place].strip()):
            quote = sign
        elif sign in "[{":
            open_.append(sign)
        elif sign in _ENDS and open_ and open_[-1] == _ENDS[sign]:
            open_.pop()
        elif sign == "," and not open_:
            pieces.append(text[begin:place].strip())
            begin = place + 1
    return [*pieces, text[begin:].strip()]


def _reading(key: str) -> Callable[[str], float | str]:
    """What reads a text that a key holds: its SI value, or the text where it is no number; ValueError where the key
    cannot hold it."""
    model, name = owner_of(key)
    number, types = _is_number(key), _types(key)
    kind, inner = kind_of(model, name) if number else None, model_of(model, name)
    if kind is not None:
        return lambda text: quantities.parse(text, kind)

    def read(text: str) -> float | str:
        # of ten thousand drawn values each
        if number and float in types and _PLAIN.fullmatch(text):
            return float(text)
        given = _set_value(key, text)
        if inner is not None and isinstance(given, dict):
            return text
        is_number = isinstance(given, int | float) and not isinstance(given, bool)
        held(key, float(given) if is_number and float in types else given, LIMITS)
        return float(given) if is_number else text

    return read


def _ends(key: str, low: str, high: str) -> tuple:
    """(low, high, unit) of a range, both as Fractions in the unit of the first."""
    model, name = owner_of(key)
    kind = kind_of(model, name)
    if kind is None:
        if any(re.fullmatch(quantities.NUMBER, end) is None for end in (low, high)):
            raise ValueError(f"{low}..{high}: both ends of this range must be plain numbers")
        return Fraction(low), Fraction(high), ""
    for end in (low, high):
        quantities.parse(end, kind)
    (first, unit), (last, other) = (
        quantities._QUANTITY.fullmatch(end).groups() for end in (low, high)
    )
    factors = [
        Fraction(repr(quantities.KINDS[kind][quantities._plain(one)])) for one in (unit, other)
    ]
    return Fraction(first), Fraction(last) * factors[1] / factors[0], unit


def _is_log(low: Fraction, high: Fraction, how: str | None) -> bool:
    positive = low > 0 and high > 0
    if how == "log" and not positive:
        raise ValueError("a logarithmic range needs both ends > 0")
    return how == "log" or (how is None and positive and max(low / high, high / low) >= _TEN)


def _steps(key: str, low: str, high: str, count: str | None, how: str | None) -> list[str]:
    """The values of a range as texts in the unit of its first end."""
    first, last, unit = _ends(key, low, high)
    number = int(count) if count else 0
    if not 2 <= number <= MOST:
        raise ValueError(
            f"{low}..{high}: give the number of values after a colon, from 2 to {MOST}, such as :9"
        )
    if first == last:
        raise ValueError(f"{low}..{high}: both ends are the same value")
    log = _is_log(first, last, how)
    return [
        _written(_between(first, last, Fraction(place, number - 1), log), unit)
        for place in range(number)
    ]


def _span(key: str, low: str, high: str, count: str | None, how: str | None) -> Span:
    first, last, unit = _ends(key, low, high)
    if float not in _types(key):
        raise ValueError(
            f"{low}..{high}: a key that takes whole numbers takes no range; list the values, such as "
            "1,2,3"
        )
    if count:
        raise ValueError(
            f"{low}..{high}:{count}: random values are drawn between the ends; leave out :{count}"
        )
    if first == last:
        raise ValueError(f"{low}..{high}: both ends are the same value")
    return Span(key, float(first), float(last), unit, _is_log(first, last, how))


def _between(
    low: Fraction | float, high: Fraction | float, share: Fraction | float, log: bool
) -> float:
    """The value at a share of the way; fractions keep an even range exact until it is rounded once."""
    if not log:
        return float(low + (high - low) * share)
    ends = {0: low, 1: high}
    return (
        float(ends[share])
        if share in ends
        else float(low) * (float(high) / float(low)) ** float(share)
    )


def _written(value: float, unit: str) -> str:
    """A value with its unit; 15 digits, so that a tenth of a range is 0.1 and not 0.1 with a tail."""
    number = float(f"{value:.15g}")
    text = (
        repr(int(number))
        if number.is_integer() and abs(number) < 1e15 and unit == ""
        else repr(number)
    )
    return f"{text.removesuffix('.0') if unit else text} {unit}".rstrip()
