"""Common parts of the commands: options, loading of a scene, progress, and exit codes."""

import sys
from pathlib import Path
from time import monotonic
from typing import Annotated

from cyclopts import Parameter

from ..model import model
from ..scene import scene
from ..scene.keys import quantities
from .streams import make_printable


def flag_option(text: str, *names: str) -> type:
    """Return the type of an option without a value; `text` is its help text."""
    return Annotated[
        bool, Parameter(name=names or None, negative=(), help=text, show_default=False)
    ]


def repeated_option(text: str, name: str | None = None) -> type:
    """Return the type of a repeatable option with a text value; `text` is its help text."""
    return Annotated[
        tuple[str, ...], Parameter(name=name, negative=(), help=text, show_default=False)
    ]


def text_option(text: str, name: str | None = None) -> type:
    """Return the type of an option with a text value, "" by default; `text` is its help text.

    The value may begin with a hyphen, as a negative position does.
    """
    return Annotated[
        str, Parameter(name=name, allow_leading_hyphen=True, help=text, show_default=False)
    ]


def out_option(text: str) -> type:
    """Return the type of the option -o of a command; `text` is its help text."""
    return Annotated[Path | None, Parameter(name=["-o", "--out"], help=text)]


Sets = repeated_option(
    'change a value of the scene, such as "contact.load=30 lbf"; may be repeated', "--set"
)
Json = flag_option("print the answer as one JSON object", "--json")
Out = out_option("folder of the results, such as out/mine")
Quiet = flag_option("print only errors", "-q", "--quiet")
Units = text_option(
    'units of x and z if a file gives none or wrong ones, such as "mm,um"; for a matrix of heights: pixel '
    'size and unit of z, such as "0.8 um,nm"'
)
NoPage = flag_option("leave out report.html", "--no-page")


def choose_folder(out: Path | None, name: str) -> Path:
    """Return the folder for the results: the one that is given, or out/<name> if none is given."""
    return out if out is not None else Path("out") / name


def refuse_existing(out: Path | None) -> None:
    """Raise UsageError if the file to write exists."""
    if out is not None and out.exists():
        raise UsageError(f"{out}: already exists; choose another file with -o, or remove it")


def parse_quantity(text: str, kind: str, option: str) -> float | None:
    """Return the value of an option as a quantity in SI, or None if the option is "".

    Parameters
    ----------
    text : str
        Value of the option.
    kind : str
        Kind of quantity, as in `scene.keys.quantities`.
    option : str
        Name of the option, for the message.

    Raises
    ------
    UsageError
        If the text is not such a quantity.
    """
    try:
        return quantities.parse_quantity(text, kind) if text else None
    except ValueError as error:
        raise UsageError(f"{option}: {error}") from None


def parse_units(units: str) -> tuple | None:
    """Return the units of x and z in --units, or None if the option is not given."""
    return tuple(word.strip() for word in units.split(",")) if units else None


class CommandExit(Exception):
    """Raised when a command has reported everything and ends with an exit code."""

    def __init__(self, code: int):
        super().__init__(f"exit code {code}")
        self.code = code


class NotConvergedExit(CommandExit):
    """Raised if the results are written but have the outcome not_converged: exit code 3."""

    def __init__(self):
        super().__init__(3)


class UsageError(Exception):
    """Raised for an invalid combination of command-line arguments: exit code 2."""


def print_message(text: str) -> None:
    """Print a line on stderr; do nothing if the stream cannot be written."""
    try:
        print(text, file=sys.stderr, flush=True)
    except (OSError, ValueError):
        pass


def note(text: str) -> None:
    """Print a note on stderr, without control characters that could move the cursor."""
    print_message(make_printable(f"note: {text}"))


def load_scene(path: Path, sets, faults=None, prepare=None):
    """Load the scene in a file with --set strings; raise SceneError with every mistake.

    Parameters
    ----------
    path : Path
    sets : sequence of str
        ``table.key=value`` strings.
    faults : callable, optional
        (tables, folder, whole) -> (key, message) of further mistakes.
    prepare : callable, optional
        Changes the plain values of the scene before they are read.
    """
    return scene.load(path, sets, faults, prepare)


def load_model(path: Path, sets):
    """Build the model of the scene in a file; raise SceneError with every mistake."""
    return model.build(load_scene(path, sets))


def load_model_without_sweep(path: Path, sets):
    """Build the model of a scene without its [sweep] table, and print a note on this."""
    scene = load_scene(path, sets)
    if scene.sweep:
        note(
            f"[sweep] is left out: {', '.join(axis.key for axis in scene.sweep)} as the scene gives "
            f"{'it' if len(scene.sweep) == 1 else 'them'} (a key that only [sweep] has: its first value)"
        )
    return model.build_without_sweep(scene)


class progress_bar:
    """Context of a progress bar on a terminal, or of a line every ten seconds elsewhere.

    Its value is a function that takes the completed fraction; None if `silent`.
    """

    def __init__(self, silent: bool):
        self.bar = None
        self.silent = silent
        if not silent and sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import Progress

            self.bar = Progress(console=Console(stderr=True), transient=True)
            self.task = self.bar.add_task("running", total=1.0)

    def __enter__(self):
        if self.silent:
            return None
        if self.bar is None:
            return ProgressLines()
        self.bar.start()
        return lambda fraction: self.bar.update(self.task, completed=fraction)

    def __exit__(self, *_):
        if self.bar is not None:
            self.bar.stop()


class ProgressLines:
    """Progress as lines that state the completed fraction and the remaining time, at most one per SECONDS.

    The speed is measured from the first call, because compilation before this call says nothing
    about the work.
    """

    SECONDS = 10.0

    def __init__(self, clock=monotonic):
        self.clock, self.first, self.next = clock, None, clock() + self.SECONDS

    def __call__(self, fraction: float) -> None:
        now = self.clock()
        self.first = self.first or (now, fraction)
        if now < self.next:
            return
        self.next = now + self.SECONDS
        first_time, first_fraction = self.first
        time_left = (
            f", about {(now - first_time) * (1 - fraction) / (fraction - first_fraction):.0f} s left"
            if fraction > first_fraction
            else ""
        )
        print_message(f"{fraction:.0%} done{time_left}")
