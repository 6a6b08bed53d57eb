"""Code examples of patchfem/ADDING.md, which the tests apply to a copy of the package."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import patchfem

PACKAGE = Path(patchfem.__file__).parent
COMMANDS = """\
import shlex, sys
from pathlib import Path
from patchfem.__main__ import main
import patchfem

assert Path(patchfem.__file__).parent == Path("patchfem").resolve(), patchfem.__file__
for words in map(shlex.split, sys.argv[1:]):
    try:
        main(words)
    except SystemExit as end:
        if end.code:
            print(f"{shlex.join(words)}: exit code {end.code}", file=sys.stderr)
            raise
"""


class Block(NamedTuple):
    """Code block of a Markdown page: its language and its text."""

    language: str
    text: str


def blocks(page: str) -> list:
    """Return the code blocks of a Markdown page in their order."""
    return [Block(*found) for found in re.findall(r"^```(\w+)\n(.*?)^```$", page, re.S | re.M)]


def commands(page: str) -> list:
    """Return the shell commands of a page in their order, without the leading word patchfem."""
    lines = [
        line for block in blocks(page) if block.language == "sh" for line in block.text.splitlines()
    ]
    assert all(line.startswith("patchfem ") for line in lines)
    return [line.removeprefix("patchfem ") for line in lines]


def place(block: Block, package: Path) -> None:
    """Insert a Python block into the copied package at the place that its first line names."""
    head, _, code = block.text.partition("\n")
    if found := re.fullmatch(r"# new file (\S+)", head):
        path = package / found[1]
        assert not path.exists(), f"{path} exists"
        path.write_text(code, "utf-8")
        return
    file, where, mark = re.fullmatch(
        r"# in (\S+), (before|in place of|at the end) ?(.*)", head
    ).groups()
    path = package / file
    lines = path.read_text("utf-8").splitlines(keepends=True)
    if where == "at the end":
        path.write_text("".join(lines) + "\n\n" + code, "utf-8")
        return
    at = next(number for number, line in enumerate(lines) if line.strip().startswith(mark))
    lines[at : at + (where == "in place of")] = [code]
    path.write_text("".join(lines), "utf-8")


def copied(folder: Path, page: str) -> Path:
    """Copy the package into a folder, apply every Python block of a page, and return the path of the copy."""
    copy = shutil.copytree(
        PACKAGE, folder / "patchfem", ignore=shutil.ignore_patterns("__pycache__")
    )
    for block in blocks(page):
        if block.language == "python":
            place(block, copy)
    return copy


def run(folder: Path, lines: list) -> str:
    """Run commands with a copied package in a new process and return their output; AssertionError if one of them fails."""
    done = subprocess.run(
        [sys.executable, "-c", COMMANDS, *lines],
        cwd=folder,
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": str(folder)},
        check=False,
    )
    assert done.returncode == 0, (
        f"{shlex.join(lines)}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}"
    )
    return done.stdout + done.stderr
