"""Building blocks of the tables: types of keys, the base class, and queries about tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextvars import ContextVar
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache, partial
from types import UnionType
from typing import Annotated, Any, ClassVar, Literal, TypeAlias, get_args, get_origin
from unicodedata import category

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    Strict,
    ValidationInfo,
    WithJsonSchema,
    field_validator,
)
from pydantic.types import AllowInfNan
from pydantic_core import CoreSchema, core_schema

from .quantities import EXAMPLE_QUANTITIES, find_si_unit, parse_quantity, read_percentage
from .values import TomlValue

# Type of a key: a class, a union or a Literal, with its marks as Annotated.
KeyType: TypeAlias = type | UnionType
# Value of a key that was read, in SI; None where the scene has none.
KeyValue: TypeAlias = "str | int | float | bool | Table | tuple[KeyValue, ...] | None"

# Largest magnitude of a value in SI; its fourth power, and products with
# that, stay within double precision.
MAX_MAGNITUDE = 1e50
# Kinds of quantities that are divisors in the equations of a rig; a nonzero magnitude must be at
# least 1/MAX_MAGNITUDE, which keeps the quotients finite.
DIVISOR_KINDS = {
    "mass",
    "frequency",
    "acceleration",
    "stiffness",
    "damping",
    "cubic stiffness",
    "sweep rate",
}
# Word of a JSON schema that names an inner table; `schema.make_schema` replaces it by a reference.
INNER_TABLE_WORD = "$table"
# Smallest similarity ratio (difflib) for which an unknown name is taken for a misspelling.
MIN_NAME_SIMILARITY = 0.6


@dataclass(frozen=True, slots=True)
class Check:
    """Validator that sees the value alone, used in place of pydantic's BeforeValidator or AfterValidator.

    Those inspect the signature of the function for every key of every table, which takes a twentieth of a short
    command.

    - make_schema: function of pydantic_core that makes a schema of `function` and of the schema that it
      wraps.
    - function: function of the value that returns the checked value or raises ValueError.
    """

    make_schema: Callable[..., CoreSchema]
    function: Callable[[Any], Any]

    def __get_pydantic_core_schema__(
        self, source: KeyType, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Return the schema of the annotated type `source`, to which this check is added.

        `handler` makes the schema of the type itself. pydantic calls this method.
        """
        return self.make_schema(self.function, handler(source))


CheckBefore = partial(Check, core_schema.no_info_before_validator_function)
CheckAfter = partial(Check, core_schema.no_info_after_validator_function)


class Kind(str):
    """Annotation of a key whose value is a quantity of this kind (see `quantities.UNIT_FACTORS`)."""


# Annotation of a key that names a file.
FILE_MARK = object()


def require_magnitude(
    value: float, *, smallest: float = 0.0, accepts_zero: bool = True, unit: str = ""
) -> float:
    """Return a value if its magnitude is one with which the program can compute.

    Parameters
    ----------
    value : float
        Value in SI.
    smallest : float
        Smallest magnitude other than 0.
    accepts_zero : bool
        Whether the message names 0 as a value that is accepted.
    unit : str
        Unit in SI, for the message; "" for a plain number.

    Raises
    ------
    ValueError
        If the magnitude is above MAX_MAGNITUDE or in (0, `smallest`).
    """
    if value and not smallest <= abs(value) <= MAX_MAGNITUDE:
        needed = f"a magnitude of at most {MAX_MAGNITUDE:g} {unit}".strip()
        if smallest:
            zero = "0 or " if accepts_zero else ""
            needed = f"{zero}a magnitude from {smallest:g} to {MAX_MAGNITUDE:g} {unit}"
        shown = f"{value:g} {unit}".strip()
        raise ValueError(f"{shown} is outside the computable range; {needed} is needed")
    return value


def quantity(kind: str, **limits: float) -> KeyType:
    """Return the type of a key that holds a quantity.

    Parameters
    ----------
    kind : str
        Kind of `quantities.UNIT_FACTORS`.
    **limits : float
        Limits in SI as `pydantic.Field` names them: gt, ge, lt, le.
    """
    schema = {"type": "string", "examples": [EXAMPLE_QUANTITIES[kind]]}
    smallest = 1 / MAX_MAGNITUDE if kind in DIVISOR_KINDS else 0.0
    check = partial(
        require_magnitude,
        smallest=smallest,
        accepts_zero="gt" not in limits,
        unit=find_si_unit(kind),
    )
    return Annotated[
        float,
        Kind(kind),
        CheckBefore(partial(parse_quantity, kind=kind)),
        WithJsonSchema(schema),
        Field(**limits),
        CheckAfter(check),
    ]


