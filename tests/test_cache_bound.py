"""Removal of compiled code of old kernels: the least recently used first, never code used in the last hour."""

import os
from pathlib import Path
from time import time

from patchfem.compiled import cache_limit

HOUR = 3600.0


def make_code_folders(base: Path, ages: list) -> list:
    """Make one folder of compiled code for each age [h], and return the folders."""
    out = []
    for number, age in enumerate(ages):
        folder = base / f"{number:016x}"
        (folder / "code").mkdir(parents=True)
        (folder / "code/a.code").write_bytes(b"machine code")
        for one in (folder / "code", folder):
            os.utime(one, (time() - age * HOUR,) * 2)
        out.append(folder)
    return out


def make_current_folder(base: Path) -> Path:
    """Make the folder of the current kernels and return it."""
    folder = base / ("f" * 16)
    folder.mkdir(parents=True)
    return folder


def test_exact_least_recently_used_folders_are_removed(tmp_path):
    """The folders unused for longest are removed down to the limit, except for those used in the last hour."""
    ages = [30, 2, 50, 0.5, 3, 0.1, 40, 0.9]
    folders = make_code_folders(tmp_path, ages)
    current = make_current_folder(tmp_path)
    cache_limit.remove_old_folders(current, 4)
    # the four folders used last have ages of 0.1, 0.5, 0.9 and 2 hours
    assert {path.name for path in tmp_path.iterdir()} == {
        current.name,
        *(folders[k].name for k in (5, 3, 7, 1)),
    }
    cache_limit.remove_old_folders(current, 0)
    assert {path.name for path in tmp_path.iterdir()} == {
        current.name,
        *(folders[k].name for k in (5, 3, 7)),
    }


def test_exact_other_files_are_not_removed(tmp_path):
    """Other folders, files, links and names that are no hash are kept; the remains of a killed process are removed."""
    current = make_current_folder(tmp_path)
    for name in ("operators", "0123456789abcde", "0123456789abcdeg"):
        (tmp_path / name).mkdir()
    (tmp_path / ("1" * 16)).write_text("a file")
    target = tmp_path / "elsewhere"
    target.mkdir()
    (tmp_path / ("2" * 16)).symlink_to(target)
    partly_removed = tmp_path / f".{'3' * 16}.77.gone"
    (partly_removed / "code").mkdir(parents=True)
    for path in tmp_path.iterdir():
        os.utime(path, (time() - 99 * HOUR,) * 2, follow_symlinks=False)
    cache_limit.remove_old_folders(current, 0)
    assert not partly_removed.exists() and target.is_dir()
    assert len(list(tmp_path.iterdir())) == 7


def test_exact_new_folder_removes_old_ones(tmp_path):
    """A new folder removes the oldest folders beyond the limit, and each use updates the time of a folder."""
    folders = make_code_folders(
        tmp_path, [30 + k for k in range(cache_limit.MAX_OTHER_CACHE_FOLDERS + 3)]
    )
    current = make_current_folder(tmp_path)
    cache_limit.mark_used(current)
    assert [folder.exists() for folder in folders] == [
        True
    ] * cache_limit.MAX_OTHER_CACHE_FOLDERS + [False] * 3
    (current / "code").mkdir()
    old = make_code_folders(tmp_path / "more", [99])[0]
    cache_limit.mark_used(
        old
    )  # the folder contains code: it is marked as used and no other is checked
    assert time() - cache_limit.find_last_use(old) < 60
    os.utime(current, (time() - HOUR,) * 2)
    cache_limit.mark_used(current)
    assert time() - current.stat().st_mtime < 60


def test_always_folder_used_during_removal_is_restored(tmp_path, monkeypatch):
    """A folder that another process begins to use while it is removed is restored."""
    (old,), current = make_code_folders(tmp_path, [30]), make_current_folder(tmp_path)
    rename = os.rename

    def use_then_rename(source, target):
        """Mark the folder as used just before it is renamed."""
        if Path(source) == old:
            os.utime(old)  # a process begins to use the folder after its age was checked
        rename(source, target)

    monkeypatch.setattr(os, "rename", use_then_rename)
    cache_limit.remove_old_folders(current, 0)
    assert (old / "code/a.code").is_file() and len(list(tmp_path.iterdir())) == 2
