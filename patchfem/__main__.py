"""The command line. Nothing scientific is imported until a verb needs it."""

# ruff: noqa: E402
import sys

if __name__ == "__main__" and not sys.flags.safe_path:
    del sys.path[
        0
    ]  # the current folder, in which a file of the user may have the name of any module

import gc
import importlib
import os
import re
import signal
from types import ModuleType

# Signals that end the process: from a user, a batch queue or a closed terminal, unless nohup ignores the last.
ENDINGS = [
    one
    for one in (getattr(signal, name, None) for name in ("SIGINT", "SIGTERM", "SIGHUP"))
    if one is not None and signal.getsignal(one) is not signal.SIG_IGN
]
for one in ENDINGS:
    signal.signal(one, lambda *_: os._exit(130))  # the process ends at once until main() runs

os.environ["PYTHONSAFEPATH"] = "1"  # child processes do not import from the current folder either
# The search for plugins costs every command 30 ms.
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
# All large computations limit BLAS to one thread; more threads would only cost a small run 0.1 CPU seconds.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Number of new objects before the first garbage collection and before later ones, because collections take a tenth of
# the time of a short command. A run of the rig ends with 110,000 objects, nearly all from imports.
FIRST, LATER = 200_000, 50_000


def _searched(phase: str, _) -> None:
    """Lower the threshold of the garbage collector once its first collection starts."""
    gc.set_threshold(LATER, *gc.get_threshold()[1:])
    if phase == "stop":
        gc.callbacks.remove(_searched)


gc.set_threshold(FIRST, *gc.get_threshold()[1:])
gc.callbacks.append(_searched)


class _Later(ModuleType):
    """Stand-in for importlib.metadata that imports it when an attribute is used.

    pydantic only uses its `entry_points` to search for plugins, and its imports of `email`, `socket` and `calendar`
    would cost every command a tenth of the time that an answer may take.
    """

    def __getattr__(self, name: str):
        if sys.modules.get(self.__name__) is self:
            del sys.modules[self.__name__]
        return getattr(importlib.import_module(self.__name__), name)


if "importlib.metadata" not in sys.modules:
    later = sys.modules["importlib.metadata"] = importlib.metadata = _Later("importlib.metadata")
    later.__path__ = [os.path.join(one, "metadata") for one in importlib.__path__]
    later.entry_points = lambda **of: later.__getattr__("entry_points")(**of)

import _thread
import atexit
import threading
from difflib import get_close_matches
from errno import ENAMETOOLONG
from pathlib import Path
from traceback import walk_tb
from typing import Annotated, Literal

from cyclopts import App, CycloptsError, Parameter

from . import __version__
from .commands import compare, import_, profile, run, scene, start, study, sweep, view_export
from .commands.shared import Ended, Refused, say
from .commands.streams import plain, ready
from .formatting import rewrite_powers_of_ten

# group -> verb -> (the module of its function, loaded where the verb is asked for; what it does; words of an example)
SCREEN = {
    "Start": {
        "demo": (start, "run the bundled example rig", ""),
        "new": (start, "write a scene to start from", "joint -o joint.toml"),
        "check": (scene, "name every mistake", "joint.toml"),
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
        "view": (view_export, "a picture or a film of the pieces", "out/joint -o joint.png"),
        "export": (view_export, "fields for ParaView; histories", "out/joint -o play.py"),
        "import": (import_, "records of a laboratory", "shaker.uff -o record.csv"),
        "mesh": (scene, "the mesh of the pieces", "joint.toml -o pieces.vtu"),
    },
    "About": {
        "doctor": (start, "what is installed", ""),
        "schema": (start, "JSON schema for editors", "-o scene.json"),
        "cite": (start, "BibTeX of a scene's sources", "joint.toml"),
    },
}
VERBS = {verb: row[0] for verbs in SCREEN.values() for verb, row in verbs.items()}

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


def first_screen() -> str:
    """Return the list of verbs in groups, each with an example and a description."""
    lines = [f"patchfem {__version__}: {app.help}"]
    for group, verbs in SCREEN.items():
        lines += ["", group]
        for verb, (_, what, example) in verbs.items():
            shown = f"  patchfem {verb} {example}"
            lines += [f"{shown:<45}  {what}"] if len(shown) <= 45 else [shown, f"{'':47}{what}"]
    return "\n".join(
        [
            *lines,
            "",
            "`patchfem run --help` explains a verb; `--install-completion` adds completion.",
        ]
    )


