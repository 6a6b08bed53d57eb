"""Removal of compiled code of old kernels, which was not used for a month."""

import os
from pathlib import Path
from time import time

from patchfem import kernel_cache

HOUR = 3600.0


def make_code_folders(base: Path, ages: list) -> list:
    """Make one folder of compiled code for each age [h], and return the folders."""
    out = []
    for number, age in enumerate(ages):
        folder = base / f"{number:016x}"
        (folder / "code").mkdir(parents=True)
        (folder / "code/a.code").write_bytes(b"machine code")
        os.utime(folder, (time() - age * HOUR,) * 2)
        out.append(folder)
    return out


def make_current_folder(base: Path) -> Path:
    """Make the folder of the current kernels and return it."""
    folder = base / ("f" * 16)
    folder.mkdir(parents=True)
    return folder


def test_exact_unused_folders_are_removed(tmp_path):
    """A new folder removes those that were unused for longer than the limit; a folder in use is marked."""
    days = kernel_cache.MAX_UNUSED_SECONDS / HOUR
    folders = make_code_folders(tmp_path, [days + 1, days - 1, 0.0, 9 * days])
    kernel_cache.remove_old_folders(folders[1])  # it contains code
    assert all(folder.exists() for folder in folders)
    assert time() - folders[1].stat().st_mtime < 60
    current = make_current_folder(tmp_path)
    kernel_cache.remove_old_folders(current)
    assert [folder.exists() for folder in folders] == [False, True, True, False]
    assert current.is_dir()


def test_exact_other_files_are_not_removed(tmp_path):
    """Other folders, files, links and names that are no hash are kept."""
    current = make_current_folder(tmp_path)
    for name in ("operators", "0123456789abcde", "0123456789abcdeg"):
        (tmp_path / name).mkdir()
    (tmp_path / ("1" * 16)).write_text("a file")
    target = tmp_path / "elsewhere"
    target.mkdir()
    (tmp_path / ("2" * 16)).symlink_to(target)
    for path in tmp_path.iterdir():
        os.utime(path, (time() - 9999 * HOUR,) * 2, follow_symlinks=False)
    kernel_cache.remove_old_folders(current)
    assert target.is_dir() and len(list(tmp_path.iterdir())) == 7
