"""What the tables of a scene are made of: checked types with their units, the base model, and looks into a model."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache, partial
from typing import Annotated, Any, get_args
from unicodedata import category

from pydantic import BaseModel, ConfigDict, Field, Strict, WithJsonSchema, field_validator
from pydantic.types import AllowInfNan
from pydantic_core import core_schema

from .quantities import EXAMPLES, parse


@dataclass(frozen=True, slots=True)
class Check:
    """pydantic's BeforeValidator or AfterValidator of a function of the value alone; those look at its signature for
    every key of every table, which is a twentieth of a short command.

    made: the schema of pydantic_core of the function and of what it checks.
    """

    made: Callable
    function: Callable

    def __get_pydantic_core_schema__(self, source: Any, handler: Callable) -> Any:
        return self.made(self.function, handler(source))


Before = partial(Check, core_schema.no_info_before_validator_function)
After = partial(Check, core_schema.no_info_after_validator_function)


class Kind(str):
    """Marks a key as a quantity of this kind of the unit table."""


LARGEST = 1e50  # SI; its fourth power and what is multiplied with it stay within double precision
# of a rig
DIVIDED_BY = {
    "mass",
    "frequency",
    "acceleration",
    "stiffness",
    "damping",
    "cubic stiffness",
    "sweep rate",
}


def _within(value: float, least: float) -> float:
    if value and not least <= abs(value) <= LARGEST:
        allowed = (
            f"must be 0 or have a magnitude from {least:g} to {LARGEST:g}"
            if least
            else f"must not exceed {LARGEST:g} in magnitude"
        )
        raise ValueError(f"{value:g} in SI is outside the computable range; the value {allowed}")
    return value


def quantity(kind: str, **limits: float) -> Any:
    """The type of a key that holds a quantity of this kind, within limits as `pydantic.Field` names them."""
    schema = {"type": "string", "examples": [EXAMPLES[kind]]}
    return Annotated[
        float,
        Kind(kind),
        Before(partial(parse, kind=kind)),
        WithJsonSchema(schema),
        Field(**limits),
        After(partial(_within, least=1 / LARGEST if kind in DIVIDED_BY else 0.0)),
    ]


def number(**limits: float) -> Any:
    """The type of a key that holds a plain finite number within limits; neither a text nor a boolean."""
    return Annotated[
        float, Strict(), AllowInfNan(False), Field(**limits), After(partial(_within, least=0.0))
    ]


def whole(least: int, most: int) -> Any:
    """The type of a key that holds a whole number from `least` to `most`."""
    return Annotated[int, Strict(), Field(ge=least, le=most)]


def _printable(value: str) -> str:
    """A text without signs that no file of results can hold: control characters and halves of a pair."""
    wrong = next(
        (sign for sign in value if category(sign) in ("Cc", "Cs") and sign not in "\n\t"), None
    )
    if wrong is not None:
        raise ValueError(
            f"contains the character U+{ord(wrong):04X}, which cannot be displayed; remove this character"
        )
    return value


@dataclass(frozen=True, slots=True)
class Key:
    """The record of a key: what it means, in one sentence whose first word is a capital only in a name and which says a
    default that follows from other keys; what makes it necessary where neither its table alone nor a selector does."""

    means: str
    needed: str = ""


def key(kind: Any, means: str, needed: str = "") -> Any:
    """The type of a key with its record."""
    return Annotated[kind, Key(means, needed)]


# kinds that many keys share
Text = Annotated[str, Field(min_length=1), After(_printable)]
Title = Annotated[str, After(_printable)]
Number, Share, Positive, NotNegative = number(), number(ge=0, le=1), number(gt=0), number(ge=0)
Place, Length, Force = quantity("length"), quantity("length", gt=0), quantity("force", ge=0)
Mass, Seconds, Frequency = (
    quantity("mass", gt=0),
    quantity("time", gt=0),
    quantity("frequency", gt=0),
)
Speed, Acceleration = quantity("velocity", gt=0), quantity("acceleration", gt=0)
Kelvin, PerMetre = quantity("temperature", gt=0), quantity("participation")


ALL = object()
_OUTER: ContextVar = ContextVar("outer", default=None)  # the table whose checks are being made


@contextmanager
def whole_tables() -> Iterator[None]:
    """Within it the checks of a table that are made hold those of the tables inside it, as a JSON schema wants."""
    token = _OUTER.set(ALL)
    try:
        yield
    finally:
        _OUTER.reset(token)


class Table(BaseModel):
    """Base of all tables: unknown keys refused, frozen; a dict given as context collects the keys that are right.

    A table inside another is checked by itself, when one comes: with all that a scene may hold below them, the tables
    of a scene would be made four times over.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Callable) -> Any:
        if _OUTER.get() is None:
            token = _OUTER.set(cls)
            try:
                return handler(source)
            finally:
                _OUTER.reset(token)
        return (
            handler(source)
            if _OUTER.get() is ALL
            else core_schema.no_info_plain_validator_function(cls._as_one)
        )

    @classmethod
    def _as_one(cls, value: Any) -> Any:
        return value if isinstance(value, cls) else cls.model_validate(value)

    @field_validator("*", mode="after")
    @classmethod
    def _collect(cls, value: Any, info: Any) -> Any:
        if info.context is not None:
            info.context[info.field_name] = value
        return value


def choices(got: str, known: Iterable[str]) -> str:
    """``did you mean 'x'? use one of x, y`` for a wrong name among known ones."""
    names = list(known)
    near = get_close_matches(got, names, 1, 0.6) or [n for n in names if n.lower() == got.lower()]
    return (f"did you mean '{near[0]}'? " if near else "") + f"use one of {', '.join(names)}"


@cache
def keys(model: type[BaseModel]) -> dict[str, str]:
    """Key as written in a scene -> attribute of the model; they differ only where a key is a word of Python."""
    return {field.alias or name: name for name, field in model.model_fields.items()}


def parts(annotation: Any) -> Iterator[Any]:
    """Everything an annotation is built from: types, markers, values of a Literal."""
    for part in (*getattr(annotation, "__metadata__", ()), *get_args(annotation)):
        yield part
        yield from parts(part)


def record(model: type[BaseModel], written: str) -> Key | None:
    """The record of a key as written in a scene; None where it has none, as a table."""
    return next(
        (
            mark
            for mark in model.model_fields[keys(model)[written]].metadata
            if isinstance(mark, Key)
        ),
        None,
    )


def meaning(model: type[BaseModel], written: str) -> str:
    """What a key of a table means; KeyError where no record stands."""
    found = record(model, written)
    if found is None:
        raise KeyError(
            f"no record of {model.__name__}.{written}: write its type as key(type, meaning)"
        )
    return found.means


@cache
def kind_of(model: type[BaseModel], name: str) -> str | None:
    """Kind of quantity an attribute holds (each item, for an array); None for anything without a unit."""
    field = model.model_fields[name]
    marks = (*field.metadata, *parts(field.annotation))
    return next((str(mark) for mark in marks if isinstance(mark, Kind)), None)


@cache
def model_of(model: type[BaseModel], name: str) -> type[Table] | None:
    """The model of a key that holds a table or an array of tables; None for a plain value."""
    annotation = model.model_fields[name].annotation
    found = (part for part in (annotation, *parts(annotation)) if isinstance(part, type))
    return next((part for part in found if issubclass(part, Table)), None)
