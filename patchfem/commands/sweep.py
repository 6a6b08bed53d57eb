"""The command that runs a scene for many values of its keys."""

import json
import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from threading import Event, Thread
from time import perf_counter
from typing import Annotated, Literal, NamedTuple

from cyclopts import Parameter

from .. import core
from ..campaigns.sweeps import executors, parse_request
from ..campaigns.sweeps import sweep as sweeping
from ..export.sweeps import manifest, run
from ..scene import axes
from .shared import (
    CommandExit,
    Json,
    NoPage,
    NotConvergedExit,
    Out,
    Quiet,
    Sets,
    UsageError,
    choose_folder,
    flag_option,
    note,
    print_message,
    repeated_option,
    text_option,
)

MAX_PRINTED_MESSAGES = 5  # largest number of messages of failed cases that are printed
BYTES_PER_CASE = 1000  # size of a lumped case in sweep.csv and sweep.nc [bytes]


@Parameter(name="*")
@dataclass
class CaseOptions:
    """Options that select the cases."""

    over: repeated_option(
        "key and its values: table.key=v1,v2,... or, for 9 values in a range, table.key=1 mm..9 mm:9 (:9log "
        "or :9lin fixes the spacing); may be repeated",
        "--over",
    ) = ()
    cases: Annotated[
        Path | None,
        Parameter(
            name="--cases",
            help="file of cases, such as cases.csv: one column "
            "`table.key [unit]` for each key, one row for each "
            "case; or the sweep.csv of another sweep",
        ),
    ] = None
    random: Annotated[
        int,
        Parameter(
            name="--random",
            show_default=False,
            help="number of random cases, such as 200, drawn from the ranges in --over, such as 1 "
            "mm..9 mm",
        ),
    ] = 0
    sobol: Annotated[
        int,
        Parameter(
            name="--sobol",
            show_default=False,
            help="number of cases from Sobol's sequence, such as 256; a power of 2 is best",
        ),
    ] = 0
    seed: Annotated[int, Parameter(name="--seed", help="seed of the random cases, such as 1")] = 0
    of: text_option(
        "measure that the printed answer and the first picture of the page show, such as equivalent_damping",
        "--of",
    ) = ""

    def selects_cases(self) -> bool:
        """Return whether any option selects cases."""
        return bool(self.over or self.cases or self.random or self.sobol)

    def words(self, *more: str) -> tuple:
        """Return the options that select the cases, as strings that identify the selection."""
        random_options = f"draw={self.random},{self.sobol},{self.seed}"
        return (
            *self.over,
            "" if self.cases is None else str(self.cases),
            random_options,
            f"of={self.of}",
            *more,
        )

    def request(self):
        """Return the request for cases; raise UsageError if the options are incompatible."""
        if self.random and self.sobol:
            raise UsageError("--random and --sobol: use only one of them")
        if min(self.random, self.sobol, self.seed) < 0:
            raise UsageError("--random, --sobol and --seed must be whole numbers >= 0")
        if (self.random or self.sobol) and not self.over:
            raise UsageError(
                "--random and --sobol draw values from ranges; give each range by --over table.key=low..high"
            )
        return parse_request.Request(
            self.over, self.cases, self.random or self.sobol, bool(self.sobol), self.seed, self.of
        )


@Parameter(name="*")
@dataclass
class WorkerOptions:
    """Options of the workers: number of processes, executor, and shard of the cases."""

    jobs: Annotated[
        int, Parameter(name=["-j", "--jobs"], help="number of processes on this machine, such as 4")
    ] = 1
    executor: text_option(
        "where the cases run: dask (a cluster on this machine) or dask:ADDRESS, such as "
        "dask:tcp://10.0.0.2:8786",
        "--executor",
    ) = ""
    shard: text_option(
        "run only one part of the cases, such as 3/40 for the third of 40 parts; all parts write into the "
        "same folder",
        "--shard",
    ) = ""
    collect: flag_option(
        "run no case, only write the tables of a sweep whose cases are all done", "--collect"
    ) = False

    def part(self) -> tuple | None:
        """Return (i, n) of a shard, or None if there is no shard."""
        if not self.shard:
            return None
        i, _, n = self.shard.partition("/")
        if not (i.isdecimal() and n.isdecimal() and 1 <= int(i) <= int(n)):
            raise UsageError(f"--shard {self.shard}: must be i/n with i from 1 to n, such as 3/40")
        return int(i), int(n)


