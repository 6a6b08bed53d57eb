"""Files, names and scenes never cause code execution, network access or files outside the results
folder."""

import ast
import re
from pathlib import Path

import pytest
from command_line import read_page, run_cli, run_successfully
from import_graph import read_sources, syntax_nodes
from scene_texts import BENCH, MODE

import patchfem

HOUSE = Path(__file__).parents[2]
CODE = {"eval", "exec", "compile", "__import__"}  # built-in functions that turn text into code
UNSAFE = {"pickle", "marshal", "shelve", "dill", "cloudpickle", "joblib", "code", "codeop"}
NETWORK = {
    "socket",
    "socketserver",
    "ssl",
    "urllib",
    "http",
    "ftplib",
    "smtplib",
    "xmlrpc",
    "requests",
    "httpx",
    "aiohttp",
    "webbrowser",
}
WORDS = re.compile(
    rf"\b({'|'.join(CODE)})\(|\b({'|'.join(UNSAFE | NETWORK)})\b|np\.load\(|allow_pickle|shell|\bos\."
)
# uses that were reviewed; `shell` is the name of the shell whose completions are written
HARMLESS = {
    ("kernel_cache", "compile()"),
    ("kernel_cache", "exec()"),  # a loop of the package in which its friction law is inserted
    ("__main__", "shell=shell"),
}
FINE = "re.compile('x'); from .http import x; np.load(a, allow_pickle=False); json.load(f)"


def find_unsafe_code(name: str, text: str) -> set:
    """Return the unsafe imports and calls in the text of a module, except those in HARMLESS. A
    module is parsed only if its text contains a suspicious word."""
    findings = set()
    for node in syntax_nodes(text) if WORDS.search(text) else ():
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = (
                [finding.name for finding in node.names]
                if isinstance(node, ast.Import)
                else [node.module or ""]
                if not node.level
                else []
            )
            findings |= {finding for finding in names if finding.split(".")[0] in UNSAFE | NETWORK}
        elif (
            isinstance(node, ast.Attribute)
            and node.attr in ("system", "popen")
            and ast.unparse(node.value) == "os"
        ):
            findings.add(f"os.{node.attr}")
        elif (
            isinstance(node, ast.keyword)
            and node.arg in ("allow_pickle", "shell")
            and not (isinstance(node.value, ast.Constant) and node.value.value is False)
        ):
            findings.add(f"{node.arg}={ast.unparse(node.value)}")
        elif isinstance(node, ast.Call):
            if isinstance(node.func, ast.Name) and node.func.id in CODE:
                findings.add(f"{node.func.id}()")
            if (
                isinstance(node.func, ast.Attribute)
                and node.func.attr == "load"
                and ast.unparse(node.func.value) == "np"
                and "allow_pickle" not in [finding.arg for finding in node.keywords]
            ):
                findings.add("np.load without allow_pickle=False")
    return {finding for finding in findings if (name, finding) not in HARMLESS}


def test_always_sources_contain_no_unsafe_code():
    """No module of the package executes data as code or imports a network library."""
    assert not {
        name: findings
        for name, text in read_sources(HOUSE).items()
        if (findings := find_unsafe_code(name, text))
    }


@pytest.mark.parametrize(
    "text, finding",
    [
        ("eval('1')", "eval()"),
        ("import pickle as p", "pickle"),
        ("from urllib.request import urlopen", "urllib.request"),
        ("def f():\n import socket", "socket"),
        ("np.load(a)", "np.load without allow_pickle=False"),
        ("np.load(a, allow_pickle=True)", "allow_pickle=True"),
        ("run(x, shell=True)", "shell=True"),
        ("os.system('x')", "os.system"),
    ],
)
def test_always_unsafe_code_is_detected(text, finding):
    """The scan of the sources finds each planted unsafe call or import, and nothing in safe
    code."""
    assert find_unsafe_code("planted", text) == {finding}
    assert find_unsafe_code("planted", FINE) == set()


def test_always_commands_write_only_into_output_folder(tmp_path):
    """The commands write no file outside the folder given by -o, even if a title or a value of a
    sweep contains `../`."""
    (tmp_path / "work").mkdir()
    scene = tmp_path / "work/scene.toml"
    scene.write_text('title = "../../escaped"\n' + BENCH, "utf-8")
    old_paths = {path for path in tmp_path.rglob("*")}
    out = tmp_path / "work/out"
    sweep = run_cli(
        "sweep", scene, "--over", "title=../../escaped,/escaped", "-o", out / "swept", "-j", "1"
    )
    assert sweep.code in (0, 2), sweep.err
    run_successfully("run", scene, "-o", out / "run", "--no-page")
    run_successfully("export", out / "run", "-o", out / "histories.csv")
    new_paths = {path for path in tmp_path.rglob("*")} - old_paths
    assert new_paths and all(path.is_relative_to(out) for path in new_paths)
    assert not Path("/escaped").exists()


def test_always_pages_escape_text_of_scenes(tmp_path):
    """A title and a mode name with HTML markup appear as escaped text on the page. The same page in
    a browser is tested in tests/export/pages."""
    markup = "</script><img src=x onerror=alert(1)>"  # harmless in a script unless it closes it
    scene = tmp_path / "scene.toml"
    drive = '[drive]\nkind = "base"\nfrequency = "100 Hz"\nacceleration = "5 m/s^2"\ncycles = 3\n'
    scene.write_text(
        f'title = "{markup}"\n' + MODE.replace('"axial"', f'"{markup}"') + drive, "utf-8"
    )
    run_successfully("run", scene, "-o", tmp_path / "out")
    page = read_page(tmp_path / "out")
    assert "&lt;img src=x" in page
    page_without_scripts = re.sub(r"<script.*?</script>", "", page, flags=re.S)
    assert "<img src=x" not in page_without_scripts


def test_exact_scanned_sources_are_the_installed_package():
    """The scanned source folder contains the package that is imported."""
    assert Path(patchfem.__file__).parents[1] == HOUSE
