"""A sweep as its page takes it, and a browser where there is one."""

import shutil
import subprocess

import numpy as np
import pytest


@pytest.fixture
def table() -> dict:
    """Three loads by four tilts: a measure in closed form, one case failed, one grows."""
    tilt, load = (grid.ravel() for grid in np.meshgrid([1e-6, 1e-5, 1e-4, 1e-3], [10.0, 20.0, 40.0], indexing="ij"))
    amplitude = 1e-5 * (1 + load / 10) * np.log10(tilt / 1e-7)
    outcome = ["steady"] * 12
    outcome[7], outcome[11] = "failed", "grows"
    amplitude[7] = np.nan
    return {"title": "Tilt </script><b>&amp;", "version": "1.2.3", "command": "patchfem sweep a.toml --over x=1,2",
            "scene": "# <i>a scene</i>", "seconds": 1.25, "grid": True,
            "keys": [{"name": "contact.tilt.angle", "unit": "rad", "values": tilt, "log": True,
                      "texts": [f"{value * 1e3:g} mrad" for value in tilt]},
                     {"name": "normal.load", "unit": "N", "values": load, "log": False,
                      "texts": [f"{value:g} N" for value in load]}],
            "measures": {"relative_displacement_amplitude": {"unit": "m", "means": "half <i>peak-to-peak</i>",
                                                             "values": amplitude, "errors": amplitude * 0.01},
                         "contact_fraction": {"unit": "1", "means": "share", "values": np.full(12, 0.5),
                                              "errors": np.zeros(12)},
                         "loop_area": {"unit": "J", "means": "work", "values": np.full(12, np.nan),
                                       "errors": np.full(12, np.nan)}},
            "outcome": outcome, "messages": {7: "normal.load: <refused>"},
            "folders": [f"cases/{number:04x}/summary.json" for number in range(12)]}


@pytest.fixture
def browser(tmp_path):
    """A function from a page to the document that a browser made of it; the test is skipped where there is none."""
    program = next((found for found in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if found),
                   None)
    if program is None:
        pytest.skip("no Chromium here")

    def opened(page: str) -> str:
        (tmp_path / "page.html").write_text(page, encoding="utf-8")
        command = [program, "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-quic",
                   "--disable-background-networking", "--disable-component-update", "--disable-sync",
                   f"--user-data-dir={tmp_path / 'user'}", "--virtual-time-budget=6000", "--dump-dom",
                   (tmp_path / "page.html").as_uri()]
        return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout

    return opened