def number(**limits: float) -> KeyType:
    """Return the type of a key that holds a finite number, also in percent; limits as in `quantity`."""
    return Annotated[
        float,
        Strict(),
        AllowInfNan(False),
        Field(**limits),
        CheckAfter(require_magnitude),
        CheckBefore(read_percentage),
    ]


def whole_number(low: int, high: int) -> KeyType:
    """Return the type of a key that holds a whole number from `low` to `high`."""
    return Annotated[int, Strict(), Field(ge=low, le=high)]


def array(kind: KeyType, least: int = 1, most: int | None = None) -> KeyType:
    """Return the type of a key that holds an array.

    Parameters
    ----------
    kind
        Type of a value, or class of a table.
    least, most : int
        Smallest and largest number of items; None for any.
    """
    return Annotated[tuple[kind, ...], Field(min_length=least or None, max_length=most)]


def _require_printable(value: str) -> str:
    """Require that results files can hold the characters of a text, and return it.

    ValueError is raised for other characters.
    """
    for sign in value:
        if category(sign) in ("Cc", "Cs") and sign not in "\n\t":
            raise ValueError(
                f"contains the character U+{ord(sign):04X}, which cannot be displayed; remove this character"
            )
    return value


def _require_one_line(value: str) -> str:
    """Return a text without line breaks; ValueError is raised for another one."""
    if "\n" in value:
        raise ValueError("has several lines; write one line of text")
    return value


@dataclass(frozen=True, slots=True)
class KeyRecord:
    """Documentation of a key.

    - meaning: meaning of the key in one sentence without a capital at its start. It states a default that
      follows from other keys.
    - required: condition under which the key is required, such as "with `frequency`"; "" if its type or a
      selector says so.
    """

    meaning: str
    required: str = ""


def key(kind: KeyType, meaning: str, required: str = "") -> KeyType:
    """Return the type of a key with its documentation.

    Parameters
    ----------
    kind
        Type of the value: of `quantity`, `number` or `whole_number`, one of the names below, or a Literal.
    meaning, required : str
        Meaning of the key, and the condition under which it is required.
    """
    return Annotated[kind, KeyRecord(meaning, required)]


def optional(kind: KeyType, meaning: str, required: str = "") -> KeyType:
    """Return the type of a key that may be left out, with its documentation; its value is None then.

    Parameters
    ----------
    kind
        Type of the value if the key is given.
    meaning, required : str
        Meaning of the key, and the condition under which it is required.
    """
    return Annotated[kind | None, KeyRecord(meaning, required), Field(default=None)]


# Types that many keys share.
Text = Annotated[str, Field(min_length=1), CheckAfter(_require_printable)]
FileName = Annotated[Text, FILE_MARK]
Title = Annotated[str, CheckAfter(_require_printable), CheckAfter(_require_one_line)]
Number = number()
Fraction = number(ge=0, le=1)
Positive = number(gt=0)
NonNegative = number(ge=0)
Position = quantity("length")
Length = quantity("length", gt=0)
Force = quantity("force", ge=0)
Mass = quantity("mass", gt=0)
Duration = quantity("time", gt=0)
Frequency = quantity("frequency", gt=0)
Speed = quantity("velocity", gt=0)
Acceleration = quantity("acceleration", gt=0)
AbsoluteTemperature = quantity("temperature", gt=0)
PerMetre = quantity("participation")


# Table whose validator is under construction.
_OUTER_TABLE: ContextVar = ContextVar("outer", default=None)


