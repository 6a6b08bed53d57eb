"""Checkpoint of an interrupted fit to rows: the ends of its finished searches."""

import hashlib
import json
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from ... import __version__
from ...disk.atomic_write import write_text
from ...identify.least_squares import Descent


class SearchCheckpoint:
    """Results of finished searches, stored in a file so that a fit can be resumed.

    Results that were stored for other inputs are ignored.

    Parameters
    ----------
    path : Path
    inputs : iterable
        Inputs of the fit on which the results depend.
    resume : bool
        Whether results in the file are used.
    """

    def __init__(self, path: Path, inputs: Iterable, resume: bool):
        self.path = path
        text = "\n".join([__version__, *map(str, inputs)])
        self.key = hashlib.sha256(text.encode()).hexdigest()
        self.known = {}
        if resume and path.is_file():
            try:
                content = json.loads(path.read_text("utf-8"))
            except (ValueError, RecursionError):
                content = {}
            if isinstance(content, dict) and content.get("question") == self.key:
                self.known = content["ends"]

    def make_callbacks(self, name: str) -> dict[str, Callable]:
        """Return the functions `load` and `save` of a `Search` with this name."""

        def load(start: int) -> Descent | None:
            """Return the stored descent from a start; None if there is none."""
            stored = self.known.get(f"{name}/{start}")
            if not stored:
                return None
            *u, cost, rows, is_converged = stored
            return Descent(np.array(u), np.inf if cost is None else cost, is_converged, rows)

        def save(start: int, descent: Descent) -> None:
            """Store a finished descent; JSON has no infinite number."""
            cost = descent.cost if np.isfinite(descent.cost) else None
            content = [*descent.u.tolist(), cost, descent.rows, bool(descent.is_converged)]
            self.known[f"{name}/{start}"] = content
            write_text(self.path, json.dumps({"question": self.key, "ends": self.known}))

        return {"load": load, "save": save}
