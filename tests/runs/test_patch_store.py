"""Cache of patches: which results are discarded first."""

import pytest

from patchfem.runs.patch import store


@pytest.fixture(autouse=True)
def empty_cache():
    """Begin and end with an empty cache."""
    store.clear_cache()
    yield
    store.clear_cache()


def find_recomputed(names: str) -> list[str]:
    """Return the names whose results are not cached, in the order of the calls."""
    recomputed = []
    for name in names:
        store.get_or_compute((name,), lambda name=name: recomputed.append(name))
    return recomputed


def test_least_recently_used_result_beyond_the_number_is_discarded(monkeypatch):
    """A result that was asked for again stays; the one that was not used for longest is computed again."""
    monkeypatch.setattr(store, "MAX_ENTRIES", 3)
    assert find_recomputed("abcad") == ["a", "b", "c", "d"]
    assert find_recomputed("adcb") == ["b"]