class Table(BaseModel):
    """Base class of all tables: frozen, and without keys that it does not define.

    A dict that is given to a validation as its context collects the values that are right, by attribute. The validator
    of a table does not contain those of the tables inside it: each is made when such a table is first read. Otherwise
    the validators of all tables would be made four times over.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)
    # Whether a name may stand in place of the table.
    has_name: ClassVar[bool] = False

    @classmethod
    def __get_pydantic_core_schema__(
        cls, source: KeyType, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Return the schema of a table, in which the tables inside it are validated by their own class.

        pydantic calls this method with the class (`source`) and with `handler`, which makes its usual schema.
        """
        if _OUTER_TABLE.get() is not None:
            return core_schema.no_info_plain_validator_function(cls._validate_inner)
        token = _OUTER_TABLE.set(cls)
        try:
            return handler(source)
        finally:
            _OUTER_TABLE.reset(token)

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Return the JSON schema of a table.

        Inside another table it is only the name of its class. pydantic calls this method with the inner `schema` and
        with `handler`, which converts it.
        """
        is_inner = schema["type"] == "function-plain"
        return {INNER_TABLE_WORD: cls.__name__} if is_inner else handler(schema)

    @classmethod
    def _validate_inner(cls, value: TomlValue | Table) -> Table:
        """Return a table from plain values.

        A `value` that is such a table already is returned unchanged.
        """
        return value if isinstance(value, cls) else cls.model_validate(value)

    @field_validator("*", mode="after")
    @classmethod
    def _collect_value(cls, value: KeyValue, info: ValidationInfo) -> KeyValue:
        """Put each valid value into the context of the validation, if there is one, and return it unchanged.

        So the valid `value` of a key, whose name `info` has, is known even if another key is wrong.
        """
        if info.context is not None:
            info.context[info.field_name] = value
        return value


def build_table(model: type[Table], values: dict[str, KeyValue]) -> Table:
    """Build a table from values by attribute; the values are not validated.

    It does what `model_construct` does in a fraction of the time: the defaults are shared, since they are frozen.
    """
    table = model.__new__(model)
    for name, value in (
        ("__dict__", _find_default_values(model) | values),
        ("__pydantic_fields_set__", set(values)),
        ("__pydantic_extra__", None),
        ("__pydantic_private__", None),
    ):
        object.__setattr__(table, name, value)
    return table


@cache
def _find_default_values(model: type[Table]) -> dict[str, KeyValue]:
    """Return the default of each optional key of a table `model`, by attribute."""
    optional = {name: key for name, key in model.model_fields.items() if not key.is_required()}
    return {name: key.get_default(call_default_factory=True) for name, key in optional.items()}


def advise_on_name(written_name: str, names: Iterable[str]) -> str:
    """Return a hint for a wrong name, `written_name`: ``did you mean 'x'? use one of x, y``."""
    known = list(names)
    near = get_close_matches(written_name, known, 1, MIN_NAME_SIMILARITY)
    near = near or [name for name in known if name.lower() == written_name.lower()]
    question = f"did you mean '{near[0]}'? " if near else ""
    return f"{question}use one of {', '.join(known)}"


def iterate_annotation_parts(annotation: KeyType) -> Iterator[Any]:
    """Yield all parts of an annotation: types, metadata such as Kind, values of a Literal."""
    for part in (*getattr(annotation, "__metadata__", ()), *get_args(annotation)):
        yield part
        yield from iterate_annotation_parts(part)


class Key:
    """A key of a table, with all that its type says about its value.

    - table: model of the table.
    - name, attribute: the key in a scene and in Python; they differ for reserved words of Python.
    - field: field of the pydantic model.
    - types: annotation of the attribute, and all its parts.
    - inner: model of the table, or of the tables, that the key holds; None for a value.
    - is_array: whether the key holds an array, of values or of tables.
    - allowed: the words of a key that accepts one of a few.
    - accepts_value: whether the key accepts a value, as a material or a coating does in place of its table.
    - kind: kind of quantity of the value or of its items; None without unit.
    - names_file: whether a text of this key is the name of a file.
    - record: documentation; that of a table is empty.
    """

    def __init__(self, table: type[Table], attribute: str) -> None:
        field = table.model_fields[attribute]
        self.table = table
        self.attribute = attribute
        self.name: str = field.alias or attribute
        self.field = field
        self.is_array = get_origin(field.annotation) is tuple

        # A type such as a quantity or None has its marks inside the annotation.
        self.types = (field.annotation, *iterate_annotation_parts(field.annotation))
        marks = (*field.metadata, *self.types)
        models = [part for part in self.types if isinstance(part, type) and issubclass(part, Table)]
        literals = [part for part in self.types if get_origin(part) is Literal]
        self.inner: type[Table] | None = next(iter(models), None)
        self.allowed: tuple[str, ...] = get_args(literals[0]) if literals else ()
        self.accepts_value = self.inner is None or self.inner.has_name or bool(literals)
        self.kind = next((str(mark) for mark in marks if isinstance(mark, Kind)), None)
        self.names_file = FILE_MARK in marks
        records = [mark for mark in field.metadata if isinstance(mark, KeyRecord)]
        self.record = next(iter(records), KeyRecord(""))


@cache
def list_keys(model: type[Table]) -> dict[str, Key]:
    """Return the keys of a table, whose class is `model`, by their names in a scene."""
    keys = [Key(model, attribute) for attribute in model.model_fields]
    return {key.name: key for key in keys}


@cache
def list_required_keys(model: type[Table]) -> list[str]:
    """Return the names of the keys that every table of this model must have."""
    return [name for name, key in list_keys(model).items() if key.field.is_required()]


@cache
def list_inner_tables(model: type[Table]) -> dict[str, type[Table]]:
    """Return a dict that maps the dotted key of every table inside a table, at any depth, to its model."""
    tables = {}
    for name, key in list_keys(model).items():
        if key.inner is not None:
            tables[name] = key.inner
            inside = list_inner_tables(key.inner)
            tables |= {f"{name}.{deeper}": last for deeper, last in inside.items()}
    return tables
