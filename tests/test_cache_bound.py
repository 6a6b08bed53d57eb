"""Removal of compiled code of old kernels: the least recently used first, never code used in the last day."""

import os
from pathlib import Path
from time import time

from patchfem import compiled

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


def test_exact_least_recently_used_folders_are_removed(tmp_path):
    """The folders unused for longest are removed down to the limit, except for those used in the last day."""
    folders = make_code_folders(tmp_path, [300, 25, 500, 0.5, 30, 0.1, 400, 23])
    current = make_current_folder(tmp_path)
    compiled.remove_old_folders(current, 4)
    assert [k for k in range(8) if folders[k].exists()] == [1, 3, 5, 7]
    compiled.remove_old_folders(current, 0)
    assert [k for k in range(8) if folders[k].exists()] == [3, 5, 7]
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
        os.utime(path, (time() - 99 * HOUR,) * 2, follow_symlinks=False)
    compiled.remove_old_folders(current, 0)
    assert target.is_dir() and len(list(tmp_path.iterdir())) == 7


def test_exact_only_new_folder_removes_old_ones(tmp_path):
    """A new folder removes the oldest folders beyond the limit, and each use updates the time of a folder."""
    folders = make_code_folders(
        tmp_path, [30 + k for k in range(compiled.MAX_OTHER_CACHE_FOLDERS + 3)]
    )
    compiled.remove_old_folders(folders[0])  # it contains code
    assert all(folder.exists() for folder in folders)
    assert time() - folders[0].stat().st_mtime < 60
    compiled.remove_old_folders(make_current_folder(tmp_path))
    kept = [folder.exists() for folder in folders]
    assert kept == [True] * compiled.MAX_OTHER_CACHE_FOLDERS + [False] * 3
