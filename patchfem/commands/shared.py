"""What several verbs of the command line share: options, loading of a scene, a progress bar, two ways to end."""

import sys
from pathlib import Path
from time import monotonic
from typing import Annotated

from cyclopts import Parameter

from ..model import model
from ..scene import scene
from ..scene.keys import quantities
from .streams import plain


def flag(text: str, *names: str) -> type:
    """The type of an option that is named or not, with what it does in words."""
    return Annotated[
        bool, Parameter(name=names or None, negative=(), help=text, show_default=False)
    ]


def texts(text: str, name: str | None = None) -> type:
    """The type of an option that may be repeated, each time with a text."""
    return Annotated[
        tuple[str, ...], Parameter(name=name, negative=(), help=text, show_default=False)
    ]


def word(text: str, name: str | None = None) -> type:
    """The type of an option that is a text, empty unless given; it may begin with a hyphen, as a place below zero."""
    return Annotated[
        str, Parameter(name=name, allow_leading_hyphen=True, help=text, show_default=False)
    ]


def out_in(text: str) -> type:
    """The type of the option -o of a verb, with what is written there."""
    return Annotated[Path | None, Parameter(name=["-o", "--out"], help=text)]


Sets = texts('change a value of the scene, such as "contact.load=30 lbf"; may be repeated', "--set")
Json = flag("print the answer as one JSON object", "--json")
Out = out_in("folder of the results, such as out/mine")
Quiet = flag("print only errors", "-q", "--quiet")
Units = word(
    'units of x and z if a file gives none or wrong ones, such as "mm,um"; for a matrix of heights: pixel '
    'size and unit of z, such as "0.8 um,nm"'
)
NoPage = flag("leave out report.html", "--no-page")


def placed(out: Path | None, name: str) -> Path:
    """The folder of the results: the one that is named, else out/<name>."""
    return out if out is not None else Path("out") / name


def quantity(text: str, kind: str, option: str) -> float | None:
    """The words of an option as a quantity of this kind in SI, None where there are none."""
    try:
        return quantities.parse_quantity(text, kind) if text else None
    except ValueError as error:
        raise Refused(f"{option}: {error}") from None


def pair(units: str) -> tuple | None:
    """The units of x and z that --units names, None where it is not given."""
    return tuple(word.strip() for word in units.split(",")) if units else None


class Ended(Exception):
    """A verb has said all there is to say and ends with this exit code."""

    def __init__(self, code: int):
        super().__init__(f"exit code {code}")
        self.code = code


class NotReached(Ended):
    """The run is on disk and marked not_converged, exit code 3."""

    def __init__(self):
        super().__init__(3)


class Refused(Exception):
    """A request that the command line itself turns down, exit code 2."""


def say(text: str) -> None:
    """One line on stderr; a stream that takes none is left alone, as nothing else could be told of it."""
    try:
        print(text, file=sys.stderr, flush=True)
    except (OSError, ValueError):
        pass


def note(text: str) -> None:
    """A note on stderr; what files wrote into it moves no cursor."""
    say(plain(f"note: {text}"))


def scene_of(path: Path, sets, faults=None):
    """The scene of a file with the words of --set put in; SceneError names every mistake.

    faults: (tables, folder, whole) -> (key, message) of more mistakes.
    """
    return scene.load(path, sets, faults)


def model_of(path: Path, sets):
    """What the scene of a file means, built once; SceneError names every mistake."""
    return model.build(scene_of(path, sets))


def unswept_of(path: Path, sets):
    """`model_of` with the scene's own values where [sweep] has others, which a note names."""
    found = scene_of(path, sets)
    if found.sweep:
        note(
            f"[sweep] is left out: {', '.join(axis.key for axis in found.sweep)} as the scene gives "
            f"{'it' if len(found.sweep) == 1 else 'them'} (a key that only [sweep] has: its first value)"
        )
    return model.build_unswept(found)


class progress_bar:
    """A bar on a terminal; elsewhere a line every ten seconds; nothing where it is to be silent. The call takes the
    done share."""

    def __init__(self, silent: bool):
        self.bar, self.silent = None, silent
        if not silent and sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import Progress

            self.bar = Progress(console=Console(stderr=True), transient=True)
            self.task = self.bar.add_task("running", total=1.0)

    def __enter__(self):
        if self.silent:
            return None
        if self.bar is None:
            return Lines()
        self.bar.start()
        return lambda share: self.bar.update(self.task, completed=share)

    def __exit__(self, *_):
        if self.bar is not None:
            self.bar.stop()


class Lines:
    """Progress as lines: the share that is done and the time that is left, at most one in SECONDS.

    The pace is that since the first call: what is compiled before it says nothing of the work.
    """

    SECONDS = 10.0

    def __init__(self, clock=monotonic):
        self.clock, self.first, self.next = clock, None, clock() + self.SECONDS

    def __call__(self, share: float) -> None:
        now = self.clock()
        self.first = self.first or (now, share)
        if now < self.next:
            return
        self.next = now + self.SECONDS
        begin, before = self.first
        left = (
            f", about {(now - begin) * (1 - share) / (share - before):.0f} s left"
            if share > before
            else ""
        )
        say(f"{share:.0%} done{left}")