def _unexpected(verb: str, left: list) -> str:
    """Return the message on arguments that a verb does not take, or on an unknown verb."""
    if verb in VERBS or verb in app:
        return f"unexpected '{' '.join(left)}'; see `patchfem {verb} --help`"
    near, what = get_close_matches(verb, VERBS, 1), "option" if verb.startswith("-") else "verb"
    return f"unknown {what} '{verb}'; {f'did you mean `{near[0]}`? ' if near else ''}see `patchfem --help`"


def _removed_option(words: list) -> str:
    """Return what replaces the first removed option among the arguments; "" if there is none."""
    from .scene.keys.removed import describe_removed_option

    for word in words[1:]:
        option = word.partition("=")[0]
        sentence = describe_removed_option(words[0], option, f"{words[0]} {option}")
        if word.startswith("--") and sentence:
            return sentence
    return ""


def known(words: list) -> None:
    """Register the requested verb with the command line, or all verbs if it names none."""
    for verb in words[:1] if words[:1] and words[0] in VERBS else VERBS:
        if verb not in app:
            app.command(getattr(VERBS[verb], "import_" if verb == "import" else verb), name=verb)


@app.command(name="--install-completion")
def completion(
    *,
    shell: Literal["zsh", "bash", "fish", "powershell"] | None = None,
    output: Annotated[Path | None, Parameter(name=["-o", "--output"])] = None,
):
    """Install completion of commands and options for this shell (bash, zsh, fish).

    Parameters ---------- shell : Literal["zsh", "bash", "fish", "powershell"] | None Shell for which completion is
    installed; default: the present shell. output : Path | None File for the completions; default: the usual file of the
    shell.
    """
    from cyclopts.completion.install import (
        create_install_completion_command,  # 10 ms of every command otherwise
    )

    create_install_completion_command(app.install_completion, True)(shell=shell, output=output)


def main(argv: list | None = None) -> None:
    """Run the command line and end the process with its exit code.

    The codes are 0 done, 2 bad input, 3 not converged, 4 missing or out of a resource, and 130 interrupted.
    """
    if argv is not None:
        sys.exit(run_command(argv))
    code = run_command(sys.argv[1:], ready)
    _leave(code)
    sys.exit(code)


def _leave(code: int) -> None:
    """End the process without the clean-up of its modules, which takes 50 ms.

    The function returns, so the process ends as usual, if other threads run, if a profiler or a debugger is active, or
    if the output cannot be flushed.
    """
    gc.freeze()
    if threading.active_count() > 1 or _watched() or sys.flags.inspect:
        return
    try:
        sys.stdout.flush()
        sys.stderr.flush()
        for one in ENDINGS:
            signal.signal(one, signal.SIG_IGN)  # a signal must not change the exit code now
    except (OSError, ValueError, AttributeError):
        return
    except KeyboardInterrupt:
        os._exit(130)
    atexit._run_exitfuncs()
    os._exit(code)


def _watched() -> bool:
    """Return whether a profiler, a debugger or a coverage tool watches this process.

    From Python 3.12 on, most of them use sys.monitoring, which has six tool numbers.
    """
    seen = getattr(sys, "monitoring", None)
    return bool(sys.getprofile() or sys.gettrace() or (seen and any(map(seen.get_tool, range(6)))))


