"""Command line of patchfem, which imports scientific packages only when a verb needs them."""

# ruff: noqa: E402
import sys

if __name__ == "__main__" and not sys.flags.safe_path:
    # The current folder is removed, because a file of the user may have the name of any module.
    del sys.path[0]

import gc
import importlib
import os
import re
import signal
from types import ModuleType

# Signals from a user, a batch queue or a closed terminal that end the process, except those that nohup ignores.
END_SIGNALS = [
    number
    for number in (getattr(signal, name, None) for name in ("SIGINT", "SIGTERM", "SIGHUP"))
    if number is not None and signal.getsignal(number) is not signal.SIG_IGN
]
for end_signal in END_SIGNALS:
    signal.signal(end_signal, lambda *_: os._exit(130))  # used until main() handles interrupts

os.environ["PYTHONSAFEPATH"] = "1"  # child processes do not import from the current folder, either
# The search for pydantic plugins would add 30 ms to every command.
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
# Large computations limit BLAS to one thread anyway; more threads would add 0.1 CPU seconds to small runs.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Garbage collection would take a tenth of the time of a short command. A run of the rig creates 110,000 objects,
# nearly all in imports.
FIRST_GC_THRESHOLD = 200_000  # number of new objects before the first garbage collection
LATER_GC_THRESHOLD = 50_000  # number of new objects before each later collection


def _lower_gc_threshold(phase: str, _) -> None:
    """Lower the threshold of the garbage collector when its first collection starts.

    The collector calls it with the phase "start" or "stop".
    """
    gc.set_threshold(LATER_GC_THRESHOLD, *gc.get_threshold()[1:])
    if phase == "stop":
        gc.callbacks.remove(_lower_gc_threshold)


gc.set_threshold(FIRST_GC_THRESHOLD, *gc.get_threshold()[1:])
gc.callbacks.append(_lower_gc_threshold)


class _LazyMetadata(ModuleType):
    """Placeholder for importlib.metadata, which is imported when an attribute is used.

    pydantic uses only `entry_points` to search for plugins. The modules `email`, `socket` and `calendar`, which the
    import would load, would add a tenth to the response time of every command.
    """

    def __getattr__(self, name: str):
        """Import the module that this object stands for, and return its attribute of this name."""
        if sys.modules.get(self.__name__) is self:
            del sys.modules[self.__name__]
        return getattr(importlib.import_module(self.__name__), name)


if "importlib.metadata" not in sys.modules:
    lazy_metadata = _LazyMetadata("importlib.metadata")
    lazy_metadata.__path__ = [os.path.join(folder, "metadata") for folder in importlib.__path__]
    lazy_metadata.entry_points = lambda **options: lazy_metadata.__getattr__("entry_points")(
        **options
    )
    sys.modules["importlib.metadata"] = importlib.metadata = lazy_metadata

import _thread
import atexit
import threading
from difflib import get_close_matches
from errno import ENAMETOOLONG
from pathlib import Path
from traceback import walk_tb
from typing import Annotated, Literal

from cyclopts import (
    App,
    CycloptsError,
    MissingArgumentError,
    Parameter,
    UnknownCommandError,
    UnknownOptionError,
    UnusedCliTokensError,
)

from . import __version__
from .commands import compare, import_, profile, run, scene, start, study, sweep, view_export
from .commands.shared import CommandExit, UsageError, print_message
from .commands.streams import make_printable, prepare_streams
from .formatting import rewrite_powers_of_ten

