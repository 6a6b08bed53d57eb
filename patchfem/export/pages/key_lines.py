"""Swept keys as people read them, and the cases of a sweep ordered along one key."""

from collections.abc import Callable

import numpy as np

from ..written import resolved


def varies(key: dict) -> bool:
    """Check whether a key has more than one value."""
    texts = key["texts"]
    return any(text != texts[0] for text in texts)


def shown_of(key: dict) -> Callable[[int], str]:
    """Return a function from a case to the value of a key in it, as people read it."""
    values = np.asarray(key["values"], float)
    sizes = np.unique(values)
    apart = np.minimum(np.diff(sizes, prepend=-np.inf), np.diff(sizes, append=np.inf))

    def shown(case: int) -> str:
        spacing = apart[np.searchsorted(sizes, values[case])]
        return resolved(str(key["texts"][case]), values[case], spacing)

    return shown


def lines_of(key: dict, others: list) -> list:
    """Collect the cases of each combination of the other keys, ordered by the size of the key."""
    lines = {}
    for case in np.argsort(np.asarray(key["values"], float), kind="stable").tolist():
        lines.setdefault(tuple(other["texts"][case] for other in others), []).append(case)
    return [np.array(line) for line in lines.values()]
