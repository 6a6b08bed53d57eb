"""Numeric keys of a scene with a range each, as written `table.key=low..high`, by the unit rules of the scene."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from .keys import quantities
from .keys.types import kind_of, model_of, parts
from .reader import _set_value, held, known


@dataclass(frozen=True, slots=True)
class Range:
    """A key with low < high in SI; unit "" for a plain number."""

    key: str
    low: float
    high: float
    kind: str | None

    @property
    def unit(self) -> str:
        """The SI unit of the key."""
        return next(iter(quantities.KINDS[self.kind])) if self.kind else "1"

    def assigned(self, value: float) -> str:
        """`table.key=value` as --set reads it, to the last bit."""
        text = quantities.format_si(value, self.kind) if self.kind else repr(float(value))
        return f"{self.key}={text}"


def ranges(texts: Iterable[str]) -> tuple[list[Range], list[str]]:
    """(ranges, mistakes) of texts that each hold one or more `table.key=low..high`, separated by commas."""
    found, wrong = [], []
    for one in (part.strip() for text in texts for part in text.split(",")):
        try:
            found.append(_range(one))
        except ValueError as error:
            wrong.append(f"--free {error}")
    named = [one.key for one in found]
    wrong += [
        f"--free {key}: is given twice" for key in dict.fromkeys(named) if named.count(key) > 1
    ]
    if not found and not wrong:
        wrong.append(
            "--free: at least one table.key=low..high is needed, such as friction.static=0.1..0.6"
        )
    return found, wrong


def _range(text: str) -> Range:
    key, equals, bounds = (part.strip() for part in text.partition("="))
    low, dots, high = (part.strip() for part in bounds.partition(".."))
    if not equals or not dots or not low or not high:
        raise ValueError(
            f"{text}: table.key=low..high is needed, such as friction.bond_length=0.2 um..20 um"
        )
    try:
        model, name = _numeric(key)
        a, b = (_value(name, key, one) for one in (low, high))
        if not a < b:
            raise ValueError(f"the low bound {low} must lie below the high bound {high}")
    except ValueError as error:
        raise ValueError(f"{key}: {error}") from None
    return Range(key, a, b, kind_of(model, name))


def _numeric(key: str) -> tuple:
    """Model and attribute of a key that holds one number; ValueError with the nearest known key otherwise."""
    model, name = known(key)
    annotation = model.model_fields[name].annotation
    types = (annotation, *parts(annotation))
    if model_of(model, name) is not None or tuple in types or float not in types:
        raise ValueError(
            "is not a number that can vary; only quantities and plain numbers can be free"
        )
    return model, name


def _value(name: str, key: str, text: str) -> float:
    written = _set_value(key, text)
    if isinstance(written, int) and not isinstance(written, bool):
        written = float(written)
    value = held(key, written).get(name)
    if not isinstance(value, float) or not math.isfinite(value):
        raise ValueError(f"'{text}' is not a finite number")
    return value