# verbs by group: lazily imported module of the function, description, and arguments of an example
VERB_GROUPS = {
    "Start": {
        "demo": (start, "run the bundled example rig", ""),
        "new": (start, "write a scene to start from", "joint -o joint.toml"),
        "check": (scene, "list every mistake in a scene", "joint.toml"),
        "plan": (scene, "size and cost of a run", "joint.toml"),
        "run": (run, "compute results and a page", "joint.toml"),
    },
    "Study": {
        "sweep": (sweep, "run a scene for many values", "tilts.toml"),
        "backbone": (study, "frequency and damping of a mode", "rig.toml --mode axial"),
        "fit": (
            study,
            "fit values to a measurement",
            "joint.toml --to loop.csv --free friction.static=0.1..0.8",
        ),
        "cost": (study, "error against CPU seconds", "rig.toml"),
    },
    "Surfaces": {
        "profile": (profile, "roughness of a trace or a scan", "before.csv"),
        "compare": (compare, "wear between two scans", "before.csv after.csv"),
    },
    "Files": {
        "report": (view_export, "several runs on one page", "out/a out/b -o both.html"),
        "view": (view_export, "image or animation of the pieces", "out/joint -o joint.png"),
        "export": (view_export, "fields for ParaView; histories", "out/joint -o fields.pvd"),
        "import": (import_, "convert laboratory records", "shaker.uff -o record.csv"),
        "mesh": (scene, "the mesh of the pieces", "joint.toml -o pieces.vtu"),
    },
    "About": {
        "doctor": (start, "what is installed", ""),
        "schema": (start, "JSON schema for editors", "-o scene.json"),
        "cite": (start, "BibTeX of a scene's sources", "joint.toml"),
    },
}
# module of the function of each verb
VERBS = {verb: row[0] for verbs in VERB_GROUPS.values() for verb, row in verbs.items()}
# largest number of characters of an example on the same line as its description
MAX_EXAMPLE_WIDTH = 45

# Message if the memory is exhausted
OUT_OF_MEMORY = (
    "out of memory; if a key of the scene sets the size of the largest part of the "
    "memory, `patchfem plan` names this part and the key"
)

app = App(
    name="patchfem",
    version=__version__,
    help_format="plaintext",
    suppress_keyboard_interrupt=False,
    help="friction, vibration and wear of two rubbing surfaces.",
)


def format_verb_overview() -> str:
    """Return the list of verbs in groups, each with an example and a description."""
    lines = [f"patchfem {__version__}: {app.help}"]
    for group, verbs in VERB_GROUPS.items():
        lines += ["", group]
        for verb, (_, description, arguments) in verbs.items():
            example = f"  patchfem {verb} {arguments}"
            if len(example) > MAX_EXAMPLE_WIDTH:
                lines.append(example)
                example = ""
            lines.append(f"{example:<{MAX_EXAMPLE_WIDTH}}  {description}")
    lines += [
        "",
        "`patchfem run --help` explains a verb; `--install-completion` adds completion.",
    ]
    return "\n".join(lines)


def _describe_unexpected_arguments(verb: str, unused: list) -> str:
    """Return the error message for an unknown verb or for arguments, `unused`, that it does not accept."""
    if verb in VERBS or verb in app:
        return f"unexpected '{' '.join(unused)}'; see `patchfem {verb} --help`"
    similar = get_close_matches(verb, VERBS, 1)
    kind = "option" if verb.startswith("-") else "verb"
    advice = f"did you mean `{similar[0]}`? " if similar else ""
    return f"unknown {kind} '{verb}'; {advice}see `patchfem --help`"


def _describe_usage_error(arguments: list, error: UsageError | CycloptsError) -> str:
    """Return the message for arguments that a verb does not accept."""
    if isinstance(error, UnknownCommandError | UnusedCliTokensError):
        return _describe_unexpected_arguments(arguments[0], error.unused_tokens)
    if isinstance(error, MissingArgumentError):
        name = error.argument.name
        need = "needs a value" if name.startswith("-") else "is missing"
        return f"{name} {need}; see `patchfem {arguments[0]} --help`"
    if isinstance(error, UnknownOptionError) and "--" in arguments:
        return f"{error.token.keyword}: no option is possible after --; write it before --"
    return " ".join(str(error).split())


def _describe_removed_option(arguments: list) -> str:
    """Return advice for the first removed option among the arguments; "" if there is none."""
    from .scene.keys.removed import describe_removed

    for argument in arguments[1:]:
        option = argument.partition("=")[0]
        if sentence := describe_removed(f"{arguments[0]} {option}"):
            return sentence
    return ""


def register_verbs(arguments: list) -> None:
    """Register the verb in the arguments with the command-line parser, or all verbs without one.

    `--version` needs no verb, whose modules would be imported.
    """
    if arguments == ["--version"]:
        return
    names_verb = bool(arguments) and arguments[0] in VERBS
    for verb in arguments[:1] if names_verb else VERBS:
        if verb not in app:
            app.command(getattr(VERBS[verb], "import_" if verb == "import" else verb), name=verb)


