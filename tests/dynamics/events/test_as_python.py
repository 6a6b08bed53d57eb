"""The loop of events as Python: the same motion as compiled, as long as its work is short."""

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from modal_bases import random_basis

from patchfem.core import SineDrive
from patchfem.dynamics import make_coulomb_elements, make_elements
from patchfem.dynamics.events import cost, histories
from patchfem.structure import drives

SINE = SineDrive(1.0, 1.2)
SWEEP = drives.SweepDrive(0.1, 0.4, 40.0, 1.0)
CASES = (
    # seed, modes, interfaces, kind of the interfaces, drive
    (1, 1, 1, "rigid", SINE),
    (2, 1, 1, "springs", SINE),
    (3, 3, 2, "rigid", SINE),
    (4, 2, 2, "springs", SINE),
    (5, 5, 5, "rigid", SINE),
    (6, 2, 1, "rigid", SWEEP),
    (7, 1, 1, "none", SINE),
)
# A process of its own with an empty cache: short runs do not wait for a compiler there.
AS_PYTHON = """\
import pickle, sys
sys.path[:0] = {paths!r}
import test_as_python
motions = [test_as_python.motion_of(*case) for case in test_as_python.CASES]
assert "numba" not in sys.modules
with open({file!r}, "wb") as file:
    pickle.dump(motions, file)
"""


def interface_of(rng, kind: str):
    """Return the elements of an interface."""
    if kind == "none":
        return make_coulomb_elements(0.0)
    if kind == "springs":
        return make_elements(rng.uniform(0.2, 1.0, 5), rng.uniform(0.05, 1.0, 5))
    return make_coulomb_elements(*sorted(rng.uniform(0.2, 0.6, 2), reverse=True))


def motion_of(seed: int, n_modes: int, n_interfaces: int, kind: str, drive) -> dict:
    """Run 6 cycles and return the histories, the events and what is read from the last cycles."""
    rng = np.random.default_rng(seed)
    modes = random_basis(rng, n_modes, n_interfaces)
    groups = [interface_of(rng, kind) for _ in range(n_interfaces)]
    run = histories.simulate(modes, drive, groups, 6.0, window=3)
    names = ("time", "modal", "modal_rate", "force", "slip")
    return {
        "events": (run.events, run.log.count, run.log.kind.tolist()),
        "histories": {name: getattr(run.response, name) for name in names},
        "readings": (run.reading.run, run.reading.faces),
    }


@pytest.fixture(scope="module")
def as_python(tmp_path_factory):
    """The motions of all cases in a process that does not compile."""
    place = tmp_path_factory.mktemp("python")
    file = place / "motions"
    paths = [str(Path(__file__).parent), str(Path(__file__).parents[2] / "support")]
    code = AS_PYTHON.format(paths=paths, file=str(file))
    environment = os.environ | {"PATCHFEM_CACHE": str(place)}
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)
    return pickle.loads(file.read_bytes())


@pytest.mark.parametrize("number", range(len(CASES)))
def test_exact_the_same_motion_as_compiled(as_python, number):
    """To 1e-11 of its size: the compiler may add in another order, and a motion that rubs
    doubles such differences."""
    python = as_python[number]
    compiled = motion_of(*CASES[number])
    assert python["events"] == compiled["events"] and python["events"][0] > 12
    for name, values in python["histories"].items():
        atol = 1e-11 * max(1.0, np.abs(values).max())
        np.testing.assert_allclose(values, compiled["histories"][name], rtol=0, atol=atol)
    for ours, theirs in zip(python["readings"], compiled["readings"]):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-10)


def test_always_the_cost_as_python_rises_with_what_there_is_to_do():
    rng = np.random.default_rng(4)
    small = random_basis(rng, 1, 1)
    large = random_basis(rng, 6, 3)
    assert (
        0
        < cost.estimate_cycle_time(small, SINE, 0.0, 0)
        < cost.estimate_cycle_time(small, SINE, 1e3, 5)
    )
    assert cost.estimate_cycle_time(small, SINE, 0.0, 0) < cost.estimate_cycle_time(
        large, SINE, 0.0, 0
    )
