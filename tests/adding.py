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


class CodeBlock(NamedTuple):
    """Code block of a Markdown page: its language and its text."""

    language: str
    text: str


def find_code_blocks(page: str) -> list:
    """Return the code blocks of a Markdown page in their order."""
    return [
        CodeBlock(*groups) for groups in re.findall(r"^```(\w+)\n(.*?)^```$", page, re.S | re.M)
    ]


def find_commands(page: str) -> list:
    """Return the shell commands of a page in their order, without the leading word patchfem."""
    lines = [
        line
        for block in find_code_blocks(page)
        if block.language == "sh"
        for line in block.text.splitlines()
    ]
    assert all(line.startswith("patchfem ") for line in lines)
    return [line.removeprefix("patchfem ") for line in lines]


def apply_block(block: CodeBlock, package: Path) -> None:
    """Insert a block into the copied package at the place that its first line names."""
    head, _, code = block.text.partition("\n")
    if new_file := re.fullmatch(r"# new file (\S+)", head):
        path = package / new_file[1]
        assert not path.exists(), f"{path} exists"
        path.write_text(code, "utf-8")
        return
    file, position, mark = re.fullmatch(r"# in (\S+), (before|at the end) ?(.*)", head).groups()
    path = package / file
    lines = path.read_text("utf-8").splitlines(keepends=True)
    if position == "at the end":
        path.write_text("".join(lines) + "\n\n" + code, "utf-8")
        return
    line_number = next(number for number, line in enumerate(lines) if line.strip().startswith(mark))
    lines.insert(line_number, code)
    path.write_text("".join(lines), "utf-8")


def copy_package(folder: Path, page: str) -> Path:
    """Copy the package into a folder, apply every block of a page, and return the path of the copy."""
    copy = shutil.copytree(PACKAGE, folder / "patchfem")
    for block in find_code_blocks(page):
        if block.language in ("python", "toml"):
            apply_block(block, copy)
    return copy


def run_commands(folder: Path, lines: list, **variables: str) -> str:
    """Run commands with a copied package in a new process and return their output; AssertionError if one of them fails.

    `variables` are added to the environment.
    """
    process = subprocess.run(
        [sys.executable, "-c", COMMANDS, *lines],
        cwd=folder,
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": str(folder)} | variables,
        check=False,
    )
    assert process.returncode == 0, (
        f"{shlex.join(lines)}\n{process.stdout[-2000:]}\n{process.stderr[-4000:]}"
    )
    return process.stdout + process.stderr
