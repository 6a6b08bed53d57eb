"""Values of swept keys as text, and the cases of a sweep ordered along one key."""

from collections.abc import Callable

import numpy as np

from ..written import shorten_to_spacing


def is_varied(key: dict) -> bool:
    """Return whether a swept key has more than one value."""
    texts = key["texts"]
    return any(text != texts[0] for text in texts)


def key_formatter(key: dict) -> Callable[[int], str]:
    """Return a function that formats the value of a swept key in a case.

    It shows enough digits to distinguish neighbouring values.
    """
    values = np.asarray(key["values"], float)
    sizes = np.unique(values)
    spacings = np.minimum(np.diff(sizes, prepend=-np.inf), np.diff(sizes, append=np.inf))

    def format_case(case: int) -> str:
        """Return the value of the key in a case."""
        spacing = spacings[np.searchsorted(sizes, values[case])]
        return shorten_to_spacing(str(key["texts"][case]), values[case], spacing)

    return format_case


def group_cases_along_key(key: dict, other_keys: list) -> list:
    """Group the cases in which all other keys have equal values, and order each group along one key."""
    lines = {}
    for case in np.argsort(np.asarray(key["values"], float), kind="stable").tolist():
        lines.setdefault(tuple(other["texts"][case] for other in other_keys), []).append(case)
    return [np.array(line) for line in lines.values()]
