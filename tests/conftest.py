"""Settings of all tests.

- BLAS has one thread, so that two workers use two cores.
- Property tests have no deadline and draw the same 20 examples in every run (5 under the profile "costly"). With
  `-m slow` they draw ten times as many; with PATCHFEM_SEARCH=1 they draw new ones.
- Cases of a test marked `share(places)` that are not at these places are marked slow.
- Workers start with different folders, so that they do not wait for each other's compiled code.
"""

import gc
import os
import sys
from pathlib import Path

# NumPy reads this variable when it is imported, here and in child processes
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from hypothesis import HealthCheck, settings

from patchfem.kernel_cache import UNCACHED_FUNCTIONS, find_cache_folder

HERE = Path(__file__).parent

CACHE_FOLDER = find_cache_folder().path

# Folders whose tests compile code run first, folders that use this code again run last, all others in between.
COMPILING = ("dynamics", "export", "model", "campaigns", "response", "runs", "commands", "friction")
LATER = ("structure", "wear", "scene", "identify", "torture", "studies")

if sys.dont_write_bytecode:
    # Otherwise each of hundreds of child processes translates all modules that it imports.
    sys.dont_write_bytecode = False
    sys.pycache_prefix = str(CACHE_FOLDER / "bytecode")
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


def list_compiled_functions() -> set:
    """Return the paths of the compiled functions in the cache."""
    return set((CACHE_FOLDER / "code").glob("*.code"))


COMPILED_BEFORE = list_compiled_functions()


def pytest_configure(config):
    """Set the number of random examples; every second worker collects the folders in reverse order.

    Two workers that collect in opposite orders do not translate the same modules to bytecode at the same time.
    """
    worker = int(getattr(config, "workerinput", {}).get("workerid", "gw0")[2:])
    if worker % 2 and len(config.args) == 1 and Path(config.args[0]).is_dir():
        paths = sorted(Path(config.args[0]).iterdir(), reverse=True)
        config.args = [
            str(path)
            for path in paths
            if path.match("test_*.py") or (path.is_dir() and path.name[0].isalpha())
        ]
    factor = 10 if config.option.markexpr == "slow" else 1
    for name, examples in (("patchfem", 20), ("costly", 5)):
        settings.register_profile(
            name,
            max_examples=examples * factor,
            deadline=None,
            suppress_health_check=list(HealthCheck),
            derandomize="PATCHFEM_SEARCH" not in os.environ,
        )
    settings.load_profile("patchfem")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config):
    """Return one worker per core for folders, and none for single files, -k and --lf, which are faster in one process."""
    is_selection = any(
        getattr(config.option, name, False) for name in ("keyword", "lf", "collectonly")
    )
    if is_selection or not all(Path(word).is_dir() for word in config.args):
        config.option.dist = "no"
        return 0
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


@pytest.hookimpl(hookwrapper=True)
def pytest_pycollect_makeitem(collector):
    """Mark the cases that a normal run omits as slow.

    These are the cases of a test marked `share(places)` at other places. With `-m slow` all property tests are among
    them, because they draw more examples there.
    """
    made = (yield).get_result()
    for place, case in enumerate(made if isinstance(made, list) else ()):
        mark = case.get_closest_marker("share") if isinstance(case, pytest.Function) else None
        is_left_out = mark is not None and place not in [kept % len(made) for kept in mark.args]
        draws_more = collector.config.option.markexpr == "slow" and hasattr(
            getattr(case, "obj", None), "hypothesis"
        )
        if is_left_out or draws_more:
            case.add_marker("slow")


def pytest_collection_modifyitems(items):
    """Sort the tests by folder: those that compile code, those that need none, those that use code compiled before."""
    rank = {name: place - len(COMPILING) for place, name in enumerate(COMPILING)}
    rank |= {name: place + 1 for place, name in enumerate(LATER)}

    def sort_key(item) -> tuple:
        """Return the rank of the folder of a test, and the parts of its path."""
        parts = item.path.relative_to(HERE).parts
        return rank.get(parts[0], 0 if len(parts) > 1 else 1), parts

    items.sort(key=sort_key)


def pytest_terminal_summary(terminalreporter):
    """Print the numbers of functions taken from the cache and compiled in this run."""
    new = len(list_compiled_functions() - COMPILED_BEFORE)
    terminalreporter.write_line(
        f"{len(COMPILED_BEFORE)} compiled functions were kept, {new} more are now, in "
        f"{CACHE_FOLDER}"
    )


def pytest_collection():
    """Disable the garbage collector while modules are imported and tests are collected."""
    gc.disable()


def pytest_collection_finish(session):
    """Exclude the imported and collected objects from later garbage collections, and make these rare.

    This saves a twelfth of the CPU time of tests that run mostly Python.
    """
    gc.collect()
    gc.freeze()
    gc.enable()
    gc.set_threshold(100_000, 20, 100)


@pytest.fixture(autouse=True)
def fail_on_uncached_functions():
    """Fail a test that calls a compiled function whose machine code cannot be cached.

    Each process that calls such a function would wait for numba and its compiler.
    """
    yield
    uncached = sorted(UNCACHED_FUNCTIONS)
    UNCACHED_FUNCTIONS.clear()
    assert not uncached, (
        f"not kept as machine code: {', '.join(uncached)}; such a function allocates memory, or an argument is not a "
        "number, an array or a tuple of these"
    )
