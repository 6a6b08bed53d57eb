"""A run that writes its results folder: fields, answer and page; a page that fails does not lose the results."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import NamedTuple

from .. import __version__
from ..core import NotConverged, PatchfemError
from ..runs.plan import Plan
from ..runs.results.interfaces import PressedFace
from ..runs.results.result import Result, shorten_file_names
from ..runs.run import StateFile, hash_scene_files, is_march, run
from . import page, store
from .answer import Answer
from .fields import vtkhdf
from .folder import WEAR_STATE_FILE, Folder, list_states
from .runs import make_run_answer

INTERFACES_FOLDER = "interfaces"


class WrittenRun(NamedTuple):
    """Finished run whose results are on disk.

    - answer: answer of the run.
    - result: result of the run.
    - page_fault: why the page was not drawn, or None if it was.
    """

    answer: Answer
    result: Result
    page_fault: BaseException | None = None


def run_into(
    run_plan: Plan,
    target: Path,
    report: Callable[[str], None] | None = None,
    progress: Callable[[float], None] | None = None,
    *,
    resume: bool = False,
    has_page: bool = True,
) -> WrittenRun:
    """Run a plan and write its results into a folder.

    The folder is locked first. An older results folder is replaced only when the new one is complete, and a folder with
    other files is refused before anything runs. If the motion does not converge, the patch that was pressed before is
    written, with the outcome not_converged.

    Parameters
    ----------
    run_plan : Plan
        What the run computes.
    target : Path
        Results folder.
    report, progress : callable, optional
        Functions that take a line of text and the completed fraction.
    resume : bool
        Whether to continue from the saved state.
    has_page : bool
        Whether report.html is written.

    Raises
    ------
    PatchfemError
        If there is no state to continue from, or if the folder has other files.
    NotConverged
        If the motion does not converge and there is no pressed patch.
    """
    with Folder(target, resume) as folder:
        if folder.dropped and report is not None:
            report(folder.dropped)
        state_file = None
        if saves_state(run_plan):
            state_file = StateFile(folder.path / WEAR_STATE_FILE, __version__, resume)
        try:
            result = run(run_plan, report, progress, state_file=state_file)
        except NotConverged as error:
            result = _extract_partial_result(error)
        answer = write_results(result, folder.path)
        fault = draw_page(folder.path) if has_page else None
    return WrittenRun(answer, result, fault)


def draw_page(folder: Path) -> BaseException | None:
    """Write report.html into the folder of a run; return the error that prevents it, or None.

    The results of a long run are kept without their page.
    """
    try:
        page.write_report(folder)
    except BaseException as fault:
        return fault
    return None


def _extract_partial_result(error: NotConverged) -> Result:
    """Return what a run that did not converge has computed, with the reason as a warning.

    NotConverged is raised again if it has computed nothing.
    """
    result = error.partial_result
    if result is None:
        raise NotConverged(
            f"{error}; the run stopped before any result, so there is no results folder"
        ) from None
    reason = shorten_file_names([str(error)], result.plan.model.source.path)
    return result.with_changes(warnings=[*reason, *result.warnings])


def saves_state(run_plan: Plan) -> bool:
    """Return whether the run of a plan saves its state for a later resume."""
    wears = run_plan.model.wear is not None and run_plan.model.patch is not None
    return wears or is_march(run_plan)


def is_complete(run_plan: Plan, target: Path) -> bool:
    """Return whether a folder contains the complete run of a plan.

    It is False for a folder with the state of an interrupted run. PatchfemError if the folder contains the complete run of
    another scene or of another version, or if a file that the scene names is younger than the run.
    """
    if list_states(target.parent / f"{target.name}.partial"):
        return False
    try:
        version = store.read_summary(target).patchfem
        text = (target / store.SCENE_FILE).read_text("utf-8")
    except (OSError, PatchfemError):
        return False
    # The stiffness of a solved joint may be that of a finer mesh than that of the plan.
    source = run_plan.model.source
    solved = tuple(f"{key.rpartition('.')[2]} = " for key in source.writer.joint)
    lines = [one for one in text.splitlines() if not one.startswith(solved)]
    planned = source.write_resolved(target).splitlines()
    planned = [one for one in planned if not one.startswith(solved)]
    end = (target / store.SUMMARY_FILE).stat().st_mtime
    files = [source.path.parent / name for name, _ in hash_scene_files(source)]
    is_older = all(path.stat().st_mtime <= end for path in files)
    if version == __version__ and lines == planned and is_older:
        return True
    raise PatchfemError(
        f"{target}: this folder has no interrupted run but the complete run of another scene or version, or a file that the "
        "scene names has changed since then; name another folder with -o, or run without --resume to replace that run"
    )


def write_results(result: Result, folder: Path, case: dict[str, str] | None = None) -> Answer:
    """Write all files of a run, except its page, into an existing folder, and return its answer.

    Parameters
    ----------
    result : Result
        Finished run; notes on its files are added to it.
    folder : Path
        Existing folder.
    case : dict of str to str, optional
        Swept keys with their values as written, if the run is a case of a sweep.
    """
    start_time = process_time()
    notes = result.notes
    if result.patch is not None:
        vtkhdf.write_fields(result, folder / store.FIELDS_FILE)
    # Fields of further interfaces are not written
    for face in result.faces[:6]:
        face_notes = _write_face(result, face, folder / INTERFACES_FOLDER / face.folder)
        notes += [f"interface {face.name}: {note}" for note in face_notes]
    result.seconds["files"] = process_time() - start_time
    answer = make_run_answer(result)
    if case is not None:
        answer = replace(answer, details=answer.details | {"case": case})
    store.write_answer(answer, folder)
    return answer


def _write_face(result: Result, face: PressedFace, folder: Path) -> list[str]:
    """Write the fields of one interface of a run into a folder of its own, and return notes on them.

    `face` has the patch and the fields of the interface. The folder is made.
    """
    folder.mkdir(parents=True, exist_ok=True)
    face_result = result.with_changes(
        plan=replace(result.plan, model=face.model),
        patch=face.patch,
        fields=face.fields,
        notes=[],
    )
    vtkhdf.write_fields(face_result, folder / store.FIELDS_FILE)
    return face_result.notes


def save_run(result: Result, folder: Path) -> Answer:
    """Write the results folder of a finished run with its page; an older results folder is replaced.

    What prevents the page is raised when the results are in place.
    """
    with Folder(folder) as claimed:
        answer = write_results(result, claimed.path)
        fault = draw_page(claimed.path)
    if fault is not None:
        raise fault
    return answer
