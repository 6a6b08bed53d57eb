"""Definitions of all quantities, and how their numbers are displayed.

The measures of runs are defined in `measures.rows` and `runs.results.patch_rows`; rows.toml defines those of the other
verbs. KEY_QUANTITY_NAMES lists the quantities that come first: in the tiles of a page, on the screen and in the first
columns of a table.
"""

from .. import measures as run_measures
from ..core import MeasureDefinition, remove_interface_number
from ..formatting import (
    MAX_SIGNIFICANT_DIGITS,
    UNIT_LADDERS,
    choose_unit,
    format_number,
    format_with_error,
    round_to_error,
)
from ..runs.results import patch_rows
from . import surface_definitions
from .answer import Definition, Quantities, Quantity
from .rows import QUANTITIES

# Value relative to the largest one of a column below which it is round-off, and shown as 0
VALUE_ROUND_OFF = 1e-12
MAX_KEY_QUANTITIES = 10  # largest number of key quantities on a page and on the screen
# display units of wear coefficients and of slopes
DISPLAY_UNIT_LADDERS = UNIT_LADDERS | {
    "m2 N-1": (("m^2/N", 1.0),),
    "m m-1": (("um/mm", 1e3),),  # slopes of roughness profiles
}

KEY_QUANTITY_NAMES = tuple(
    """
    frequency_at_smallest_amplitude frequency_at_largest_amplitude damping_at_smallest_amplitude
    damping_at_largest_amplitude force_at_smallest_amplitude force_at_largest_amplitude largest_damping
    amplitude_of_largest_damping compared_amplitude frequency_change damping_change force_change free_frequency
    stuck_frequency cpu_time largest_error worn_depth_mean worn_depth_max worn_top_height touching_fraction worn_area
    worn_volume track_width track_depth wear_coefficient amplitude_ratio slope_ratio Ra Rq Rz RSm Rsk Rk Pa Pq Pt Sa Sq
    Sz Ssk Sdr Sal
    relative_displacement_amplitude relative_displacement_rms absolute_acceleration_peak absolute_acceleration_rms
    response_frequency response_damping slip_amplitude equivalent_stiffness equivalent_damping loop_area
    friction_power friction_force_peak friction_ratio_peak flutter_amplitude onset_level
    contact_fraction pressure_peak contact_half_width normal_load approach normal_stiffness tangential_stiffness
    """.split()
)


# kinds of answers whose quantities are defined in `surface_definitions`
SURFACE_ANSWER_KINDS = ("compare", "pairs", "profile")
# Ratio of the ends of an interval above which one unit does not suit both
MAX_END_RATIO = 10.0
FIT_KEY_TEXT = (
    "value of this key of the scene that fits the measurement best, with its 95 % interval"
)


def find_definition(name: str, kind: str = "") -> Definition | None:
    """Return the definition of a quantity, whose name may end in the number of an interface.

    `kind` is that of the answer, because a comparison of surfaces gives names of runs a meaning of their own. The result
    is None for an unknown name.
    """
    if "." in name:
        return Definition("1", FIT_KEY_TEXT)
    if kind in SURFACE_ANSWER_KINDS:
        return surface_definitions.find_surface_definition(
            name
        ) or surface_definitions.find_surface_definition(remove_interface_number(name))
    # quantities of a sweep: limits of its key, and extremes of measures and their places
    measure = name.removeprefix("largest_").removeprefix("smallest_")
    base_name = remove_interface_number(measure)
    if name.startswith(("limit_", "place_of_")):
        base_name = name.partition("_")[0]
    found = _find_row(name) or _find_row(measure) or _find_row(base_name)
    return found and Definition(found.unit, found.text)


def _find_row(name: str) -> Definition | MeasureDefinition | None:
    """Return the row of the first table that has a name; the measures of a motion are read last, for a motion alone."""
    return (
        QUANTITIES.get(name)
        or patch_rows.PATCH_TABLE.get(name)
        or run_measures.rows.MOTION_TABLE.get(name)
    )


def describe_quantity(name: str, kind: str = "") -> str:
    """Return what a quantity of a kind of answer is in one sentence, or "" if no table defines it."""
    definition = find_definition(name, kind)
    if definition is None:
        return ""
    base_name = remove_interface_number(name)
    number = name.removeprefix(base_name).removeprefix("_")
    part = "group" if kind in SURFACE_ANSWER_KINDS else "interface"
    text = f"{definition.text}; of {part} {number}" if number else definition.text
    return f"{text[0].upper()}{text[1:].rstrip('.')}."


def choose_scale(name: str, unit: str, size: float) -> tuple[str, float]:
    """Return the display unit of a quantity and the number of it in one SI unit.

    Parameters
    ----------
    name : str
        A name that ends in `fraction` or `share` is displayed in percent, one that ends in `phase` in degrees.
    unit : str
        SI unit.
    size : float
        Magnitude of the number [SI].
    """
    last_word = remove_interface_number(name).rpartition("_")[2]
    # Words at the end of a name that mark a fraction (in percent) or a phase (in degrees)
    if unit == "1" and last_word in ("fraction", "share"):
        return "%", 100.0
    if unit == "rad" and last_word == "phase":
        # Display unit of angles, and degrees in a radian
        return ("deg", 57.29577951308232)
    if unit not in DISPLAY_UNIT_LADDERS:
        return ("" if unit == "1" else unit.replace(" s-1", "/s")), 1.0
    return choose_unit(DISPLAY_UNIT_LADDERS[unit], size)


