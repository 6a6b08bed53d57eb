"""Compiled code of old kernels: the longest unused goes, never what a process has used in the last hour."""

import os
import subprocess
import sys
from pathlib import Path
from time import time

import pytest

from patchfem.compiled import cache_limit

HOUR = 3600.0


def states(base: Path, ages: list) -> list:
    """A folder of compiled code for each age [h], with files in two folders."""
    out = []
    for number, age in enumerate(ages):
        folder = base / f"{number:016x}"
        (folder / "code").mkdir(parents=True)
        (folder / "code" / "a.code").write_bytes(b"machine code")
        for one in (folder / "code", folder):
            os.utime(one, (time() - age * HOUR,) * 2)
        out.append(folder)
    return out


def own(base: Path) -> Path:
    folder = base / ("f" * 16)
    folder.mkdir(parents=True)
    return folder


def test_exact_the_longest_unused_go_and_those_of_the_last_hour_stay(tmp_path):
    ages = [30, 2, 50, 0.5, 3, 0.1, 40, 0.9]
    made = states(tmp_path, ages)
    mine = own(tmp_path)
    cache_limit.remove_old_folders(mine, 4)
    # the last four are of 0.1, 0.5, 0.9 and 2 hours
    assert {one.name for one in tmp_path.iterdir()} == {
        mine.name,
        *(made[k].name for k in (5, 3, 7, 1)),
    }
    cache_limit.remove_old_folders(mine, 0)
    assert {one.name for one in tmp_path.iterdir()} == {
        mine.name,
        *(made[k].name for k in (5, 3, 7)),
    }


def test_exact_code_put_into_a_folder_counts_as_its_use(tmp_path):
    (old,), mine = states(tmp_path, [30]), own(tmp_path)
    os.utime(old / "code")
    cache_limit.remove_old_folders(mine, 0)
    assert (old / "code" / "a.code").is_file()


def test_exact_nothing_else_is_touched(tmp_path):
    """Operators, files, links, names that are no hash, and what a killed process left half removed."""
    mine = own(tmp_path)
    for name in ("operators", "0123456789abcde", "0123456789abcdeg"):
        (tmp_path / name).mkdir()
    (tmp_path / ("1" * 16)).write_text("a file")
    target = tmp_path / "elsewhere"
    target.mkdir()
    (tmp_path / ("2" * 16)).symlink_to(target)
    half = tmp_path / f".{'3' * 16}.77.gone"
    (half / "code").mkdir(parents=True)
    for one in tmp_path.iterdir():
        os.utime(one, (time() - 99 * HOUR,) * 2, follow_symlinks=False)
    cache_limit.remove_old_folders(mine, 0)
    assert not half.exists() and target.is_dir()
    assert len(list(tmp_path.iterdir())) == 7


def test_exact_room_is_made_where_a_folder_is_new_and_uses_are_marked(tmp_path):
    made = states(tmp_path, [30 + k for k in range(cache_limit.MAX_OTHER_FOLDERS + 3)])
    mine = own(tmp_path)
    cache_limit.mark_used(mine)
    assert [one.exists() for one in made] == [True] * cache_limit.MAX_OTHER_FOLDERS + [False] * 3
    (mine / "code").mkdir()
    old = states(tmp_path / "more", [99])[0]
    cache_limit.mark_used(old)  # there is code in it: it is marked, and nobody is looked at
    assert time() - cache_limit.find_last_use(old) < 60
    os.utime(mine, (time() - HOUR,) * 2)
    cache_limit.mark_used(mine)
    assert time() - mine.stat().st_mtime < 60


def test_always_a_folder_marked_while_it_goes_is_put_back(tmp_path, monkeypatch):
    (old,), mine = states(tmp_path, [30]), own(tmp_path)
    rename = os.rename

    def marked(source, target):
        if Path(source) == old:
            os.utime(old)  # a process began to work with it after it was looked at
        rename(source, target)

    monkeypatch.setattr(os, "rename", marked)
    cache_limit.remove_old_folders(mine, 0)
    assert (old / "code" / "a.code").is_file() and len(list(tmp_path.iterdir())) == 2


def test_always_what_cannot_be_removed_is_no_fault(tmp_path, monkeypatch):
    (old,), mine = states(tmp_path, [30]), own(tmp_path)

    def refused(*given):
        raise PermissionError

    monkeypatch.setattr(os, "rename", refused)
    cache_limit.remove_old_folders(mine, 0)
    cache_limit.mark_used(tmp_path / "nowhere")
    assert old.is_dir()


@pytest.mark.parametrize("rounds", [3])
def test_always_processes_that_make_room_at_once_leave_what_is_young(tmp_path, rounds):
    code = (
        "import sys; from pathlib import Path; from patchfem.compiled import cache_limit\n"
        "sys.stdin.readline(); cache_limit.remove_old_folders(Path(sys.argv[1]), 2)"
    )
    base = tmp_path / "base"
    made = states(base, [0.1, 0.2, 0.3, *range(2, 40)])
    mine = own(base)
    workers = [
        subprocess.Popen(
            [sys.executable, "-c", code, mine],
            stdin=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for _ in range(rounds)
    ]
    said = [one.communicate("now\n", timeout=60)[1] for one in workers]
    assert said == [""] * rounds
    assert {one.name for one in base.iterdir()} == {mine.name, *(one.name for one in made[:3])}
