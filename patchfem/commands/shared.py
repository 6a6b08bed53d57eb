"""Common parts of the commands: options, loading of a scene, progress, output of an answer, and exit codes."""

import json
import shlex
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Event, Thread
from time import monotonic
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from ..export import folder as folders
from ..export import page, runs, show, store
from ..export.charts import axes
from ..model import model
from ..scene import scene
from ..scene.keys import lines, quantities
from .streams import make_printable

if TYPE_CHECKING:
    from ..export.answer import Answer

# Exit code if a numerical method did not converge, or if some cases failed
NOT_CONVERGED_EXIT_CODE = 3


def flag_option(text: str, *names: str) -> type:
    """Return the type of an option without a value.

    Parameters
    ----------
    text : str
        Help text.
    *names : str
        Spellings of the option, such as "--quiet" and "-q". The default is the name of the parameter.
    """
    return Annotated[
        bool, Parameter(name=names or None, negative=(), help=text, show_default=False)
    ]


def repeated_option(text: str, name: str | None = None) -> type:
    """Return the type of a repeatable option with a text value; `text` is its help text.

    `name` is its spelling, by default the name of the parameter.
    """
    return Annotated[
        tuple[str, ...], Parameter(name=name, negative=(), help=text, show_default=False)
    ]


def text_option(text: str, name: str | None = None) -> type:
    """Return the type of an option with a text value, "" by default; `text` is its help text.

    `name` is its spelling, by default the name of the parameter. The value may begin with a hyphen, as a negative
    position does.
    """
    return Annotated[
        str, Parameter(name=name, allow_leading_hyphen=True, help=text, show_default=False)
    ]


def path_option(text: str, *names: str) -> type:
    """Return the type of an option that names a file or a folder; `text` is its help text."""
    return Annotated[Path | None, Parameter(name=names or None, help=text)]


def out_option(text: str) -> type:
    """Return the type of the option -o of a command; `text` is its help text."""
    return path_option(text, "-o", "--out")


def required_out_option(text: str) -> type:
    """Return the type of the option -o of a command that cannot do without it; `text` is its help text."""
    return Annotated[Path, Parameter(name=["-o", "--out"], help=text)]


def _require_different_keys(_, texts: tuple[str, ...] | None) -> None:
    """Raise UsageError if two of the assignments ``table.key=value`` of --set have the same key."""
    keys = set()
    for text in texts or ():
        key = ".".join(lines.split_key(lines.split_assignment(text)[0]))
        if key in keys:
            raise UsageError(f"--set {text}: {key} is given twice; remove one of them")
        keys.add(key)


Sets = Annotated[
    repeated_option(
        'change a value of the scene, such as "contact.load=30 lbf"; may be repeated', "--set"
    ),
    Parameter(validator=_require_different_keys),
]
Json = flag_option("print the answer as one JSON object", "--json")
Out = out_option("folder of the results, such as out/mine")
Quiet = flag_option("print only errors", "-q", "--quiet")
Units = text_option('units of x and z if a file gives none or wrong ones, such as "mm,um"')
NoPage = flag_option("leave out report.html", "--no-page")
Plot = path_option("write also the main chart, such as loop.png (.png, .svg or .pdf)", "--plot")
Verbose = flag_option("print all numbers", "-v", "--verbose")


@dataclass(frozen=True)
class Output:
    """Options of all commands that write a results folder.

    Without `out` no files are written. A picture of another format is refused before anything is computed.
    """

    out: Out = None
    no_page: NoPage = False
    plot: Plot = None
    json_: Json = False
    quiet: Quiet = False
    verbose: Verbose = False

    def __post_init__(self):
        if self.plot is not None:
            axes.find_picture_format(self.plot)

    def into(self, name: str) -> "Output":
        """Return the output into the folder that -o gives, or into out/NAME."""
        return replace(self, out=self.out or Path("out") / name)

    @property
    def report(self) -> Callable[[str], None] | None:
        """Function that prints a line on the progress of the work, or None if nothing is printed."""
        return None if self.quiet or self.json_ else print_message


OutputGroup = Annotated[Output, Parameter(name="*")]
# Output options for which the user gives none
DEFAULT_OUTPUT = Output()


def save(make_answer: Callable[[Path], "Answer"], output: Output) -> "Answer":
    """Make an answer, write it with its page into its folder, print it and return it.

    Parameters
    ----------
    make_answer : callable
        Function that takes the folder, which is locked meanwhile, and returns the Answer.
    output : Output
        Where and how the answer is written and printed.
    """
    with folders.Folder(output.out) as folder:
        if folder.dropped and output.report:
            output.report(folder.dropped)
        answer = make_answer(folder.path)
        versions = {"versions": runs.list_versions()}
        origin = versions | answer.origin | {"command": describe_command()}
        answer = replace(answer, origin=origin)
        store.write_answer(answer, folder.path)
        if not output.no_page:
            page.write_report(folder.path)
    present(answer, output)
    return answer


def describe_command() -> str:
    """Return the command line of this process without the folder of its results."""
    words = sys.argv[1:]
    for option in ("-o", "--out"):
        if option in words:
            place = words.index(option)
            del words[place : place + 2]
    return shlex.join(
        ["patchfem", *(Path(word).name if Path(word).is_absolute() else word for word in words)]
    )


