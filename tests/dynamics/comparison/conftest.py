"""One compiled loop for all tests of the comparison methods; `runs/` has that of Coulomb friction alone."""

import pytest
from comparison_cases import share_one_loop


@pytest.fixture(autouse=True)
def shared_loop(monkeypatch):
    share_one_loop(monkeypatch)
