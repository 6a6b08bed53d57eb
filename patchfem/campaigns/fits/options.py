"""Options of a fit, in a module that loads no optimizer, so that the Python interface can name them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

from ...scene import refuse_removed


@dataclass(frozen=True, slots=True)
class FitOptions:
    """Options of a fit, besides the keys that are fitted.

    A fit to a worn depth has none of them.

    Attributes
    ----------
    hold : sequence of str
        Rows to predict without fitting them, such as "frequency=135 Hz,150 Hz", "amplitude=2 um" or "cycle=1".
    leave_out : str
        Column; each of its values is left out in turn.
    starts : int or None
        Number of starting points of the search; the best result is used. By default 8 for rows of a rig, 6 for a curve of
        frequency and damping against amplitude, 3 for a loop.
    """

    hold: Sequence[str] = ()
    leave_out: str = ""
    starts: int | None = None

    def __new__(cls, *options: Any, **named_options: Any) -> Self:
        """Refuse an option that was removed, with what to use instead."""
        refuse_removed("fit", named_options)
        return object.__new__(cls)
