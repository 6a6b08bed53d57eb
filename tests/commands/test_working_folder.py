"""A file that lies in the working folder is never run as code, whatever module it has the name of."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import run_cli
from import_graph import read_sources, syntax_nodes
from scene_texts import BENCH, COATED

from patchfem.__main__ import VERBS

NAMES = (
    "random",
    "numpy",
    "pyvista",
    "signal",
    "copy",
    "socket",
    "selectors",
    "matplotlib",
    "h5py",
)
LOOP = "displacement [m],force [N]\n0,0\n1e-6,10\n2e-6,30\n0,-30\n-2e-6,-30\n0,30\n2e-6,30\n"
TRACE = "x [um],z [um]\n" + "".join(f"{k},{(k * 37) % 11 / 10}\n" for k in range(200))
SWEPT = ("sweep", "bench.toml", "--over", "friction.static=0.2,0.3", "--no-page", "-o")
WORDS = {
    "new": ("joint",),
    "demo": ("--no-page",),
    "check": ("bench.toml",),
    "plan": ("bench.toml",),
    "run": ("bench.toml", "-o", "again"),
    "sweep": (*SWEPT[1:], "swept", "-j", "2"),
    "profile": ("trace.csv",),
    "compare": ("trace.csv", "trace.csv"),
    "cost": ("bench.toml", "-o", "cost"),
    "fit": ("bench.toml", "--to", "loop.csv", "--free", "friction.static=0.1..0.6", "-o", "fit"),
    "mesh": ("patch.toml", "-o", "mesh.vtu"),
    "import": ("loop.csv",),
    "report": ("out",),
    "export": ("out", "-o", "histories.csv"),
    "view": ("pressed", "-o", "seen.png"),
    "doctor": (),
}


@pytest.fixture
def planted(tmp_path, monkeypatch):
    """A working folder with scenes, files of measurements and results, and modules that leave RAN-name behind and end
    who runs them."""
    monkeypatch.chdir(tmp_path)
    Path("bench.toml").write_text(BENCH)
    Path("patch.toml").write_text(COATED)
    Path("loop.csv").write_text(LOOP)
    Path("trace.csv").write_text(TRACE)
    assert (
        run_cli("run", "bench.toml", "-o", "out", "-q").code
        == run_cli("run", "patch.toml", "-o", "pressed", "-q").code
        == 0
    )
    for name in NAMES:
        Path(f"{name}.py").write_text(
            f"open({str(tmp_path / f'RAN-{name}')!r}, 'a')\nraise SystemExit(9)\n"
        )
    return tmp_path


def ran(folder: Path) -> list:
    return sorted(one.name for one in folder.glob("RAN-*"))


@pytest.mark.parametrize(
    "every", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["always", "slow"]
)
def test_always_no_verb_runs_what_lies_in_the_working_folder(planted, every):
    for name in VERBS if every else ("sweep",):
        answer = run_cli(name, *WORDS.get(name, ()))
        assert answer.code in (0, 2, 3), (name, answer)
        assert not ran(planted), name
    assert (planted / "swept" / "sweep.csv").is_file() and (planted / "seen.png").is_file() is every


@pytest.mark.slow
def test_always_a_cluster_runs_nothing_of_the_working_folder(planted):
    pytest.importorskip("distributed")
    answer = run_cli(*SWEPT, "swept", "--executor", "dask", "-j", "1")
    assert answer.code == 0, answer.err
    assert not ran(planted)


def test_always_python_m_runs_nothing_of_the_working_folder(planted):
    done = subprocess.run(
        [sys.executable, "-m", "patchfem", "plan", "bench.toml"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert not ran(planted)


def test_exact_the_planted_modules_run_where_python_looks_for_them(planted):
    done = subprocess.run([sys.executable, "-c", "import random"], env={})
    assert done.returncode == 9 and ran(planted) == ["RAN-random"]


def test_always_every_interpreter_that_is_started_leaves_out_the_working_folder():
    """Lists of words that begin with the interpreter name -P next."""
    seen = 0
    for name, text in read_sources(Path(__file__).parents[2]).items():
        for node in syntax_nodes(text) if "sys.executable" in text else ():
            words = [ast.unparse(one) for one in node.elts] if isinstance(node, ast.List) else []
            if words[:1] in (["sys.executable"], ["PYTHON"]):
                assert words[1] == "'-P'", name
                seen += 1
    assert seen >= 4