def format_quantity(name: str, quantity: Quantity) -> str:
    """Return a quantity as text, such as "14.808 ± 0.041 um" or "2.1 um (1.8 to 2.6)".

    An interval that is not centred on the value stands in brackets. A missing value is a dash.
    """
    value = quantity.value
    if value is None:
        return "-"
    error = quantity.error
    ends = [abs(end) for end in (quantity.low, quantity.high) if end is not None]
    if error is None and len(ends) == 2 and quantity.high > MAX_END_RATIO * quantity.low > 0:
        # each number in its own unit: the digits of the largest one would hide the others
        numbers = (value, quantity.low, quantity.high)
        text, *ends = (format_value(number, quantity.unit, 3, name) for number in numbers)
        if len({one.partition(" ")[2] for one in (text, *ends)}) == 1:
            ends = [end.partition(" ")[0] for end in ends]
        return f"{text} ({' to '.join(ends)})"
    unit, scale = choose_scale(name, quantity.unit, max([abs(value), *ends]))
    digits = None if error is not None or ends else _find_digits(name)
    if digits is not None:
        return f"{format_number(value * scale, digits)} {unit}".strip()
    if error is not None or not ends:
        texts = round_to_error(
            value * scale,
            None if error is None else error * scale,
            _find_zero_limit(name, quantity) * scale,
        )
        return format_with_error(*texts, unit)
    return _format_interval(value * scale, quantity, unit, scale)


def _find_digits(name: str) -> int | None:
    """Return the number of digits to show of a quantity without an error; None for a measure of a run: all digits."""
    found = (
        _find_row(name)
        or _find_row(remove_interface_number(name))
        or surface_definitions.find_surface_definition(name)
    )
    return getattr(found, "digits", None)


def format_value(value: float | str, unit: str, digits: int = 4, name: str = "") -> str:
    """Return a number without an error in a readable unit.

    Parameters
    ----------
    value : float or str
        Number [SI], or a word, which is returned.
    unit : str
        SI unit; "" for a number.
    digits : int, optional
        Number of significant digits.
    name : str, optional
        Name of the quantity; a fraction is displayed in percent.
    """
    if isinstance(value, str):
        return value
    label, scale = choose_scale(name, unit or "1", abs(value))
    return f"{format_number(float(value) * scale, digits)} {label}".strip()


def _format_interval(value: float, quantity: Quantity, unit: str, scale: float) -> str:
    """Return a value, in its display unit, with the ends of its interval in brackets.

    `value` and `unit` are those to display, while the ends of `quantity` are in SI units. `scale` is the number of
    display units in one SI unit.
    """
    ends = [None if end is None else end * scale for end in (quantity.low, quantity.high)]
    if None in ends:
        limit = f"at least {ends[0]:.3g}" if ends[1] is None else f"at most {ends[1]:.3g}"
        return f"{format_number(value, 3)} {unit} ({limit})".replace("  ", " ")

    # both ends and the value have two digits of the width of the interval, and thus the same last digit
    half_width = (ends[1] - ends[0]) / 2
    # Smallest half-width of an interval relative to its ends that the digits show
    is_shown = half_width > 1e-9 * max(map(abs, ends))
    # Largest number of digits of the end of an interval, which has two digits of the half-width
    digits = 11 if is_shown else MAX_SIGNIFICANT_DIGITS
    numbers = (value, *ends)
    text, low, high = (round_to_error(n, half_width, max_digits=digits)[0] for n in numbers)
    return f"{text} {unit} ({low} to {high})".replace("  ", " ")


def _find_zero_limit(name: str, quantity: Quantity) -> float:
    """Return the magnitude [SI] below which a quantity is displayed as 0.

    It is the floor of its definition where that is smaller than the floor of the run, which a run raises to its tolerance.
    """
    base_name = remove_interface_number(name)
    row = patch_rows.PATCH_TABLE.get(name) or run_measures.rows.MOTION_TABLE.get(base_name)
    return quantity.floor if row is None else min(row.floor, quantity.floor)


def is_zero(name: str, quantity: Quantity) -> bool:
    """Return whether a quantity is displayed as 0."""
    return format_quantity(name, quantity).partition(" ")[0] == "0"


def choose_key_quantities(quantities: Quantities) -> Quantities:
    """Return the quantities that a page shows in tiles, at most MAX_KEY_QUANTITIES; none that is missing or 0."""
    names = [name for name in KEY_QUANTITY_NAMES if name in quantities]
    # the quantities of a verb without key names are shown in their own order
    names = names or list(quantities)
    shown = {
        name: quantities[name]
        for name in names
        if quantities[name].value is not None and not is_zero(name, quantities[name])
    }
    return dict(list(shown.items())[:MAX_KEY_QUANTITIES])
