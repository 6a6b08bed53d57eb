"""What worker processes are given in tests: objects of a module that they can import."""

import os
import signal
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Deadly:
    """Kills the process that tells of certain cases: always, or the first time only."""

    numbers: tuple
    seen: Path
    once: bool = False

    def __call__(self, number, model, found, case) -> int:
        mark = self.seen / str(number)
        if number in self.numbers and not (self.once and mark.exists()):
            with open(mark, "a") as file:
                file.write("x")
            os.kill(os.getpid(), signal.SIGKILL)
        return number
