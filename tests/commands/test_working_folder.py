"""Files in the working folder are never executed, whatever module they are named after."""

from pathlib import Path

from command_line import run_successfully
from scene_texts import BENCH

NAMES = "random numpy pyvista signal copy socket selectors matplotlib h5py".split()


def test_always_commands_execute_no_local_modules(tmp_path, monkeypatch):
    """A run and the processes of a sweep execute no module of the working folder."""
    monkeypatch.chdir(tmp_path)
    Path("bench.toml").write_text(BENCH)
    for name in NAMES:
        Path(f"{name}.py").write_text("open('RAN', 'a')\nraise SystemExit(9)\n")
    over = ("--over", "friction.static=0.2,0.3", "-j", 2, "--no-page")
    run_successfully("run", "bench.toml", "-o", "out")
    run_successfully("sweep", "bench.toml", *over, "-o", "swept")
    assert Path("swept/sweep.csv").is_file() and not Path("RAN").exists()
