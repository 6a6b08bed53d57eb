"""The results folder: files are written into DIR.partial, which replaces DIR when complete.

Only folders that contain nothing but results of patchfem are ever replaced; any other folder is
refused before a run starts.
"""

import os
import re
import shutil
from contextlib import suppress
from pathlib import Path

from ..core import Missing, PatchfemError
from ..disk.atomic_write import RESUMABLE_FOLDERS, explain_mkdir_error, is_partial_name
from ..disk.deferred_signals import defer_signals
from ..disk.exchange import make_old_folder_path, replace_folder, restore_folder
from ..disk.lock import FolderLock
from . import store
from .rows import CSV_FILES

# files of all verbs; a folder that contains any other file is never replaced
FILES_OF_ALL_VERBS = frozenset(
    {
        *(store.SUMMARY_FILE, store.SCENE_FILE, store.PAGE_FILE, store.FIELDS_FILE, "result.nc"),
        *store.DATA_FILES.values(),
        *store.DETAIL_FILES.values(),
        *(name for files in CSV_FILES.values() for name in files),
        *("interfaces", "fields.pvd", "fields_frames", "scene.fitted.toml"),
    }
)
WRITER_LOCK_FILE = ".writer"
# files with the state from which an interrupted run continues
WEAR_STATE_FILE = "wear.npz"
STATE_FILE_PATTERN = re.compile(r"wear\.npz|march(_\d+)+\.npz")


class Folder:
    """Results folder as a context manager, which is locked while files are written.

    `path` is the partial folder into which files are written. At exit without an error it replaces
    an older folder; at exit with an error it is removed except for saved states (`is_state_file`). The next entry
    keeps these states if `resume` is set; otherwise it deletes them and says so in the sentence
    `dropped`.

    Parameters
    ----------
    target : Path
        Folder as the user named it.
    resume : bool
        Whether saved states are kept.

    Raises
    ------
    PatchfemError
        If the target contains other files.
    Missing
        If it is in use or cannot be written.
    """

    def __init__(self, target: Path, resume: bool = False):
        self.target = Path(os.path.abspath(target)).resolve()
        self.path = self.target.parent / (self.target.name + ".partial")
        self.shown = target
        self.resume = resume
        self.dropped = ""
        self.new_parents = [path for path in self.target.parents if not path.exists()]
        self.claim = FolderLock(
            self.target.parent / f".{self.target.name}{WRITER_LOCK_FILE}", target, "run"
        )

    def __enter__(self) -> "Folder":
        if not self.target.name:
            raise PatchfemError(
                f"{self.shown}: the root of the file system cannot be replaced; choose another -o"
            )
        if Path.cwd().is_relative_to(self.target):
            raise PatchfemError(
                f"{self.shown}: the working folder cannot be replaced by results; choose another -o"
            )
        try:
            self._refuse_others()
            self.target.parent.mkdir(parents=True, exist_ok=True)
            self.claim.acquire()
            self._prepare()
        except OSError as error:
            raise Missing(
                f"{self.shown}: the results folder cannot be made ({explain_mkdir_error(error)})"
            ) from None
        return self

    def _prepare(self) -> None:
        """Make the partial folder, without saved states unless they are resumed; the lock is released at an error."""
        try:
            restore_folder(self.target)
            # another writer may have put its files there before the folder was locked
            self._refuse_others()
            if self.path.exists() and not self.resume:
                if list_states(self.path):
                    self.dropped = (
                        f"note: {self.path.name} held the state of an interrupted run, which is now discarded; "
                        "use --resume to continue such a run"
                    )
                shutil.rmtree(self.path)
            self.path.mkdir(exist_ok=True)
            # a killed writer leaves the partial file on which it worked
            remove_partial_files(self.path)
        except BaseException:
            self.claim.release()
            raise

    def __exit__(self, kind, value, trace) -> None:
        """Put the results in place, or give the partial folder up after an error.

        The lock is released in any case. The arguments are the type of the error, the error and its traceback. They are
        None without an error.
        """
        with defer_signals():
            try:
                if kind is not None:
                    self._abandon()
                    return
                for state in list_states(self.path):
                    state.unlink()
                replace_folder(self.path, self.target)
            except OSError as error:
                raise Missing(
                    f"{self.shown}: the results cannot be put in place ({error.strerror}); they are in "
                    f"{self.path.name} beside it"
                ) from None
            finally:
                self.claim.release()
                # parents that were made for the folder are removed, unless they contain other files
                with suppress(OSError):
                    for path in self.new_parents if kind is not None else ():
                        path.rmdir()

    def _refuse_others(self) -> None:
        """Raise PatchfemError if the target, or its partial or old folder, contains other files."""
        for place in (self.target, self.path, make_old_folder_path(self.target)):
            refuse_others(
                place, self.shown, (*FILES_OF_ALL_VERBS, WRITER_LOCK_FILE), "patchfem results"
            )

    def _abandon(self) -> None:
        """Remove an incomplete results folder, but keep a saved state."""
        states = list_states(self.path)
        if states:
            RESUMABLE_FOLDERS.append(self.path)
        for part in self.path.iterdir():
            if part not in states:
                remove_path(part)
        with suppress(OSError):  # it contains a state
            self.path.rmdir()


def remove_path(path: Path) -> None:
    """Remove a file or a folder with its content, as far as this is possible."""
    shutil.rmtree(path, ignore_errors=True) if path.is_dir() else path.unlink(missing_ok=True)


def remove_partial_files(folder: Path) -> None:
    """Remove the partial files in a folder and its subfolders, which only a killed writer leaves."""
    for path in folder.rglob(".*"):
        if is_partial_name(path.name):
            remove_path(path)


def is_state_file(name: str) -> bool:
    """Return whether a file with this name contains the saved state of an interrupted run."""
    return STATE_FILE_PATTERN.fullmatch(name) is not None


def list_states(folder: Path) -> list[Path]:
    """Return the files with the saved state of an interrupted run in a folder, which may not exist."""
    return [path for path in folder.glob("*.npz") if is_state_file(path.name)]


def refuse_others(
    folder: Path, user_path, allowed_names, description: str, allows_dot_names: bool = False
) -> None:
    """Raise PatchfemError if a path is not a folder, or if the folder contains files of another kind.

    Parameters
    ----------
    folder : Path
        The path, which may not exist.
    user_path : Path
        The path as the user named it.
    allowed_names : container of str
        Names of files that are allowed.
    description : str
        What these files are, in words.
    allows_dot_names : bool
        Whether names that start with a dot are allowed.
    """
    if not folder.exists():
        return
    if not folder.is_dir():
        raise PatchfemError(
            f"{user_path}: {folder.name} is a file, but a folder is needed; choose another -o"
        )
    other_files = sorted(
        path.name
        for path in folder.iterdir()
        if path.name not in allowed_names
        and not (is_partial_name(path.name) or is_state_file(path.name))
        and not (allows_dot_names and path.name.startswith("."))
    )
    if other_files:
        raise PatchfemError(
            f"{user_path}: {folder.name} contains files that are not {description} "
            f"({', '.join(other_files[:3])}{', ...' if len(other_files) > 3 else ''}); choose another -o"
        )
