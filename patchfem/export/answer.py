"""The answer of a verb: what `run`, `sweep`, `backbone`, `compare`, `profile`, `fit` and `cost` return.

In: numbers and sentences of the module that answers a verb. Out: one record, from which `store` writes files, `page` a
page, `charts` pictures and `show` the lines on the screen.
"""

import math
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, NamedTuple

import numpy as np


class Definition(NamedTuple):
    """Definition of a quantity.

    - unit: SI unit, or "1" for a ratio
    - text: meaning
    - digits: number of digits that are displayed of a value without an error
    """

    unit: str
    text: str
    digits: int = 4


@dataclass(frozen=True, slots=True)
class Quantity:
    """Number with its unit, numerical error and interval.

    Attributes
    ----------
    value : float or None
        In SI units; None where it has no meaning, with the `reason`.
    unit : str
        SI unit; "1" for a ratio.
    error : float or None
        Half-width of the numerical error; None if it is unknown.
    low, high : float or None
        Ends of the interval that contains the true value; by default value minus and plus error.
    floor : float
        Smallest magnitude that is distinguished from 0.
    reason : str
        Reason for a missing value or interval.
    """

    value: float | None
    unit: str = "1"
    error: float | None = None
    low: float | None = None
    high: float | None = None
    floor: float = 0.0
    reason: str = ""

    def __post_init__(self):
        # numbers that are not finite have no JSON form
        for name in ("value", "error", "low", "high"):
            object.__setattr__(self, name, _convert_to_finite(getattr(self, name)))
        if self.low is None and self.high is None and None not in (self.value, self.error):
            object.__setattr__(self, "low", self.value - self.error)
            object.__setattr__(self, "high", self.value + self.error)

    def as_json(self) -> dict[str, float | str | None]:
        """Return the quantity as an object of a JSON file; without `reason` if there is none."""
        names = ("value", "unit", "error", "low", "high", "floor")
        content = {name: getattr(self, name) for name in names}
        return content | ({"reason": self.reason} if self.reason else {})


def _convert_to_finite(number: float | None) -> float | None:
    """Return a number as float, or None if it is missing, not finite, or too large for a float."""
    if number is None:
        return None
    try:
        return float(number) if math.isfinite(number) else None
    except OverflowError:
        return None


@dataclass(frozen=True, eq=False, slots=True)
class Variable:
    """Array with named dimensions.

    Attributes
    ----------
    dims : tuple of str
        A variable with the name of its only dimension is the coordinate of this dimension.
    values : ndarray
        Numbers in SI units, or strings.
    unit : str
        SI unit; "1" for a ratio, "" for strings and codes.
    text : str
        Description; `description` in the netCDF file.
    meanings : tuple of str
        Names of the codes 0, 1, ... for a variable that contains codes.
    """

    dims: tuple[str, ...]
    values: np.ndarray
    unit: str = "1"
    text: str = ""
    meanings: tuple[str, ...] = ()


# arrays of an answer by name, and its measures by name
Variables = dict[str, Variable]
Quantities = dict[str, Quantity]
# object of a JSON file: numbers, texts, lists and objects by key
JsonObject = dict[str, Any]


class Row(NamedTuple):
    """Row of a variable in the table of all verbs.

    - dims: its dimensions, separated by spaces. An array with fewer dimensions has the last ones of them.
    - unit: SI unit, "1" for a ratio, or "" for codes and words.
    - text: description; "" for the name in words.
    - places: where the result of a run has the variable, as dotted names of attributes, keys and indices. The first that
      exists is used.
    - meanings: names of the codes 0, 1, ... of a variable of codes.
    """

    dims: str
    unit: str
    text: str = ""
    places: str = ""
    meanings: tuple[str, ...] = ()


def make_column(name: str, values, row: Row) -> Variable:
    """Return an array as the variable of a row.

    Parameters
    ----------
    name : str
        Name of the variable, whose words describe it if the row has no description.
    values : array
        Numbers in SI units, of which a missing one may be None, texts, or codes, which become small integers.
    row : Row
        Dimensions, unit and description.
    """
    array = np.asarray(values)
    if row.meanings:
        array = array.astype(np.int8)
    elif array.dtype == object:
        array = array.astype(float)
    names = row.dims.split()
    own_dims = tuple(names[len(names) - array.ndim :])
    text = row.text or name.replace("_", " ")
    return Variable(own_dims, array, row.unit, text, tuple(row.meanings))


