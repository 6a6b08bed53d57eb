"""Predicted cost of a run: the record that each step returns and that a plan adds up.

In: seconds, bytes and sentences of each step of a run. Out: `Cost`, with a list of contributions to
the memory.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from operator import add
from typing import NamedTuple

# Name under which the memory of compiled code is reported. A run that must compile it also needs
# address space for the compiler (`memory.free_bytes`).
COMPILED_CODE_LABEL = "compiled code"


class MemoryPart(NamedTuple):
    """Contribution to the peak memory of a run, with the scene key that determines its size.

    key: "" if no scene key determines the size.
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
        CPU seconds on one core by activity.
    parts : tuple of MemoryPart
    words : tuple of str
        Sentences for the plan.
    steps : int
        Steps of the time loop, including those of the coarse runs.
    sizes : dict
        Number of unknowns by name.
    engine : str
        Name of the engine; "" for a step without one.
    compile_seconds : float
        CPU seconds of compiling, in the first run that needs this code.
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
        """Total CPU time [s] without compiling."""
        return sum(self.times.values())

    @property
    def bytes(self) -> int:
        """Sum of all contributions to the memory of a run [bytes]."""
        return int(sum(part.bytes for part in self.parts))

    def __add__(self, other: Cost) -> Cost:
        def merge(first: dict, second: dict) -> dict:
            """Add the values of two dicts key by key."""
            return first | {name: first.get(name, 0) + value for name, value in second.items()}

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
    """Memory and CPU time of the compiled code of an engine.

    - bytes: memory of the code.
    - seconds: CPU seconds of loading it.
    - compile: CPU seconds of compiling it.
    """

    bytes: float
    seconds: float
    compile: float = 0.0

    def cost(self) -> Cost:
        """Return the Cost of loading the compiled code."""
        part = MemoryPart(self.bytes, COMPILED_CODE_LABEL if self.compile else "code")
        return Cost({"code": self.seconds}, (part,), compile_seconds=self.compile)


NO_CODE = EngineCode(0.0, 0.0)
# For the prescribed displacement of a bench, which has few kernels.
SHORT_CODE = EngineCode(58e6, 0.15, 2.0)
MARCH_CODE = EngineCode(58e6, 0.15, 3.5)
SHEAR_MARCH_CODE = EngineCode(58e6, 0.15, 7.0)  # For time steps with shear modes.
HYBRID_CODE = EngineCode(82e6, 0.15, 12.0)
EVENT_CODE = EngineCode(82e6, 0.15, 12.0)  # For the event-driven engines.
BALANCE_CODE = EngineCode(1e8, 0.3, 3.0)
