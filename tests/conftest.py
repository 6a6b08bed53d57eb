"""For every test: one BLAS thread, so that two cores serve two tests, and no deadline, so that a busy machine fails
nothing. A property test draws 20 examples, 5 where each is costly; with `-m slow` all of them run again, with ten times
as many. The examples are the same in every run, so that a failure is of the change at hand; PATCHFEM_SEARCH=1 draws new
ones."""

import gc
import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is imported, here and in child processes

import pytest
from hypothesis import HealthCheck, settings

from patchfem import compiled
from patchfem.compiled import UNKEPT, cache_folder

HERE = Path(__file__).parent

os.environ.setdefault("NUMBA_CACHE_DIR", str(cache_folder()))  # else an edited kernel runs as its old self

# half of the tests, in folders whose runs compile; then those that compile nothing, then what meets compiled code again
COMPILING = ("dynamics", "export", "model", "campaigns", "response", "runs", "commands", "friction")
LATER = ("structure", "wear", "scene", "identify", "torture", "studies")
compiled.PATIENCE = -1.0  # a test runs what is compiled, also where nothing is kept and little would have to run

if sys.dont_write_bytecode:  # hundreds of child processes would each compile all that they import
    sys.dont_write_bytecode, sys.pycache_prefix = False, str(cache_folder() / "bytecode")
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


def kept() -> set:
    """Files of compiled functions."""
    return set((cache_folder() / "code").glob("*.code"))


KEPT = kept()


def pytest_configure(config):
    """How many examples a property test draws; "costly" is for @settings. Of the workers every other one collects from
    the end: what one of them has read and rewritten the other finds as bytecode."""
    odd = int(getattr(config, "workerinput", {}).get("workerid", "gw0")[2:]) % 2
    if odd and len(config.args) == 1 and Path(config.args[0]).is_dir():
        config.args = [str(path) for path in sorted(Path(config.args[0]).iterdir(), reverse=True)
                       if path.match("test_*.py") or (path.is_dir() and path.name[0].isalpha())]
    often = 10 if config.option.markexpr == "slow" else 1
    for name, examples in (("patchfem", 20 * often), ("costly", 5 * often)):
        settings.register_profile(name, max_examples=examples, deadline=None, suppress_health_check=list(HealthCheck),
                                  derandomize="PATCHFEM_SEARCH" not in os.environ)
    settings.load_profile("patchfem")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config):
    """One worker a core for folders; none for files, single tests, -k and --lf, which are done before workers start."""
    chosen = config.option.keyword or config.option.lf or config.option.collectonly
    if chosen or not all(Path(word).is_dir() for word in config.args):
        config.option.dist = "no"
        return 0
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


@pytest.hookimpl(hookwrapper=True)
def pytest_pycollect_makeitem(collector):
    """The cases of a test marked `share(places)` that stand at other places than these become slow, and with `-m slow`
    all property tests."""
    made = (yield).get_result()
    for place, case in enumerate(made if isinstance(made, list) else ()):
        mark = case.get_closest_marker("share") if isinstance(case, pytest.Function) else None
        again = collector.config.option.markexpr == "slow" and hasattr(getattr(case, "obj", None), "hypothesis")
        if again or (mark and place not in [one % len(made) for one in mark.args]):
            case.add_marker("slow")


def pytest_collection_modifyitems(items):
    """Of two workers one begins with the folders whose runs compile, the other in the middle, with those whose tests
    compile nothing: neither waits for what the other compiles."""
    rank = {name: place - len(COMPILING) for place, name in enumerate(COMPILING)} | {
        name: place + 1 for place, name in enumerate(LATER)}

    def place(item) -> tuple:
        parts = item.path.relative_to(HERE).parts
        return rank.get(parts[0], 0 if len(parts) > 1 else 1), parts

    items.sort(key=place)


def pytest_terminal_summary(terminalreporter):
    """What a cold run is told from a warm one by."""
    terminalreporter.write_line(f"{len(KEPT)} compiled functions were kept, {len(kept() - KEPT)} more are now, in "
                                f"{cache_folder()}")


def pytest_collection():
    """No search for garbage among what is imported and collected."""
    gc.disable()


def pytest_collection_finish(session):
    """What has been imported and collected stays for good: no search for garbage goes through it again, and later ones
    are rare, a twelfth of the CPU time of tests of much Python."""
    gc.collect()
    gc.freeze()
    gc.enable()
    gc.set_threshold(100_000, 20, 100)


@pytest.fixture(autouse=True)
def machine_code_is_kept():
    """Every compiled function that a test calls must be one whose machine code is kept: else each process that calls it
    waits for numba, and where it is not cached either, for its compiler."""
    yield
    unkept, _ = sorted(UNKEPT), UNKEPT.clear()
    assert not unkept, f"not kept as machine code: {', '.join(unkept)}; it allocates, or an argument is no float, " \
        "whole number, array or tuple of these"
