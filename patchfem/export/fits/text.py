"""Fitted values as text, in suitable units."""

from typing import NamedTuple

from ...formatting import SENTENCE_UNITS, choose_display_unit, round_to_error


class FormattedValue(NamedTuple):
    """Fitted value and its confidence interval as text, with their unit."""

    value: str
    unit: str
    ends: list


def format_fitted(entry: dict) -> FormattedValue:
    """Format a fitted value of fit.json and its interval in a readable unit."""
    unit, scale = choose_display_unit(
        entry["value"], SENTENCE_UNITS.get(entry["unit"], entry["unit"])
    )
    ends = entry.get("interval") or []
    half_width = scale * (ends[1] - ends[0]) / 2 if ends else None
    numbers = [entry["value"], *ends]
    value, *ends = [round_to_error(number * scale, half_width)[0] for number in numbers]
    return FormattedValue(value, unit, ends)


def format_values(fit_data: dict, width: int = 26) -> list:
    """Return a line of text for each fitted value of fit.json."""
    return [format_line(f"{key:<{width}}", value) for key, value in named_values(fit_data).items()]


def named_values(fit_data: dict) -> dict:
    """Return the fitted keys and offsets by the names that a page displays."""
    offsets = fit_data.get("offsets", {})
    return fit_data["values"] | {f"offset of the {name}": one for name, one in offsets.items()}


def format_line(name: str, entry: dict) -> str:
    """Return a line with a fitted value, its interval, and the bound that it has reached, if any."""
    value, unit, ends = format_fitted(entry)
    interval = "not determined"
    if ends:
        method = "profile" if entry["method"] == "profile" else "linearised problem"
        interval = f"95 % in [{', '.join(ends)}] by the {method}"
    bound = f", at its {entry['at_bound']} bound" if entry["at_bound"] else ""
    return f"  {name} {f'{value} {unit}'.strip()}   {interval}{bound}"
