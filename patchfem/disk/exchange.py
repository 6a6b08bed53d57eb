"""Replacement of a folder, during which signals to the process are deferred."""

import os
import shutil
from pathlib import Path

from .atomic_write import COMPLETED_PATHS
from .deferred_signals import defer_signals


def make_old_folder_path(target: Path) -> Path:
    """Return the path to which the previous folder `target` is renamed before it is removed."""
    return target.with_name(f".{target.name}.old")


def replace_folder(new: Path, target: Path) -> None:
    """Rename the folder `new` to `target` and remove the previous folder."""
    old = make_old_folder_path(target)
    with defer_signals():
        shutil.rmtree(old, ignore_errors=True)
        if target.exists():
            # for an instant, the folder does not exist; if the process is killed then, `restore_folder` recovers it
            os.rename(target, old)
        try:
            os.rename(new, target)
        except OSError:
            restore_folder(target)
            raise
        COMPLETED_PATHS.append(target)
        shutil.rmtree(old, ignore_errors=True)


def restore_folder(target: Path) -> None:
    """Undo or complete a replacement of a folder that was interrupted (`replace_folder`).

    If the folder is missing, its previous version gets its name back. Otherwise the previous version is deleted, because
    the new one is complete.

    Parameters
    ----------
    target : Path
        Folder that was replaced.
    """
    old = make_old_folder_path(target)
    if old.is_dir() and not old.is_symlink():
        if target.exists():
            shutil.rmtree(old, ignore_errors=True)
        else:
            os.rename(old, target)