def run_command(words: list, before=lambda: None) -> int:
    """Run a command and return its exit code; errors are printed to stderr.

    Parameters
    ----------
    words : list
        Words of the command line after `patchfem`.
    before : callable
        Called first; its errors are printed in the same way.
    """
    if there := sys.modules.get(f"{__package__}.disk.atomic_write"):
        there.forget_placed_paths()
    if words[:1] == ["help"]:
        say(
            "patchfem: `help` is not a verb; `patchfem --help` lists the verbs, `patchfem run --help` explains the "
            "verb `run`"
        )
        return 2
    try:
        before()
        if words in ([], ["--help"], ["-h"]):
            print(first_screen(), flush=True)
            return 0
        if removed := _removed_option(words):
            raise Refused(removed)
        known(words)
        try:
            app(words, exit_on_error=False, print_error=False)
        except SystemExit as end:  # cyclopts ends a verb and its help by SystemExit
            if end.code or isinstance(end.__context__, BrokenPipeError):
                raise
        sys.stdout.flush()
        return 0
    except (Refused, CycloptsError) as error:
        left = getattr(error, "unused_tokens", None)
        said = _unexpected(words[0], left) if left else str(error)
        say(plain(f"patchfem: {' '.join(said.split())}"))
        return 2
    except Ended as end:
        return end.code
    except KeyboardInterrupt:
        say(_interrupted())
        return 130
    except MemoryError:
        say(OUT_OF_MEMORY)
        return 4
    except SystemExit as end:  # the help ends in this way if its reader closes the pipe
        if isinstance(end.__context__, BrokenPipeError):
            return 0
        raise
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        # the error comes from a query of the working folder, which names no file
        gone = isinstance(error, FileNotFoundError) and not error.filename
        say(
            plain(
                "patchfem: the working folder no longer exists; change to an existing one"
                if gone
                else f"{error.filename or 'patchfem'}: {error.strerror or error}"
                f"{'; use a shorter name' * (error.errno == ENAMETOOLONG)}"
            )
        )
        return 4
    except Exception as error:
        # a shared library does not fit into memory
        if isinstance(error, ImportError) and "failed to map" in str(error):
            say(OUT_OF_MEMORY)
            return 4
        # this is a SceneError; importing the class would import pydantic, which takes 20 ms
        if hasattr(error, "mistakes"):
            for line in error.mistakes:
                say(plain(rewrite_powers_of_ten(line)))
            return 2
        code = getattr(error, "code", None)
        if isinstance(code, int) and type(error).__module__.startswith("patchfem"):
            say(plain(rewrite_powers_of_ten(str(error))))
            return code
        said = " ".join(f"{type(error).__name__}: {error}".split())
        say(plain(f"patchfem: internal fault{_place_of_fault(error)}: {said}"))
        say(
            "patchfem: please report it: send these lines, the command, the scene with its files and what `patchfem "
            "doctor` says to the project's issue tracker; PATCHFEM_DEBUG=1 before the command shows the traceback"
        )
        if os.environ.get("PATCHFEM_DEBUG"):
            raise
        return 1


def _place_of_fault(error: Exception) -> str:
    """Return " in FILE:LINE (FUNCTION)" of the innermost frame of this package, or "".

    An error of another process carries the frames of that process as the string of its cause.
    """
    root, place = Path(__file__).resolve().parent, ""
    frames = [
        (frame.f_code.co_filename, line, frame.f_code.co_name)
        for frame, line in walk_tb(error.__traceback__)
    ]
    frames += re.findall(r'File "(.+)", line (\d+), in (\S+)', str(error.__cause__ or ""))
    for file, line, function in frames:
        path = Path(file).resolve()
        if root in path.parents:
            place = f" in {root.name}/{path.relative_to(root).as_posix()}:{line} ({function})"
    return place


def _interrupted() -> str:
    """Return the message on an interrupt, with the files that are complete."""
    there = sys.modules.get(f"{__package__}.disk.atomic_write")
    placed = there.list_placed_paths() if there else []
    kept = [one for one in dict.fromkeys(there.RESUMABLE_FOLDERS) if one.is_dir()] if there else []
    text = "interrupted; no file was replaced"
    if placed:
        text = f"interrupted; already complete: {', '.join(placed[-3:])}" + " and more" * (
            len(placed) > 3
        )
    return text + "".join(
        f"; to continue {there.format_path(one)}, add --resume to the command" for one in kept
    )


def _once_more(lost) -> None:
    """Repeat an interrupt that was lost where Python drops exceptions.

    An example is a callback that LLVM calls during a compilation.
    """
    if lost.exc_type is not KeyboardInterrupt:
        sys.__unraisablehook__(lost)
        return
    while True:
        # on a busy machine the interrupt may come before the timer thread has started, and would be lost again
        try:
            again = threading.Timer(0.05, _thread.interrupt_main, ENDINGS[:1])
            again.daemon = True
            again.start()
            return
        except KeyboardInterrupt:
            continue


sys.unraisablehook = _once_more
for one in ENDINGS:  # the last statement before main(), whose `try` handles the interrupt
    signal.signal(one, signal.default_int_handler)

if __name__ == "__main__":
    main()
