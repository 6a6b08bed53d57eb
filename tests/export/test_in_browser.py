"""Pages in a browser: all charts are drawn and no script fails; skipped without Chromium."""

import re
import shutil
import subprocess

import pytest
from command_line import run_cli
from scene_texts import COULOMB, POINT

CHROMIUM = (
    shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
)
BENCH = POINT + COULOMB + '[slide]\nkind = "triangle"\namplitude = "10 um"\nspeed = "1 mm/s"\n'
ONE_KEY, SECOND_KEY = ["--over", "friction.static=0.1,0.2,0.3"], ["--over", "normal.load=50 N,80 N"]
PAGES = {
    "run": ("run",),
    "one key": ("sweep", *ONE_KEY),
    "map": ("sweep", *ONE_KEY, *SECOND_KEY),
    "cloud": ("sweep", "--over", "friction.static=0.1..0.3", "--random", "5"),
    "many lines": ("sweep", *ONE_KEY, "--over", "normal.load=50 N..90 N:12"),
}


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here")
@pytest.mark.share(1)
@pytest.mark.parametrize("name", PAGES)
def test_always_page_is_drawn_without_script_errors(name, tmp_path):
    """A browser draws the page without errors of its scripts.

    Earlier the page of a sweep over one key had no chart.
    """
    scene = tmp_path / "bench.toml"
    scene.write_text(BENCH, "utf-8")
    verb, *arguments = PAGES[name]
    assert run_cli(verb, scene, *arguments, "-o", tmp_path / "out", "-q").code == 0
    command = [
        CHROMIUM,
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--enable-logging=stderr",
        f"--user-data-dir={tmp_path / 'browser'}",
        "--window-size=1000,1500",
        "--virtual-time-budget=5000",
        "--dump-dom",
        (tmp_path / "out" / "report.html").as_uri(),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    messages = re.findall(r"CONSOLE[^\"]*\"(.*)\", source", done.stderr)
    assert any("document idle" in message for message in messages)
    assert [message for message in messages if "Uncaught" in message or "Error" in message] == []
