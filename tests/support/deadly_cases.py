"""Objects for tests of worker processes, in a module that the workers can import."""

import os
import signal
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class KillingMeasure:
    """Measure that kills its worker process in certain cases: always, or only the first time."""

    numbers: tuple
    seen: Path
    once: bool = False

    def __call__(self, number, model, found, case) -> int:
        """Kill this process if the case is one of `numbers`, else return its number."""
        mark = self.seen / str(number)
        if number in self.numbers and not (self.once and mark.exists()):
            with open(mark, "a") as file:
                file.write("x")
            os.kill(os.getpid(), signal.SIGKILL)
        return number