@app.command(name="--install-completion")
def install_completion(
    *,
    shell: Literal["zsh", "bash", "fish", "powershell"] | None = None,
    output: Annotated[Path | None, Parameter(name=["-o", "--output"])] = None,
):
    """Install completion of commands and options for this shell (bash, zsh, fish).

    Parameters
    ----------
    shell : str, optional
        Shell for which completion is installed; default: the present shell.
    output : Path, optional
        File for the completions; default: the usual file of the shell.
    """
    from cyclopts.completion.install import (
        create_install_completion_command,  # imported here to save 10 ms in other commands
    )

    create_install_completion_command(app.install_completion, True)(shell=shell, output=output)


def main(argv: list | None = None) -> None:
    """Run the command line `argv`, by default that of the process, and end it with an exit code.

    The codes are 0 for success, 2 for invalid input, 3 for missing convergence, 4 for a missing file or an exhausted
    resource, and 130 for an interrupt.
    """
    if argv is not None:
        sys.exit(run_command(argv))
    code = run_command(sys.argv[1:], prepare_streams)
    _exit_quickly(code)
    sys.exit(code)


def _exit_quickly(code: int) -> None:
    """End the process with an exit code, without the clean-up of modules, which takes 50 ms.

    The function returns without effect if other threads run, if a profiler or a debugger is active, or if the output
    cannot be flushed.
    """
    gc.freeze()
    if threading.active_count() > 1 or _is_traced() or sys.flags.inspect:
        return
    try:
        sys.stdout.flush()
        sys.stderr.flush()
        for end_signal in END_SIGNALS:
            signal.signal(
                end_signal, signal.SIG_IGN
            )  # a signal must no longer change the exit code
    except (OSError, ValueError, AttributeError):
        return
    except KeyboardInterrupt:
        os._exit(130)
    atexit._run_exitfuncs()
    os._exit(code)


def _is_traced() -> bool:
    """Return whether a profiler, a debugger or a coverage tool monitors this process.

    Since Python 3.12, most of these tools use sys.monitoring, which has six tool identifiers.
    """
    monitoring = getattr(sys, "monitoring", None)
    has_tool = monitoring is not None and any(map(monitoring.get_tool, range(6)))
    return bool(sys.getprofile() or sys.gettrace() or has_tool)


def run_command(arguments: list[str], before=lambda: None) -> int:
    """Run a command and return its exit code; errors are printed to stderr.

    Parameters
    ----------
    arguments : list of str
        Arguments of the command line after `patchfem`.
    before : callable
        Function that is called first; its errors are printed as well.
    """
    if atomic_write := sys.modules.get(f"{__package__}.disk.atomic_write"):
        atomic_write.forget_placed_paths()
    if arguments[:1] == ["help"]:
        print_message(
            "patchfem: `help` is not a verb; `patchfem --help` lists the verbs, `patchfem run --help` explains the "
            "verb `run`"
        )
        return 2

    # The verb itself; cyclopts parses its options and calls it.
    try:
        before()
        if arguments in ([], ["--help"], ["-h"]):
            print(format_verb_overview(), flush=True)
            return 0
        if removed := _describe_removed_option(arguments):
            raise UsageError(removed)
        register_verbs(arguments)
        try:
            app(arguments, exit_on_error=False, print_error=False)
        except SystemExit as end:  # cyclopts raises SystemExit at the end of a verb and of its help
            if end.code:
                raise
        sys.stdout.flush()
        return 0

    # Mistakes of the user, and what stops a command from outside.
    except (UsageError, CycloptsError) as error:
        print_message(f"patchfem: {_describe_usage_error(arguments, error)}")
        return 2
    except CommandExit as end:
        return end.code
    except KeyboardInterrupt:
        print_message(_describe_interrupt())
        return 130
    except MemoryError:
        print_message(OUT_OF_MEMORY)
        return 4
    except OSError as error:
        print_message(make_printable(_describe_os_error(error)))
        return 4

    # Errors of the package have their exit code; any other one is an internal fault.
    except Exception as error:
        code = _report_error(error)
        if code == 1 and os.environ.get("PATCHFEM_DEBUG"):
            raise
        return code


