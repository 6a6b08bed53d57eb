"""The verb that runs a scene for many values of its keys."""

import json
import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Annotated

from cyclopts import Parameter

from .shared import Ended, Json, NotReached, Out, Quiet, Refused, Sets, say

FIRST = 5  # messages of failed cases that are printed


@Parameter(name="*")
@dataclass
class Over:
    """Which cases: --over table.key=v1,v2,... or table.key=low..high:n, may be repeated."""

    over: Annotated[tuple[str, ...], Parameter(name="--over", negative=(), help="table.key=v1,v2,... or "
                                               "table.key=low unit..high unit:n (:9log, :9lin), may be repeated")] = ()


@Parameter(name="*")
@dataclass
class By:
    """Who works: -j processes of this machine."""

    jobs: Annotated[int, Parameter(name=["-j", "--jobs"], help="processes of this machine; 1: this one")] = 1


def sweep(scene: Path, /, *, what: Over | None = None, by: By | None = None, out: Out = None, set_: Sets = (),
          resume: Annotated[bool, Parameter(negative=(), help="go on with what the folder holds")] = False,
          json_: Json = False, quiet: Quiet = False):
    """Run SCENE for all combinations of the values of --over, or of its table [sweep]: a folder per case, sweep.csv and
    sweep.nc, by default in out/<scene name>-sweep."""
    from ..export.sweeps.run import Place, sweep_into

    begin, talk = perf_counter(), (lambda text: None) if quiet else say
    executor = executor_of(by or By())
    asked, cases = asked_of(scene, set_, what or Over())
    target = out if out is not None else Path("out") / f"{scene.stem}-sweep"
    line = Progress(quiet)
    try:
        found = sweep_into(asked, cases, Place(target, resume), executor, talk, line)
    except KeyboardInterrupt:
        line.end()
        talk(f"interrupted; {line.done} of {len(cases)} cases are kept; go on with --resume: patchfem "
             f"{shlex.join([*_words(), '--resume'])}")
        raise Ended(130) from None
    line.end()
    _answer(found, target, json_, perf_counter() - begin)


def asked_of(path: Path, sets, what: Over) -> tuple:
    """(Asked, Cases) of the words of the command line; SceneError with every mistake at once."""
    from ..campaigns.sweeps.ask import asked_of as read

    return read(path, sets, what.over)


def executor_of(by: By):
    """Who answers the chunks."""
    if by.jobs < 1:
        raise Refused(f"sweep -j {by.jobs}: at least one process is wanted")
    if by.jobs == 1:
        from ..campaigns.sweeps.executors.here import Here

        return Here()
    from ..campaigns.sweeps.executors.pool import Pool

    return Pool(by.jobs)


def _words() -> list:
    return [word for word in sys.argv[1:] if word != "--resume"]


class Progress:
    """Cases done and time left on stderr: a line that renews itself on a terminal, one every ten seconds elsewhere."""

    def __init__(self, silent: bool):
        self.silent, self.done, self.clock, self.said = silent, 0, None, perf_counter()
        self.open = sys.stderr.isatty()

    def __call__(self, done: int, total: int) -> None:
        from ..campaigns.sweeps.sweep import Clock

        if self.clock is None:
            self.clock = Clock(total, done)
        text, self.done = self.clock(done - self.clock.done), done
        if self.silent or perf_counter() - self.said < (0.2 if self.open else 10.0):
            return
        self.said = perf_counter()
        print(f"\r\x1b[K{text}" if self.open else text, end="" if self.open else "\n", file=sys.stderr, flush=True)

    def end(self) -> None:
        """Clear the line."""
        if self.open and not self.silent:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


def _answer(found, target: Path, json_: bool, seconds: float) -> None:
    from collections import Counter

    from ..runs.many.answers import FAILED

    counts = dict(Counter(map(str, found.outcome)).most_common())
    failed = sorted(found.messages)
    if json_:
        print(json.dumps({"cases": len(found), "outcomes": counts, "failed": len(failed), "folder": str(target),
                          "seconds": round(seconds, 3)}, ensure_ascii=False))
    else:
        print(f"{len(found)} cases: " + ", ".join(f"{count} {name}" for name, count in counts.items()))
        print(f"results: {target / 'sweep.csv'} {target / 'sweep.nc'}")
    sys.stdout.flush()
    alike = {}
    for number in failed:
        alike.setdefault(found.messages[number], []).append(number + 1)
    for text, numbers in list(alike.items())[:FIRST]:
        say(f"case {numbers[0]}{f' and {len(numbers) - 1} more' * (len(numbers) > 1)}: {text}")
    if len(alike) > FIRST:
        say("sweep.csv has the messages of all failed cases")
    if len(failed) == len(found):
        raise Refused("sweep: no case could be run")
    if failed or FAILED in counts or "not_converged" in counts:
        raise NotReached
