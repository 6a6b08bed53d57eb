"""Files in the working folder are never executed, whatever module they are named after."""

from pathlib import Path

import pytest
from command_line import run_cli
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
def hostile_folder(tmp_path, monkeypatch):
    """Return a working folder with scenes, measurements, results, and modules that write RAN-name and end the process."""
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


def executed_modules(folder: Path) -> list:
    """Return the names of the modules that were executed."""
    return sorted(one.name for one in folder.glob("RAN-*"))


@pytest.mark.parametrize(
    "every", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["always", "slow"]
)
def test_always_commands_execute_no_local_modules(hostile_folder, every):
    """No command executes a module of the working folder."""
    for name in VERBS if every else ("sweep",):
        answer = run_cli(name, *WORDS.get(name, ()))
        assert answer.code in (0, 2, 3), (name, answer)
        assert not executed_modules(hostile_folder), name
    assert (hostile_folder / "swept" / "sweep.csv").is_file() and (
        hostile_folder / "seen.png"
    ).is_file() is every
