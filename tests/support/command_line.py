"""Run the command line in the test process, and code in a new interpreter."""

from __future__ import annotations

import ast
import contextlib
import io
import json
import os
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

from patchfem.__main__ import main

PACKAGE = Path(__file__).parents[2] / "patchfem"
MODULES = "import json, sys; print(json.dumps(sorted(sys.modules)))"
FROM_PYTHON = f"""\
import sys
from patchfem.scene.scene import load
from patchfem.runs.plan import plan
from patchfem.runs.run import run
result = run(plan(load(sys.argv[1])))
assert result.measures
{MODULES}
"""
FROM_SHELL = f"""\
import sys
from patchfem.__main__ import main
try:
    main(sys.argv[1:])
except SystemExit as end:
    assert not end.code, end.code
{MODULES}
"""
ALWAYS = {"pyvista", "meshio", "numba"}


class CommandResult(NamedTuple):
    """Exit code, standard output and standard error of a command."""

    code: int
    out: str
    err: str

    @property
    def content(self):
        """Content of the JSON text on standard output."""
        return json.loads(self.out)


def read_json(path):
    """Return the content of a JSON file."""
    return json.loads(Path(path).read_text("utf-8"))


def list_names(folder) -> set[str]:
    """Return the names of the files and folders in a folder."""
    return {path.name for path in folder.iterdir()}


def read_page(folder) -> str:
    """Return the page of a results folder."""
    return (folder / "report.html").read_text("utf-8")


def run_cli(*words, stdout: io.StringIO | None = None) -> CommandResult:
    """Run `patchfem WORDS` in this process; `stdout` may be a stream that receives the output."""
    out = io.StringIO() if stdout is None else stdout
    err = io.StringIO()
    with (
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        pytest.raises(SystemExit) as end,
    ):
        main([str(word) for word in words])
    return CommandResult(end.value.code or 0, out.getvalue(), err.getvalue())


def run_successfully(*words) -> CommandResult:
    """Run `patchfem WORDS` in this process, and assert that it ends with code 0."""
    answer = run_cli(*words)
    assert answer.code == 0, answer.err
    return answer


def modules_after(code: str, *words) -> set:
    """Return the names in sys.modules after `code` was run in a new interpreter."""
    process = subprocess.run(
        [sys.executable, "-c", code, *map(str, words)],
        capture_output=True,
        text=True,
        env=os.environ | {"MPLBACKEND": "svg"},
        timeout=120,
    )
    assert process.returncode == 0, process.stderr
    return set(json.loads(process.stdout.splitlines()[-1]))


def modules_after_cached(code: str, *words) -> set:
    """Return the modules that `code` loads once all compiled code is cached; a run that had to compile is repeated."""
    modules = modules_after(code, *words)
    return modules_after(code, *words) if "numba" in modules else modules


def has_code_of(modules: set, name: str) -> bool:
    """Return whether modules of another package, or of a folder or module of this one, are among those loaded.

    The `__init__` of a folder that has only a docstring and the table of its public names does not count: Python
    loads it with any module of the folder that is named and not yet used.
    """
    full_name = name if name in ("scipy", "skfem", *ALWAYS) else f"patchfem.{name}"
    return any(
        (module == full_name or module.startswith(f"{full_name}.")) and not _has_names_only(module)
        for module in modules
    )


def assert_not_loaded(modules: set, *names) -> None:
    """Assert that none of the named folders, modules and packages, nor any package in ALWAYS, is loaded."""
    assert not [name for name in {*ALWAYS, *names} if has_code_of(modules, name)]


@cache
def _has_names_only(name: str) -> bool:
    """Return whether a module is the `__init__` of a folder with only a docstring and a table of public names."""
    path = PACKAGE.joinpath(*name.split(".")[1:], "__init__.py")
    if not name.startswith("patchfem.") or not path.is_file():
        return False
    _, *statements = ast.parse(path.read_text("utf-8")).body
    return all(
        isinstance(statement, ast.Assign) and ast.unparse(statement.targets[0]) == "PUBLIC"
        for statement in statements
    )
