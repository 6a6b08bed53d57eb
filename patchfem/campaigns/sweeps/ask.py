"""From the words of a request to the scene and the cases of a sweep, every mistake named at once."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ...scene.axes import read
from ...scene.scene import SceneError, text_of
from .asked import Asked
from .cases import Cases

LOOKED = 32  # cases that are read before a sweep starts, to find one that is valid
SHOWN = 12  # mistakes that are printed


def asked_of(path: Path, sets: Sequence[str], over: Sequence[str]) -> tuple[Asked, Cases]:
    """The scene in a file and its cases: all combinations of `over` texts, or of the table [sweep] without any.

    SceneError names the mistakes of both, also where none of the cases that are looked at is a valid scene.
    """
    asked = Asked(Path(path), text_of(path), tuple(sets))
    return asked, cases_of(asked, over)


def cases_of(asked: Asked, over: Sequence[str]) -> Cases:
    """The cases of a scene; arguments as `asked_of`."""
    axes, wrong = read(over)
    if not over:
        axes, wrong = asked.axes()
    if wrong:
        first = [f"{axis.key}={axis.texts[0]}" for axis in axes]
        raise SceneError([*asked.mistakes(first), *(f"--over {one}" if over else one for one in wrong)])
    if not axes:
        raise SceneError([f"{asked.path}: nothing to sweep over; add --over table.key=v1,v2,... or a table [sweep]"])
    cases = Cases(tuple(axes))
    refuse_all(asked, cases)
    return cases


def refuse_all(asked: Asked, cases: Cases) -> None:
    """SceneError with the mistakes of cases spread over the sweep where none of these is a valid scene."""
    found, step = {}, max(1, len(cases) // LOOKED)
    for number in range(0, len(cases), step):
        mistakes = asked.mistakes(cases.sets(number))
        if not mistakes:
            return
        found |= dict.fromkeys(mistakes)
    lines = list(found)
    raise SceneError(lines[:SHOWN] + ([f"and {len(lines) - SHOWN} more"] if len(lines) > SHOWN else []))
