"""A sweep as its page takes it, and a browser where there is one."""

import numpy as np
import pytest
from chromium import Chromium, program


@pytest.fixture
def table() -> dict:
    """Three loads by four tilts: a measure in closed form, one case failed, one grows."""
    tilt, load = (
        grid.ravel()
        for grid in np.meshgrid([1e-6, 1e-5, 1e-4, 1e-3], [10.0, 20.0, 40.0], indexing="ij")
    )
    amplitude = 1e-5 * (1 + load / 10) * np.log10(tilt / 1e-7)
    outcome = ["steady"] * 12
    outcome[7] = "failed"
    outcome[11] = "grows"
    amplitude[7] = np.nan
    return {
        "title": "Tilt </script><b>&amp;",
        "version": "1.2.3",
        "command": "patchfem sweep a.toml --over x=1,2",
        "scene": "# <i>a scene</i>",
        "grid": True,
        "keys": [
            {
                "name": "contact.tilt.angle",
                "unit": "rad",
                "values": tilt,
                "log": True,
                "texts": [f"{value * 1e3:g} mrad" for value in tilt],
            },
            {
                "name": "normal.load",
                "unit": "N",
                "values": load,
                "log": False,
                "texts": [f"{value:g} N" for value in load],
            },
        ],
        "measures": {
            "relative_displacement_amplitude": {
                "unit": "m",
                "means": "half <i>peak-to-peak</i>",
                "values": amplitude,
                "errors": amplitude * 0.01,
            },
            "contact_fraction": {
                "unit": "1",
                "means": "share",
                "values": np.full(12, 0.5),
                "errors": np.zeros(12),
            },
            "loop_area": {
                "unit": "J",
                "means": "work",
                "values": np.full(12, np.nan),
                "errors": np.full(12, np.nan),
            },
        },
        "outcome": outcome,
        "messages": {7: "normal.load: <refused>"},
        "folders": [f"cases/{number:04x}/summary.json" for number in range(12)],
    }


@pytest.fixture(scope="session")
def chromium(tmp_path_factory):
    """A browser for all tests of a process, which are skipped where there is none."""
    if program() is None:
        pytest.skip("no Chromium here")
    browser = Chromium(tmp_path_factory.mktemp("chromium"))
    yield browser
    browser.close()


@pytest.fixture
def browser(chromium):
    """A function from a page to the document that a browser made of it in 6 s of the page's clock."""
    return lambda page: chromium.after(page, 6000)
