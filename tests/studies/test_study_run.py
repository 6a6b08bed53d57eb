"""Studies as commands: options, files only where they are asked for, and progress."""

import re
import subprocess
import sys

from study_module import ROOT, load_study

STUDIES = [
    path for path in sorted(ROOT.glob("*/*.py")) if path.parent.name not in ("common", "site")
]


def test_always_studies_are_run_with_options():
    """Every study that is run as a program has the options of `run_study`, or parses its own."""
    texts = {path: path.read_text("utf-8") for path in STUDIES}
    programs = {path: text for path, text in texts.items() if 'if __name__ == "__main__"' in text}
    others = [
        path.name
        for path, text in programs.items()
        if not re.search(r'__main__":\n    run_study\(', text)
    ]
    assert len(programs) > 40 and others == ["jobqueue.py", "speed.py"]


def test_always_study_writes_only_below_out(tmp_path):
    """A study prints its help, and writes its picture into the folder of --out, by default out/studies/<folder>."""
    study = ROOT / "report/figure_13.py"
    folder = tmp_path / "here"

    def run_study(*words: str) -> subprocess.CompletedProcess:
        command = [sys.executable, str(study), *words]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)

    printed = run_study("--help").stdout
    assert load_study("report/figure_13.py").ANSWER.split()[0] in printed and "--out" in printed
    before = study.with_suffix(".svg").read_bytes()
    assert f"files: {folder}" in run_study("--out", str(folder)).stderr
    run_study()
    made = [path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*.svg")]
    assert sorted(made) == ["here/figure_13.svg", "out/studies/report/figure_13.svg"]
    assert study.with_suffix(".svg").read_bytes() == before
