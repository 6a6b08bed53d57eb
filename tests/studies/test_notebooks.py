"""Notebooks and pages with code: short, without stored output, with public names, and executable."""

import ast
import os
import re
from pathlib import Path

import nbformat
import pytest
from jupyter_client import KernelManager
from nbclient import NotebookClient

import patchfem as pf

ROOT = Path(__file__).parents[2]
PICTURES = {
    "own_joint": 2,
    "misalignment": 1,
    "before_after": 1,
    "accuracy_time": 1,
    "backbone": 1,
    "measured_loop": 1,
    "sweep_of_a_thousand": 1,
    "patch_at_every_interface": 1,
    "own_law": 1,
}
# Pages in Markdown with code cells that the site executes.
TASKS = ("backbone", "measured_loop", "own_law", "patch_at_every_interface", "sweep_of_a_thousand")
NAMES = tuple(PICTURES)


def read_notebook(name: str):
    """Return a notebook, or a page of the site as a notebook of text and code cells."""
    if name not in TASKS:
        return nbformat.read(ROOT / f"studies/notebooks/{name}.ipynb", 4)
    text = (ROOT / f"studies/site/tasks/{name}.md").read_text("utf-8").partition("\n---\n")[2]
    parts = re.split(r"^```\{code-cell\} ipython3\n(.*?)^```\n", text, flags=re.S | re.M)
    make = nbformat.v4.new_markdown_cell, nbformat.v4.new_code_cell
    return nbformat.v4.new_notebook(cells=[make[k % 2](part) for k, part in enumerate(parts)])


NOTEBOOKS = {name: read_notebook(name) for name in NAMES}


def read_code(name: str) -> str:
    """Return the text of all cells with code."""
    return "\n".join(cell.source for cell in NOTEBOOKS[name].cells if cell.cell_type == "code")


@pytest.fixture(scope="module")
def kernel(tmp_path_factory):
    """Kernel that runs all notebooks, and its working folder."""
    folder = tmp_path_factory.mktemp("notebooks")
    with pytest.MonkeyPatch.context() as patch:
        for name in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_CONFIG_DIR"):
            patch.setenv(name, str(folder / name.lower()))
        patch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
        patch.delenv("MPLBACKEND", raising=False)
        manager = KernelManager(kernel_name="python3")
        yield manager, folder
        if manager.has_kernel:
            manager.shutdown_kernel(now=True)


def test_always_code_of_measured_loop_runs(tmp_path, monkeypatch):
    """The code cells of the least expensive page run in this process, with their asserts."""
    monkeypatch.chdir(tmp_path)
    exec(read_code("measured_loop"), {})
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_always_notebook_runs_without_errors_or_warnings(name, kernel):
    """All cells of a notebook run, with their asserts; it shows its pictures and writes no warning."""
    manager, folder = kernel
    notebook = nbformat.v4.new_notebook(
        cells=[nbformat.v4.new_code_cell("%reset -f"), *map(dict.copy, NOTEBOOKS[name].cells)],
        metadata=NOTEBOOKS[name].metadata,
    )
    notebook = nbformat.from_dict(notebook)
    NotebookClient(
        notebook, km=manager, timeout=120, resources={"metadata": {"path": str(folder)}}
    ).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    images = [
        output
        for output in outputs
        if any(kind.startswith("image/") for kind in output.get("data", ()))
    ]
    assert len(images) == PICTURES[name]
    assert [output.text for output in outputs if output.get("name") == "stderr"] == []
    assert list(folder.glob("*.*")) == []


def test_always_every_notebook_is_tested_and_linked():
    """Every notebook and page with code is tested here and linked in studies/README.md."""
    assert sorted(path.stem for path in (ROOT / "studies/notebooks").iterdir()) == sorted(
        set(NAMES) - set(TASKS)
    )
    pages = (ROOT / "studies/README.md").read_text("utf-8")
    places = {
        name: f"site/tasks/{name}.md" if name in TASKS else f"notebooks/{name}.ipynb"
        for name in NAMES
    }
    assert [name for name, place in places.items() if f"({place})" not in pages] == []
    tasks = (ROOT / "studies/site/tasks").glob("*.md")
    assert {path.stem for path in tasks if "code-cell" in path.read_text("utf-8")} == set(TASKS)


@pytest.mark.parametrize("name", NAMES)
def test_always_notebook_is_valid_and_without_output(name):
    """A notebook has a valid format and no stored output."""
    nbformat.validate(NOTEBOOKS[name])
    assert all(
        cell.outputs == [] and cell.execution_count is None
        for cell in NOTEBOOKS[name].cells
        if cell.cell_type == "code"
    )


@pytest.mark.parametrize("name", NAMES)
def test_always_notebook_uses_public_names_and_asserts(name):
    """A notebook imports only `patchfem`, uses its public names and has at least four asserts."""
    tree = ast.parse(read_code(name))
    imported = [
        module
        for node in ast.walk(tree)
        if isinstance(node, (ast.Import, ast.ImportFrom))
        for module in (
            [node.module]
            if isinstance(node, ast.ImportFrom)
            else [alias.name for alias in node.names]
        )
        if module.startswith("patchfem")
    ]
    used = {
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id == "pf"
    }
    assert imported == ["patchfem"] and used and used <= set(pf.__all__)
    assert sum(isinstance(node, ast.Assert) for node in ast.walk(tree)) >= 4
