"""A browser, if one is installed."""

import pytest
from chromium import Chromium, find_chromium


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
