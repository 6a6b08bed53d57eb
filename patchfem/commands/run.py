"""The command that runs a scene and writes its results folder."""

import json
import shlex
import sys
from pathlib import Path

from ..disk import atomic_write
from ..export import folder, summary
from ..export.pages import driven, released, sentences
from ..runs import plan
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
    load_scene,
    note,
    print_message,
    progress_bar,
)


def run(
    scene: Path,
    /,
    *,
    out: Out = None,
    set_: Sets = (),
    json_: Json = False,
    resume: flag_option(
        "continue an interrupted run; possible with [wear] and for a run that is integrated in time"
    ) = False,
    fresh: flag_option(
        "compute the stiffness of the pieces again instead of taking it from the cache"
    ) = False,
    no_page: NoPage = False,
    quiet: Quiet = False,
    verbose: flag_option(
        "print also the computing time of each part of the run", "-v", "--verbose"
    ) = False,
):
    """Run SCENE and write its results folder, by default out/<scene name>.

    Example: patchfem run rig.toml --set "drive.acceleration=6 g" -o out/six
    """
    talk = (lambda text: None) if quiet else print_message
    run_plan = plan.plan(load_scene(scene, set_))
    if resume and not folder.saves_state(run_plan):
        raise UsageError(
            "run --resume: only a run with [wear] on a patch or a run that is integrated in time saves its "
            "state; run the scene again without --resume"
        )
    if verbose:
        compiles = plan.describe_compile_time(run_plan.compile_seconds)
        talk(
            f"about {run_plan.seconds:.1f} s of computing time{compiles}, {run_plan.steps} steps, engine {run_plan.engine}"
        )
    target = choose_folder(out, run_plan.model.source.path.stem)
    if resume and folder.is_complete(run_plan, target):
        talk(
            f"{target}: this run is already complete, nothing is left to resume; to run it again, leave out --resume"
        )
        run_summary = summary.read_summary(target / "summary.json")
        if json_:
            print(json.dumps(run_summary, ensure_ascii=False), flush=True)
        if run_summary["outcome"] == "not_converged":
            raise NotConvergedExit
        return
    with progress_bar(quiet or json_) as progress:
        stored_run = folder.run_into(run_plan, target, talk, progress, fresh, resume)
    run_summary = stored_run.summary
    try:
        if quiet and not json_:
            pass
        elif json_:
            print(json.dumps(run_summary, ensure_ascii=False), flush=True)
        else:
            _print_answer(
                stored_run, target, verbose, " (without report.html: --no-page)" if no_page else ""
            )
        if not no_page:
            _draw(stored_run, target)
    except KeyboardInterrupt:
        print_message(
            f"interrupted while the page was drawn; the results in {target} are complete except for report.html"
        )
        raise CommandExit(130) from None
    if run_summary["outcome"] == "not_converged":
        # A quiet run prints only these warnings.
        for text in run_summary["warnings"] if quiet else ():
            print_message(f"warning: {text}")
        raise NotConvergedExit


def _draw(stored_run, target: Path) -> None:
    """Write the page of a run after its results, so that an error in the page does not lose them."""
    try:
        folder.write_run_page(stored_run, target)
    except (OSError, MemoryError, atomic_write.WriteError) as error:
        reason = (
            str(error)
            if isinstance(error, atomic_write.WriteError)
            else f"{target / 'report.html'}: {getattr(error, 'strerror', None) or 'out of memory'}"
        )
        print_message(f"{reason}; the results are complete except for the page")
        raise CommandExit(4) from None


def _print_answer(stored_run, target: Path, verbose: bool, page: str) -> None:
    """Print the verdict, then the tolerance, all measures in groups, notes, and the paths."""
    run_summary = stored_run.summary
    if run_summary["title"]:
        sets = stored_run.result.plan.model.source.sets
        print(
            f"{run_summary['title']}{f'; changed: {driven.list_changed_keys(sets)}' if sets else ''}"
        )
    print(f"{run_summary['outcome']}: {sentences.verdict_sentence(run_summary)}")
    if text := sentences.headline_sentence(
        run_summary,
        summary.count_cycles(stored_run.result),
        released=released.describe_release(stored_run.result),
    ):
        print(text)
    sys.stdout.flush()
    if text := sentences.tolerance_sentence(stored_run.result):
        print(text, flush=True)
    for text in run_summary["warnings"]:
        print_message(f"warning: {text}")
    print(
        "\n".join(
            sentences.format_measures(
                run_summary["measures"], run_summary["numerics"].get("engine", "")
            )
        ),
        flush=True,
    )
    for text in run_summary["notes"]:
        note(text)
    if verbose:
        print_message(
            "wall-clock seconds: "
            + ", ".join(f"{k} {v:.3f}" for k, v in run_summary["seconds"].items())
        )
    print(f"results: {target}{page}")
    if (target / "fields.vtkhdf").is_file():
        quoted_folder = shlex.quote(str(target))
        print(
            f"fields: {target / 'fields.vtkhdf'} for ParaView 5.13 or newer; for older versions run `patchfem export "
            f"{quoted_folder} -o {shlex.quote(str(target / 'fields.pvd'))}`"
        )
    if inside := sorted(target.glob("interfaces/*")):
        print(
            f"fields of each interface: in {target / 'interfaces'}; to show those of the first interface, run "
            f"`patchfem view {shlex.quote(str(inside[0]))}`"
        )
    sys.stdout.flush()