def make_columns(dims: str, columns: dict[str, tuple[Any, ...]]) -> Variables:
    """Return variables over the same dimensions.

    Parameters
    ----------
    dims : str
        Names separated by spaces; an array with fewer dimensions has the last ones.
    columns : dict
        Name -> (values, unit) or (values, unit, description). A number that is None becomes NaN; without a description it
        is the name in words.
    """
    variables = {}
    for name, (values, *row) in columns.items():
        variables[name] = make_column(name, values, Row(dims, *row))
    return variables


def encode_texts(dimension: str, texts: list[str], description: str = "") -> Variable:
    """Return texts over one dimension as codes with meanings.

    Parameters
    ----------
    dimension : str
        Name of the dimension.
    texts : list of str
        Text of each element; a code stands for each different one.
    description : str, optional
        What the codes are; `description` in the netCDF file.
    """
    meanings, codes = np.unique(np.asarray(texts, str), return_inverse=True)
    # the smallest signed type that has all codes
    codes = codes.astype(np.min_scalar_type(-max(meanings.size, 1)))
    return Variable((dimension,), codes, "", description, tuple(meanings.tolist()))


def to_plain(content):
    """Return content of a JSON file: arrays as lists, records as objects, and numbers that are not finite as None."""
    if isinstance(content, np.ndarray | np.generic):
        content = content.tolist()
    elif isinstance(content, Quantity):
        content = content.as_json()
    elif is_dataclass(content):
        content = {entry.name: getattr(content, entry.name) for entry in fields(content)}
    elif hasattr(content, "_asdict"):
        content = content._asdict()
    if isinstance(content, dict):
        return {key: to_plain(entry) for key, entry in content.items()}
    if isinstance(content, list | tuple):
        return [to_plain(entry) for entry in content]
    return _convert_to_finite(content) if isinstance(content, float) else content


@dataclass(frozen=True, slots=True)
class Remarks:
    """Sentences beside the verdict of an answer.

    - warnings: about numerical trust
    - notes: about what the model leaves out
    """

    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False, slots=True)
class Answer:
    """Answer of a verb.

    Attributes
    ----------
    kind : str
        "patch", "bench", "rig" or "linear" for a run; "sweep", "backbone", "compare", "profile", "fit", "cost".
    title : str
        Heading of the page and first line on the screen.
    verdict : tuple of str
        At most four sentences; the first one is the headline, with at most 30 words, of a sweep 30 for each main measure.
    quantities : dict of str to Quantity
        Measures by name.
    data : dict of str to Variable
        Arrays by name. NAME_error is the error band of NAME, NAME_low and NAME_high are the ends of its interval.
    remarks : Remarks
        Warnings and notes for the page and the screen.
    details : dict
        JSON keys of the verb: further keys of summary.json for a run; the content of NAME.json for another verb. Records and
        arrays become objects and lists, as in `to_plain`.
    origin : dict
        Where the answer comes from: `patchfem` (version), `scene` (text as written), `resolved` (scene with all defaults),
        `command` (how to repeat it) and `versions` (package -> version), as far as they exist. `source`, the
        `model.Source` of the scene, is not stored.
    """

    kind: str
    title: str
    verdict: tuple[str, ...]
    quantities: Quantities = field(default_factory=dict)
    data: Variables = field(default_factory=dict)
    remarks: Remarks = Remarks()
    details: JsonObject = field(default_factory=dict)
    origin: JsonObject = field(default_factory=dict)

    def __post_init__(self):
        object.__setattr__(self, "details", to_plain(self.details))

    @property
    def is_run(self) -> bool:
        """Whether the answer is that of a single run."""
        return self.kind in RUN_KINDS


Answers = dict[str, Answer]  # by their name in a legend
RUN_KINDS = ("patch", "bench", "rig", "linear")
