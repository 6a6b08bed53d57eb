"""Sweeps by scripts for Slurm, with a substitute for sbatch that runs its commands at once."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import list_names, run_successfully
from scene_texts import BENCH
from study_module import ROOT
from sweep_tables import assert_same_files

SBATCH = """\
#!{python}
import os, re, subprocess, sys
words = sys.argv[1:]
given = dict(one.removeprefix("--").split("=", 1) for one in words if one.startswith("--") and "=" in one)
with open({log!r}, "a") as log:
    print(" ".join(words), file=log)
if "wrap" not in given and "--wrap" in words:
    given["wrap"] = words[words.index("--wrap") + 1]
low, high = map(int, given.get("array", "1-1").split("-"))
runs = []
for task in range(low, high + 1):
    more = {{"SLURM_ARRAY_TASK_ID": str(task)}} if "array" in given else {{}}
    what = ["bash", "-c", given["wrap"]] if "wrap" in given else ["bash", words[-1]]
    quiet = {{"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}}
    runs.append(subprocess.Popen(what, env=os.environ | more, **quiet))
if "wrap" in given and any(one.wait() for one in runs):
    sys.exit("a task failed")
print("7;here" if "--parsable" in words else "Submitted batch job 7")
"""
OVER = ("friction.static=0.1,0.2,0.3", "slide.amplitude=5 um,10 um")


@pytest.fixture
def submission_log(tmp_path, monkeypatch) -> Path:
    """Path of the log of submitted jobs; substitutes of sbatch, scancel and patchfem come first in PATH."""
    place = tmp_path / "bin"
    log = tmp_path / "submitted"
    place.mkdir()
    for name, text in {
        "sbatch": SBATCH.format(python=sys.executable, log=str(log)),
        "scancel": "#!/bin/sh\n",
        "patchfem": f'#!/bin/sh\nexec {sys.executable} -m patchfem "$@"\n',
    }.items():
        (place / name).write_text(text)
        (place / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{place}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv(
        "PYTHONPATH", os.pathsep.join([str(ROOT.parent), os.environ.get("PYTHONPATH", "")])
    )
    return log


def run_sweep(tmp_path) -> tuple:
    """Run the sweep in a single process and return its scene, options and folder."""
    scene = tmp_path / "a scene.toml"  # a path with a space, which the scripts must quote
    scene.write_text(BENCH, encoding="utf-8")
    words = [f"--over={one}" for one in OVER]
    run_successfully("sweep", scene, *words, "-o", tmp_path / "whole")
    return scene, words, tmp_path / "whole"


@pytest.mark.slow
def test_exact_job_array_writes_files_of_single_sweep(submission_log, tmp_path):
    """A job array of two tasks writes the same files as a single sweep, to the byte."""
    scene, words, expected = run_sweep(tmp_path)
    out = tmp_path / "parts"
    process = subprocess.run(
        [ROOT / "cluster/array.sh", scene, out, "2", *words], capture_output=True, text=True
    )
    assert process.returncode == 0, process.stderr
    first, second = submission_log.read_text().splitlines()
    assert "--array=1-2" in first and "--dependency=afterany:7 " in second
    assert_same_files(out, expected)
    assert list_names(out / "cases") == list_names(expected / "cases")
