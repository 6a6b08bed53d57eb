"""What a file, a name or a scene must never bring about: code that runs, a call over the network, a file elsewhere."""

import ast
import re
from pathlib import Path

import pytest
from command_line import cli
from import_graph import sources, syntax_nodes
from scene_texts import BENCH, MODE
from torture.hostile import Planted

import patchfem

HOUSE = Path(__file__).parents[2]
CODE = {"eval", "exec", "compile", "__import__"}  # built-ins that make code of text
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
# the name of the shell whose completions are written
HARMLESS = {
    (
        "compiled.cache_files",
        "pickle",
    ),  # numba's own form of machine code, in a folder that is the user's own
    ("compiled", "compile()"),
    ("compiled", "exec()"),  # a loop of the package with its law put in
    ("compiled.no_jit", "compile()"),
    ("compiled.no_jit", "exec()"),  # a module of the package as it is written
    ("__main__", "shell=shell"),
}
FINE = "re.compile('x'); from .http import x; np.load(a, allow_pickle=False); json.load(f)"


def found_in(name: str, text: str) -> set:
    """What a module has that no module may have, but for HARMLESS; only what has a word of it is parsed."""
    out = set()
    for node in syntax_nodes(text) if WORDS.search(text) else ():
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = (
                [one.name for one in node.names]
                if isinstance(node, ast.Import)
                else [node.module or ""]
                if not node.level
                else []
            )
            out |= {one for one in names if one.split(".")[0] in UNSAFE | NETWORK}
        elif (
            isinstance(node, ast.Attribute)
            and node.attr in ("system", "popen")
            and ast.unparse(node.value) == "os"
        ):
            out.add(f"os.{node.attr}")
        elif (
            isinstance(node, ast.keyword)
            and node.arg in ("allow_pickle", "shell")
            and not (isinstance(node.value, ast.Constant) and node.value.value is False)
        ):
            out.add(f"{node.arg}={ast.unparse(node.value)}")
        elif isinstance(node, ast.Call):
            if isinstance(node.func, ast.Name) and node.func.id in CODE:
                out.add(f"{node.func.id}()")
            if (
                isinstance(node.func, ast.Attribute)
                and node.func.attr == "load"
                and ast.unparse(node.func.value) == "np"
                and "allow_pickle" not in [one.arg for one in node.keywords]
            ):
                out.add("np.load without allow_pickle=False")
    return {one for one in out if (name, one) not in HARMLESS}


def test_always_no_code_from_data_and_no_network():
    assert not {
        name: found for name, text in sources(HOUSE).items() if (found := found_in(name, text))
    }


@pytest.mark.parametrize(
    "text, said",
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
def test_always_sees_what_there_is(text, said):
    assert found_in("planted", text) == {said}
    assert found_in("planted", FINE) == set()


def test_always_writes_only_into_its_folder(tmp_path):
    """A title, a mode, a value of a sweep and a profile's name that lead upwards: nothing is written beside -o."""
    (tmp_path / "work").mkdir()
    scene = tmp_path / "work" / "scene.toml"
    scene.write_text('title = "../../escaped"\n' + BENCH, "utf-8")
    before = {path for path in tmp_path.rglob("*")}
    out = tmp_path / "work" / "out"
    swept = cli(
        "sweep", scene, "--over", "title=../../escaped,/escaped", "-o", out / "swept", "-j", "1"
    )
    assert swept.code in (0, 2), swept.err
    assert cli("run", scene, "-o", out / "run", "--no-page").code == 0
    assert cli("export", out / "run", "-o", out / "histories.csv").code == 0
    new = {path for path in tmp_path.rglob("*")} - before
    assert new and all(path.is_relative_to(out) for path in new)
    assert not Path("/escaped").exists()


def test_always_pages_escape_what_came_from_files(tmp_path):
    """A title, a mode's name and a level of a warning are text on the page; the browser's view of it stands in
    tests/export/pages."""
    mark = "</script><img src=x onerror=alert(1)>"  # data in a script is text unless it ends the script
    scene = tmp_path / "scene.toml"
    drive = '[drive]\nkind = "base"\nfrequency = "100 Hz"\nacceleration = "5 m/s^2"\ncycles = 3\n'
    scene.write_text(f'title = "{mark}"\n' + MODE.replace('"axial"', f'"{mark}"') + drive, "utf-8")
    assert cli("run", scene, "-o", tmp_path / "out").code == 0
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "&lt;img src=x" in page
    outside = re.sub(r"<script.*?</script>", "", page, flags=re.S)
    assert "<img src=x" not in outside


def test_always_a_pickle_under_any_ending_is_text(tmp_path, monkeypatch):
    import pickle

    monkeypatch.chdir(tmp_path)
    for ending in ("npy", "npz", "mat", "csv", "sdf", "x3p", "toml"):
        Path(f"x.{ending}").write_bytes(pickle.dumps(Planted()))
        words = (
            ["check", f"x.{ending}"]
            if ending == "toml"
            else ["profile", f"x.{ending}", "--units", "um,um"]
        )
        answer = cli(*words)
        assert answer.code in (2, 4) and answer.err.strip(), (ending, answer)
    assert sorted(path.suffix for path in tmp_path.iterdir()) == sorted(
        f".{one}" for one in ("npy", "npz", "mat", "csv", "sdf", "x3p", "toml")
    )


def test_exact_the_house_is_the_installed_one():
    """The scan reads the sources that run."""
    assert Path(patchfem.__file__).parents[1] == HOUSE
