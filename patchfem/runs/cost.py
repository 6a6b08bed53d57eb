"""Predicted cost of a run: the record that each engine and each step of a run returns, and that a plan adds up."""

from __future__ import annotations

from dataclasses import dataclass, field
from operator import add
from typing import NamedTuple

# address space of the compiler is counted for a run with a part of this name (`memory.free_bytes`)
CODE_TO_COMPILE = "compiled code"


class MemoryPart(NamedTuple):
    """Part of the memory of a run at its peak.

    key: the key of the scene that sets its size, "" if there is none.
    """

    bytes: float
    what: str
    key: str = ""


@dataclass(frozen=True, slots=True)
class Cost:
    """Predicted cost of a run or of one of its steps.

    Attributes
    ----------
    times : dict
        CPU seconds on one core, by what takes them.
    parts : tuple of MemoryPart
    words : tuple of str
        Sentences of the plan.
    steps : int
        Steps of the time loop, those of the coarser runs included.
    sizes : dict
        Number of unknowns by name.
    engine : str
        Name of the engine, "" for a step without one.
    compile_seconds : float
        CPU seconds of compiling in the first run of this kind.
    """

    times: dict = field(default_factory=dict)
    parts: tuple[MemoryPart, ...] = ()
    words: tuple[str, ...] = ()
    steps: int = 0
    sizes: dict = field(default_factory=dict)
    engine: str = ""
    compile_seconds: float = 0.0

    @property
    def seconds(self) -> float:
        """CPU seconds in all, without compiling."""
        return sum(self.times.values())

    @property
    def bytes(self) -> int:
        """Memory of all parts."""
        return int(sum(part.bytes for part in self.parts))

    def __add__(self, other: Cost) -> Cost:
        def merge(mine: dict, others: dict) -> dict:
            return mine | {name: mine.get(name, 0) + value for name, value in others.items()}

        summed = map(
            add, (self.parts, self.words, self.steps), (other.parts, other.words, other.steps)
        )
        return Cost(
            merge(self.times, other.times),
            *summed,
            merge(self.sizes, other.sizes),
            self.engine or other.engine,
            self.compile_seconds + other.compile_seconds,
        )


class EngineCode(NamedTuple):
    """Cost of the compiled code of an engine: bytes, CPU seconds until it runs, CPU seconds of compiling."""

    bytes: float
    seconds: float
    compile: float = 0.0

    def cost(self) -> Cost:
        """Return the cost of loading the code."""
        part = MemoryPart(self.bytes, CODE_TO_COMPILE if self.compile else "code")
        return Cost({"code": self.seconds}, (part,), compile_seconds=self.compile)


NO_CODE = EngineCode(0.0, 0.0)
# of a linear motion in closed form: the library of LLVM is loaded
LINEAR_CODE = EngineCode(58e6, 0.0)
SHORT_CODE = EngineCode(58e6, 0.15, 2.0)  # of the slide of a bench, which has few kernels
MARCH_CODE = EngineCode(58e6, 0.15, 3.5)
SHEAR_MARCH_CODE = EngineCode(58e6, 0.15, 7.0)  # of a march with shear modes of a patch
SMOOTH_CODE = EngineCode(74e6, 0.15, 9.0)
EVENT_CODE = EngineCode(82e6, 0.15, 12.0)  # of the engines that go from event to event
BALANCE_CODE = EngineCode(1e8, 0.3, 3.0)
