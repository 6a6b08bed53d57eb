"""Cache of patches: which results are discarded first, by number and by the memory of their arrays."""

from dataclasses import dataclass

import numpy as np
import pytest

from patchfem.runs.patch import store


@dataclass(frozen=True, eq=False, slots=True)
class Held:
    """Result that holds an array in a dict, as condensed pieces do."""

    computed: dict


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


def test_results_beyond_the_memory_are_discarded(monkeypatch):
    """Arrays inside results and keys count, a common array or its view only once; a single large result is kept."""
    monkeypatch.setattr(store, "MAX_BYTES", 3000)
    common = np.zeros(250)
    results = {
        "a": common,
        "b": Held({"view": common[10:]}),
        "c": (None, [Held({"own": np.zeros(100)})]),
        "d": np.zeros(25),
    }
    for name, result in results.items():
        assert store.get_or_compute((name,), lambda result=result: result) is result
    assert find_recomputed("abcd") == []

    # 400 bytes more than the limit: only both results that hold the common array together free its memory
    store.get_or_compute(("e", Held({"own": np.zeros(50)})), dict)
    assert find_recomputed("cd") == []
    assert find_recomputed("ab") == ["a", "b"]
    store.get_or_compute(("f",), lambda: np.zeros(1000))
    assert find_recomputed("f") == []
    assert find_recomputed("cd") == ["c", "d"]
