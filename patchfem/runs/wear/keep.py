"""The state of a wear run on disk, from which an interrupted run goes on to the same bits."""

import json
import os
from pathlib import Path

import numpy as np

from ...core import PatchfemError
from ...disk.whole import whole
from ...wear.jumps import Worn
from .evolve import Evolved, Moment, evolve

STATE = tuple(Worn.__slots__)
MOMENT = ("cycle", "depth", "used", "pressure", "gap", "miss")


def evolved_with(kept, key: str, model, patch, coarse, progress=None) -> Evolved:
    """`evolve` with its state kept after every jump; kept: where, None keeps nothing; key: what the
    state belongs to."""
    if kept is None:
        return evolve(model, patch, coarse, progress)
    begin = load(kept.path, key) if kept.resume else None
    return evolve(model, patch, coarse, progress, begin, lambda state, moments: save(kept.path, key, state, moments))


def save(path: Path, key: str, state: Worn, moments: tuple) -> None:
    """Write a state and the moments so far; an earlier file is replaced only when the new one is whole."""
    arrays = {f"state_{name}": np.asarray(getattr(state, name)) for name in STATE}
    arrays |= {f"moment_{name}": np.array([getattr(one, name) for one in moments]) for name in MOMENT}
    values = json.dumps([one.values for one in moments], default=float)
    with whole(path) as partial, open(partial, "wb") as file:
        np.savez(file, key=np.array(key), values=np.array(values), **arrays)
        file.flush()
        os.fsync(file.fileno())


def load(path: Path, key: str) -> tuple:
    """(state, moments) of a kept file. PatchfemError where it belongs to another scene or cannot be read."""
    try:
        with np.load(path, allow_pickle=False) as file:
            found = {name: file[name] for name in file.files}
        if str(found["key"]) != key:
            raise PatchfemError(f"{path.parent.name}: what is kept there belongs to another scene or version; run "
                                "without --resume")
        whole = {name: found[f"state_{name}"] for name in STATE}
        state = Worn(**{name: float(value) if value.ndim == 0 else value for name, value in whole.items()})
        columns = [found[f"moment_{name}"] for name in MOMENT]
        moments = tuple(Moment(float(row[0]), *row[1:-1], float(row[-1]), values)
                        for *row, values in zip(*columns, json.loads(str(found["values"])), strict=True))
    except FileNotFoundError:
        raise PatchfemError(f"{path.parent.name}: no interrupted run is kept there; run without --resume") from None
    except PatchfemError:
        raise
    except Exception as error:  # a damaged archive has many ways to fail
        raise PatchfemError(f"{path.parent.name}: the kept state cannot be read ({error}); run without "
                            "--resume") from None
    return state, moments
