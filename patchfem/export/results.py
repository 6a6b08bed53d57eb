"""The results folder: everything is written into DIR.partial and renamed to DIR when whole.

Only folders that hold nothing but patchfem results are ever replaced; anything else is refused before a run starts.
"""

import os
import shutil
from pathlib import Path

from ..core import Missing, PatchfemError

PAGE = "report.html"
FILES = ("summary.json", "result.nc", "fields.vtkhdf", PAGE, "scene.resolved.toml", "fields.pvd",
         "fields_frames", "fit.json", "fit.csv", "fit.svg", "scene.fitted.toml", "wear.npz",
         "starts.json", "compare.json", "surface_before.csv", "surface_after.csv", "profile.json")
LOCK = ".writer"
STATE, STARTS = "wear.npz", "starts.json"
STATES = (STATE, STARTS)  # of an interrupted run or fit, from which it goes on


class Folder:
    """Context of a results folder, which is claimed at entry.

    `path` is the partial folder to write into. Leaving without an error renames it, leaving with one removes it but for
    kept STATES, which `resume` leaves in place at the next entry. PatchfemError for a target that holds other files,
    Missing where it is in use or cannot be written.
    """

    def __init__(self, target: Path, resume: bool = False):
        self.target = Path(os.path.abspath(target)).resolve()
        self.path = self.target.parent / (self.target.name + ".partial")
        self.shown, self.resume = target, resume

    def __enter__(self) -> "Folder":
        if not self.target.name:
            raise PatchfemError(f"{self.shown}: the root of the file system cannot be replaced; name another -o")
        if Path.cwd().is_relative_to(self.target):
            raise PatchfemError(f"{self.shown}: the working folder cannot be replaced by results; name another -o")
        for place in (self.target, self.path):
            _only_ours(place, self.shown)
        try:
            if self.path.exists() and not self.resume:
                shutil.rmtree(self.path)
            self.path.mkdir(parents=True, exist_ok=True)
            (self.path / LOCK).write_text(str(os.getpid()))
        except OSError as error:
            raise Missing(f"{self.shown}: the results folder cannot be made ({error.strerror})") from None
        return self

    def __exit__(self, kind, value, trace) -> None:
        if kind is not None:
            self._abandon()
            return
        try:
            for state in STATES:
                (self.path / state).unlink(missing_ok=True)
            (self.path / LOCK).unlink()
            old = self.target.with_name(f".{self.target.name}.old{os.getpid()}")
            if self.target.exists():
                os.replace(self.target, old)
            os.replace(self.path, self.target)
            shutil.rmtree(old, ignore_errors=True)
        except OSError as error:
            raise Missing(f"{self.shown}: the results cannot be put in place ({error.strerror}); they are in "
                          f"{self.path.name} beside it") from None

    def _abandon(self) -> None:
        """Remove everything but a kept state; the folder too where there is none."""
        if not any((self.path / state).is_file() for state in STATES):
            shutil.rmtree(self.path, ignore_errors=True)
            return
        for part in self.path.iterdir():
            if part.name not in STATES:
                shutil.rmtree(part, ignore_errors=True) if part.is_dir() else part.unlink(missing_ok=True)


def refuse_others(place: Path, shown, known, kind: str, dots: bool = False) -> None:
    """PatchfemError for a place that is no folder or holds files that are not patchfem's.

    shown: the place as the user named it; known: names of files, also with .partial behind them; kind: what they are,
    in words; dots: whether names that start with a dot are among them.
    """
    if not place.exists():
        return
    if not place.is_dir():
        raise PatchfemError(f"{shown}: {place.name} is a file, a folder is wanted; name another -o")
    others = sorted(one.name for one in place.iterdir() if one.name.removesuffix(".partial") not in known
                    and not (dots and one.name.startswith(".")))
    if others:
        raise PatchfemError(f"{shown}: {place.name} holds files that are not {kind} ({', '.join(others[:3])}"
                            f"{', ...' if len(others) > 3 else ''}); name another -o")


def refuse_second(lock: Path, shown, kind: str) -> None:
    """Missing where the process that a lock file names is alive and not this one."""
    writer = lock.read_text() if lock.is_file() else ""
    if writer.isdigit() and int(writer) != os.getpid() and Path(f"/proc/{writer}").exists():
        raise Missing(f"{shown}: another {kind} (process {writer}) is writing it; name another -o or wait; if that "
                      f"process is no patchfem, remove {lock.parent.name}/{lock.name}")


def _only_ours(place: Path, shown) -> None:
    """Refuse a place that is no folder, holds foreign files or is being written by a living process."""
    refuse_others(place, shown, (*FILES, LOCK), "patchfem results")
    refuse_second(place / LOCK, shown, "run")