def present(answer: "Answer", output: Output) -> None:
    """Print an answer and the names of its files, and draw its picture.

    The options in `output` tell what is printed, and where picture and files go.
    """
    if output.json_:
        content = store.make_summary(answer) if answer.is_run else answer.details
        if answer.kind == "pairs":
            content = answer.details["pairs"]
        print(json.dumps(content, ensure_ascii=False, allow_nan=False), flush=True)
    elif not output.quiet:
        print(*show.make_lines(answer, output.verbose), sep="\n", flush=True)
    if not output.quiet:
        for text in answer.remarks.warnings:
            print_message(f"warning: {text}")
        for text in answer.remarks.notes:
            note(text)
    if output.out is not None and not (output.json_ or output.quiet):
        print(*show.list_files(output.out, not output.no_page), sep="\n", flush=True)
    # the results are in place and named if the picture cannot be written
    if output.plot is not None:
        axes.write_plot({"": answer}, output.plot)


def refuse_existing(out: Path | None) -> None:
    """Raise UsageError if the file to write, `out`, exists."""
    if out is not None and out.exists():
        raise UsageError(f"{out}: already exists; choose another file with -o, or remove it")


def parse_quantity(text: str, kind: str, option: str) -> float | None:
    """Return the value of an option as a quantity in SI, or None if the option is "".

    Parameters
    ----------
    text : str
        Value of the option.
    kind : str
        Kind of quantity, such as "length" or "frequency".
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


def parse_units(units: str) -> tuple[str, ...] | None:
    """Return the units of x and z in --units, or None if the option is not given."""
    return tuple(word.strip() for word in units.split(",")) if units else None


class CommandExit(Exception):
    """Raised when a command has reported everything and ends with an exit code."""

    def __init__(self, code: int):
        super().__init__(f"exit code {code}")
        self.code = code


class UsageError(Exception):
    """Raised for an invalid combination of command-line arguments: exit code 2."""


def print_message(text: str) -> None:
    """Print a text on stderr without control characters, which could move the cursor.

    Nothing happens if the stream cannot be written.
    """
    # some texts are followed by tables for the scene file
    for line in text.split("\n"):
        try:
            print(make_printable(line), file=sys.stderr, flush=True)
        except (OSError, ValueError):
            pass


def note(text: str) -> None:
    """Print the text of a note on stderr."""
    print_message(f"note: {text}")


def load_scene(path: Path, sets, faults=None, prepare=None):
    """Load the scene in a file with --set strings.

    SceneError is raised with every mistake.

    Parameters
    ----------
    path : Path
        Scene file.
    sets : sequence of str
        ``table.key=value`` strings.
    faults : callable, optional
        (tables, folder, whole) -> (key, message) of further mistakes.
    prepare : callable, optional
        Changes the plain values of the scene before they are read.
    """
    return scene.load(path, sets, faults, prepare)


def load_model(path: Path, sets):
    """Build the model of the scene in the file `path`.

    SceneError is raised with every mistake. `sets` are the `table.key=value` strings of --set.
    """
    return model.build(load_scene(path, sets))


class Progress:
    """Progress of a command on stderr, as a context manager.

    On a terminal one line is updated; elsewhere a line is printed every INTERVAL seconds. The remaining time follows from
    the speed since the first call, because compilation before this call says nothing about the work. While nothing is
    complete, the elapsed time is shown after INTERVAL seconds and then after intervals of twice the length each.
    """

    INTERVAL = 10.0  # [s]
    TERMINAL_INTERVAL = 0.2  # [s]

    def __init__(self, is_silent: bool, clock: Callable[[], float] = monotonic):
        self.clock = clock
        self.is_silent = is_silent
        self.on_terminal = sys.stderr.isatty()
        self.start = self.shown_at = clock()
        self.first: tuple[float, float] | None = None
        self.done = 0
        self.over = Event()

    def __enter__(self) -> "Progress":
        if not self.is_silent:
            # A run that may not start a thread, under a limit of memory, goes on without showing the elapsed time.
            with suppress(RuntimeError):
                Thread(target=self._show_elapsed_time, daemon=True).start()
        return self

    def __exit__(self, *_) -> None:
        self.over.set()
        if self.on_terminal and not self.is_silent:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    def __call__(self, fraction: float, text: str = "") -> None:
        """Show the completed fraction, from 0 to 1, or a text on it, and the remaining time.

        Nothing is shown if the last line is too recent.
        """
        now = self.clock()
        self.first = self.first or (now, fraction)
        first_time, first_fraction = self.first
        interval = self.TERMINAL_INTERVAL if self.on_terminal else self.INTERVAL
        if self.is_silent or self.clock() - self.shown_at < interval:
            return
        text = text or f"{fraction:.0%} done"
        if fraction > first_fraction:
            seconds_left = (now - first_time) * (1 - fraction) / (fraction - first_fraction)
            text += f", about {format_duration(seconds_left)} left"
        self._print(text)

    def count(self, done: int, total: int) -> None:
        """Show how many of all cases (`total`) are done, and the remaining time.

        The first call may count stored cases.
        """
        if done > self.done:
            self(done / total, f"{done}/{total} cases")
        self.done = done

    def _show_elapsed_time(self) -> None:
        """Show the elapsed time while nothing is complete."""
        wait = self.INTERVAL
        while not self.over.wait(wait) and self.first is None:
            self._print(f"{format_duration(self.clock() - self.start)} so far")
            wait *= 2

    def _print(self, text: str) -> None:
        """Print a line of text, on a terminal in place of the last one."""
        self.shown_at = self.clock()
        if self.on_terminal:
            print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)
        else:
            print_message(text)


def format_duration(seconds: float) -> str:
    """Return a duration in seconds as text, such as "40 s", "12 min" or "3.1 h"."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
