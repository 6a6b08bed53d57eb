"""Data of a sweep as its page needs them, and a browser if one is installed."""

import numpy as np
import pytest
from chromium import Chromium, find_chromium
from page_data import make_sweep_key, make_sweep_measure, make_sweep_table


@pytest.fixture
def sweep_table() -> dict:
    """Return a sweep of three loads and four tilts with a measure in closed form.

    One case failed, and the amplitude of another one still grows.
    """
    tilt, load = (
        grid.ravel()
        for grid in np.meshgrid([1e-6, 1e-5, 1e-4, 1e-3], [10.0, 20.0, 40.0], indexing="ij")
    )
    amplitude = 1e-5 * (1 + load / 10) * np.log10(tilt / 1e-7)
    amplitude[7] = np.nan
    texts = [f"{value * 1e3:g} mrad" for value in tilt]
    return make_sweep_table(
        [
            make_sweep_key("contact.tilt.angle", tilt, "rad", texts, log=True),
            make_sweep_key("normal.load", load, "N"),
        ],
        {
            "relative_displacement_amplitude": make_sweep_measure(
                amplitude, amplitude * 0.01, "m", means="half <i>peak-to-peak</i>"
            ),
            "contact_fraction": make_sweep_measure(np.full(12, 0.5)),
            "loop_area": make_sweep_measure(np.full(12, np.nan), unit="J"),
        },
        title="Tilt </script><b>&amp;",
        version="1.2.3",
        command="patchfem sweep a.toml --over x=1,2",
        scene="# <i>a scene</i>",
        outcome=[{7: "failed", 11: "grows"}.get(case, "steady") for case in range(12)],
        messages={7: "normal.load: <refused>"},
        tolerance=np.nan,
        folders=[f"cases/{number:04x}/summary.json" for number in range(12)],
    )


@pytest.fixture(scope="session")
def chromium(tmp_path_factory):
    """Return the browser that all tests of a process share; skip the tests if no browser is installed."""
    if find_chromium() is None:
        pytest.skip("no Chromium here")
    browser = Chromium(tmp_path_factory.mktemp("chromium"))
    yield browser
    browser.close()


@pytest.fixture
def load_page(chromium):
    """Return a function that loads a page in a browser and returns its document after 6 s of the page's clock."""
    return lambda page: chromium.html_after(page, 6000)