def sweep(
    scene: Path,
    /,
    *,
    what: CaseOptions | None = None,
    by: WorkerOptions | None = None,
    out: Out = None,
    set_: Sets = (),
    resume: flag_option("continue an interrupted sweep in this folder") = False,
    keep: Annotated[
        Literal["none", "summaries", "results", "pages"] | None,
        Parameter(
            help="files to keep of each case in addition to its row in the tables, such as results; possible values: "
            "none, summaries, results, pages (results and report.html); default: summaries for up to 1000 "
            "cases, none for more cases"
        ),
    ] = None,
    no_page: NoPage = False,
    json_: Json = False,
    quiet: Quiet = False,
):
    """Run SCENE for all combinations of the values in --over, or of the values in its table [sweep]. Write sweep.csv,
    sweep.nc and report.html; the default folder is out/<scene name>-sweep.

    Example: patchfem sweep rig.toml --over "contact.tilt.angle=1e-6 rad..1e-2 rad:9" -j 2
    """
    if no_page and keep == "pages":
        raise UsageError(
            "sweep: --no-page leaves out every report.html, but --keep pages writes one for each case; use "
            "only one of these options"
        )
    by = by or WorkerOptions()
    start_time = perf_counter()
    part = by.part()
    target = choose_folder(out, f"{scene.stem}-sweep")
    printed = "faults" if quiet else "words"
    if json_:
        printed = "json"
    output = OutputOptions(target, not no_page, printed, start_time)
    request_hash = ""
    if not (by.collect or part or keep not in (None, "none")):
        request_words = (what or CaseOptions()).words(*set_, f"page={not no_page}")
        request_hash = manifest.hash_request(scene, request_words, what and what.cases)
    if resume and (answer := manifest.read_manifest(target, request_hash)):  # the sweep is complete
        _print_results(answer["cases"]["count"], {}, answer, output)
        return
    sweep_scene, cases = parse_request.read_sweep(scene, set_, (what or CaseOptions()).request())
    if by.collect:
        _print_stored_results(run.collect_shards(sweep_scene, cases, target, not no_page), output)
        return
    if not quiet:
        for text in axes.describe_ranges(what.over if what else ()):
            note(text)
        for text in (
            parse_request.warn_of_invalid_cases(sweep_scene, cases),
            sweep_scene.note_bolted_joint(),
        ):
            if text:
                note(text)
    line = Progress(quiet)
    try:
        place = run.SweepTarget(target, resume, keep or "", part, not no_page)
        results = run.sweep_into(
            sweep_scene,
            cases,
            place,
            executors.make_executor(by.executor, by.jobs),
            None if quiet else print_message,
            line,
        )
    except (KeyboardInterrupt, core.Missing) as why:
        line.end()
        if isinstance(why, core.Missing) and not line.done:
            raise
        print_message(
            f"{str(why) or 'interrupted'}; {line.done} of {len(cases)} cases are kept; continue with: patchfem "
            f"{shlex.join([word for word in sys.argv[1:] if word != '--resume'])} --resume"
        )
        raise CommandExit(getattr(why, "code", 130)) from None
    finally:
        line.end()
    if part is not None:
        if json_ or not quiet:
            print(
                json.dumps({"cases": line.done, "folder": str(target)})
                if json_
                else f"shard {by.shard}: {line.done} cases are in {target}; when all shards are done, run the sweep with "
                "--collect"
            )
        return
    if request_hash and not results.messages and place.kept_files(len(cases)) == "none":
        manifest.write_manifest(target, request_hash)
    _print_stored_results(results, output)


class OutputOptions(NamedTuple):
    """Options for printing the results of a sweep.

    target: its folder; page: whether it has one; tells: "json", "words", or only its "faults";
    begin: time at its start [s].
    """

    target: Path
    page: bool
    tells: str
    begin: float


