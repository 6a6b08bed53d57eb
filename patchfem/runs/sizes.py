"""Sizes of a run before it starts: numbers of unknowns, and contributions to the memory.

In: numbers of unknowns and bytes of each stage of a run. Out: `RunSizes`, which a plan adds up.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple


class MemoryPart(NamedTuple):
    """Contribution to the peak memory of a run, with the scene key that determines its size.

    key: "" if no scene key determines the size.
    """

    bytes: float
    what: str
    key: str = ""


COMPILED_CODE = MemoryPart(6e7, "compiled code")  # for any engine with compiled code


@dataclass(frozen=True, slots=True)
class RunSizes:
    """Sizes of a run or of one of its stages.

    - unknowns: number of unknowns by name.
    - parts: contributions to the memory.
    - sentences: sentences for the plan.
    - engine: name of the engine; "" for a stage without one.
    """

    unknowns: dict[str, int] = field(default_factory=dict)
    parts: tuple[MemoryPart, ...] = ()
    sentences: tuple[str, ...] = ()
    engine: str = ""

    def __add__(self, other: RunSizes) -> RunSizes:
        unknowns = dict(self.unknowns)
        for name, count in other.unknowns.items():
            unknowns[name] = unknowns.get(name, 0) + count
        return RunSizes(
            unknowns,
            self.parts + other.parts,
            self.sentences + other.sentences,
            self.engine or other.engine,
        )