def _describe_os_error(error: OSError) -> str:
    """Return the message for an error of the operating system."""
    # A query of a deleted working folder raises an error without a file name.
    if isinstance(error, FileNotFoundError) and not error.filename:
        return "patchfem: the working folder no longer exists; change to an existing one"
    advice = "; use a shorter name" if error.errno == ENAMETOOLONG else ""
    return f"{error.filename or 'patchfem'}: {error.strerror or error}{advice}"


def _report_error(error: Exception) -> int:
    """Print the message of an error to stderr, and return the exit code.

    The code is 4 if memory is exhausted, 2 for a scene with mistakes, that of the error for errors of this package,
    and 1 for an internal fault.
    """
    # A shared library does not fit into memory.
    if isinstance(error, ImportError) and "failed to map" in str(error):
        print_message(OUT_OF_MEMORY)
        return 4

    # Only a SceneError has this attribute; an import of the class would load pydantic, which takes 20 ms.
    if hasattr(error, "mistakes"):
        for line in error.mistakes:
            print_message(make_printable(rewrite_powers_of_ten(line)))
        return 2

    # The message of an error of this package may be followed by tables for the scene file.
    code = getattr(error, "code", None)
    if isinstance(code, int) and type(error).__module__.startswith("patchfem"):
        print_message(rewrite_powers_of_ten(str(error)))
        return code

    # Any other error is a fault of the package.
    message = " ".join(f"{type(error).__name__}: {error}".split())
    print_message(f"patchfem: internal fault{_locate_fault(error)}: {message}")
    print_message(
        "patchfem: please report it: send these lines, the command, the scene with its files and what `patchfem "
        "doctor` says to the project's issue tracker; PATCHFEM_DEBUG=1 before the command shows the traceback"
    )
    return 1


def _locate_fault(error: Exception) -> str:
    """Return the code location of an error as " in FILE:LINE (FUNCTION)"; "" if it is unknown.

    The location is that of the innermost frame in this package. An error from another process contains the frames of
    that process in the string of its cause.
    """
    root = Path(__file__).resolve().parent
    location = ""
    frames = [
        (frame.f_code.co_filename, line, frame.f_code.co_name)
        for frame, line in walk_tb(error.__traceback__)
    ]
    frames += re.findall(r'File "(.+)", line (\d+), in (\S+)', str(error.__cause__ or ""))
    for file, line, function in frames:
        path = Path(file).resolve()
        if root in path.parents:
            location = f" in {root.name}/{path.relative_to(root).as_posix()}:{line} ({function})"
    return location


def _describe_interrupt() -> str:
    """Return the message for an interrupted command, with the files that are complete."""
    atomic_write = sys.modules.get(f"{__package__}.disk.atomic_write")
    placed = atomic_write.list_placed_paths() if atomic_write else []
    text = "interrupted; no file was replaced"
    if placed:
        text = f"interrupted; already complete: {', '.join(placed[-3:])}"
        text += " and more" if len(placed) > 3 else ""
    if atomic_write:
        for folder in dict.fromkeys(atomic_write.RESUMABLE_FOLDERS):
            if folder.is_dir():
                path = atomic_write.format_path(folder)
                text += f"; to continue {path}, add --resume to the command"
    return text


def _repeat_interrupt(unraisable) -> None:
    """Raise an interrupt again that Python has discarded.

    Python discards exceptions in callbacks, such as those of LLVM during a compilation.

    `unraisable` describes the discarded exception, as for `sys.unraisablehook`.
    """
    if unraisable.exc_type is not KeyboardInterrupt:
        sys.__unraisablehook__(unraisable)
        return
    while True:
        # On a busy machine, the interrupt may arrive before the timer thread has started, and would be lost again.
        try:
            timer = threading.Timer(0.05, _thread.interrupt_main, END_SIGNALS[:1])
            timer.daemon = True
            timer.start()
            return
        except KeyboardInterrupt:
            continue


sys.unraisablehook = _repeat_interrupt
for end_signal in END_SIGNALS:  # must be the last statement before main(), which handles interrupts
    signal.signal(end_signal, signal.default_int_handler)

if __name__ == "__main__":
    main()