class Progress:
    """Display of the completed cases and the remaining time on stderr.

    On a terminal it is a line that is updated, elsewhere a line every WAIT seconds. While no case
    is complete, the elapsed time is shown after WAIT seconds and then after intervals of twice the
    length each.
    """

    WAIT = 10.0

    def __init__(self, silent: bool):
        self.silent = silent
        self.done = 0
        self.begin = perf_counter()
        self.text = ""
        self.over = Event()
        self.shown_at = self.begin
        self.open = sys.stderr.isatty()

    def __call__(self, done: int, total: int, seconds_left: float | None) -> None:
        if not self.text and not self.silent:
            Thread(target=self._show_waiting_time, daemon=True).start()
        self.text = f"{done}/{total} cases"
        self.done = done
        if not self.silent and perf_counter() - self.shown_at >= (0.2 if self.open else self.WAIT):
            self._show(
                f"{self.text}, {sweeping.format_duration(seconds_left)} left"
                if seconds_left is not None
                else self.text
            )

    def _show_waiting_time(self) -> None:
        """Show the elapsed time while no case is complete."""
        wait = self.WAIT
        while not self.over.wait(wait):
            if perf_counter() - self.shown_at >= wait:
                self._show(
                    f"{self.text}, {sweeping.format_duration(perf_counter() - self.begin)} so far"
                )
                wait *= 2

    def _show(self, text: str) -> None:
        """Show a line on stderr."""
        self.shown_at = perf_counter()
        print(
            f"\r\x1b[K{text}" if self.open else text,
            end="" if self.open else "\n",
            file=sys.stderr,
            flush=True,
        )

    def end(self) -> None:
        """Clear the line and stop the display."""
        self.over.set()
        if self.open and not self.silent:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


def _print_stored_results(results, output: OutputOptions) -> None:
    """Print the results of a sweep that are stored in its folder."""
    _print_results(
        len(results),
        results.messages,
        json.loads((output.target / "sweep.json").read_bytes()),
        output,
    )


def _print_results(number: int, messages: dict, answer: dict, output: OutputOptions) -> None:
    """Print the results of a sweep, beginning with its main result.

    Parameters
    ----------
    number : int
        Number of cases.
    messages : dict
        Messages of failed cases.
    answer : dict
        Content of sweep.json.
    output : OutputOptions
    """
    target = output.target
    failed = sorted(messages)
    counts = answer["cases"]["outcomes"]
    if output.tells == "json":
        print(
            json.dumps(
                {
                    "cases": number,
                    "outcomes": counts,
                    "failed": len(failed),
                    "answer": answer["answer"],
                    "over_tolerance": answer["cases"]["over_tolerance"],
                    "folder": str(target),
                    "seconds": round(perf_counter() - output.begin, 3),
                },
                ensure_ascii=False,
            )
        )
    elif output.tells == "words":
        outcome_counts = ", ".join(f"{count} {name}" for name, count in counts.items())
        first, *others = answer["sentences"] or [""]
        for sentence in (first, f"{number} case{'s' * (number != 1)}: {outcome_counts}", *others):
            if sentence:
                print(sentence)
        if output.page:
            print(f"page: {target / 'report.html'}")
        tables = [target / name for name in ("sweep.csv", "sweep.nc")]
        if tables[0].is_file():
            print(f"results: {tables[0]} {tables[1]}")
        else:
            print(
                f"results: {target / 'sweep.json'}; sweep.csv and sweep.nc are not written, because they would take "
                f"about {1e-6 * BYTES_PER_CASE * number:.0f} MB; to write them, run the same command with --collect"
            )
    sys.stdout.flush()
    cases_by_message = {}
    for case in failed:
        cases_by_message.setdefault(messages[case], []).append(case + 1)
    for text, numbers in list(cases_by_message.items())[:MAX_PRINTED_MESSAGES]:
        print_message(
            f"case {numbers[0]}{f' and {len(numbers) - 1} more' * (len(numbers) > 1)}: {text}"
        )
    if len(cases_by_message) > MAX_PRINTED_MESSAGES:
        print_message("the messages of all failed cases are in sweep.csv")
    if len(failed) == number:
        raise UsageError("sweep: no case could be run")
    if failed or "not_converged" in counts:
        raise NotConvergedExit
