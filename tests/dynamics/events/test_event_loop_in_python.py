"""The event loop in plain Python, which computes short motions, against the compiled loop."""

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from modal_bases import make_random_modal_basis

from patchfem.core import SineDrive
from patchfem.dynamics import make_coulomb_elements, make_elements
from patchfem.dynamics.events import histories
from patchfem.structure import drives

SINE = SineDrive(1.0, 1.2)
SWEEP = drives.SweepDrive(0.1, 0.4, 40.0, 1.0)
CASES = (
    # seed, number of modes, number of interfaces, kind of interface, drive
    (3, 3, 2, "rigid", SINE),
    (4, 2, 2, "springs", SINE),
    (6, 2, 1, "rigid", SWEEP),
    (7, 1, 1, "none", SINE),
)
# A separate process with an empty cache, in which short runs do not wait for the compiler.
AS_PYTHON = """\
import pickle, sys
sys.path[:0] = {paths!r}
import test_event_loop_in_python
motions = [test_event_loop_in_python.compute_motion(*case) for case in test_event_loop_in_python.CASES]
assert "numba" not in sys.modules
with open({file!r}, "wb") as file:
    pickle.dump(motions, file)
"""


def make_interface(rng, kind: str):
    """Return the elements of an interface of a given kind."""
    if kind == "none":
        return make_coulomb_elements(0.0)
    if kind == "springs":
        return make_elements(rng.uniform(0.2, 1.0, 5), rng.uniform(0.05, 1.0, 5))
    return make_coulomb_elements(*sorted(rng.uniform(0.2, 0.6, 2), reverse=True))


def compute_motion(seed: int, n_modes: int, n_interfaces: int, kind: str, drive) -> dict:
    """Run 6 cycles and return the histories, the events and the measures of the last cycles."""
    rng = np.random.default_rng(seed)
    modes = make_random_modal_basis(rng, n_modes, n_interfaces)
    groups = [make_interface(rng, kind) for _ in range(n_interfaces)]
    run = histories.simulate(modes, drive, groups, 6.0, window=3)
    names = ("time", "modal", "modal_rate", "force", "slip")
    return {
        "events": (run.events, run.log.count, run.log.kind.tolist()),
        "histories": {name: getattr(run.response, name) for name in names},
        "readings": (run.reading.run, run.reading.faces),
    }


@pytest.fixture(scope="module")
def python_motions(tmp_path_factory):
    """Return the motions of all cases, computed in a process that does not compile."""
    folder = tmp_path_factory.mktemp("python")
    file = folder / "motions"
    paths = [str(Path(__file__).parent), str(Path(__file__).parents[2] / "support")]
    code = AS_PYTHON.format(paths=paths, file=str(file))
    environment = os.environ | {"PATCHFEM_CACHE": str(folder)}
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)
    return pickle.loads(file.read_bytes())


@pytest.mark.parametrize("number", range(len(CASES)))
def test_exact_python_motion_agrees_with_compiled_motion(python_motions, number):
    """The motion in plain Python agrees with the compiled one within 1e-11 of its size. A compiler
    may change the order of sums, and friction amplifies such differences."""
    python = python_motions[number]
    compiled = compute_motion(*CASES[number])
    assert python["events"] == compiled["events"] and python["events"][0] > 12
    for name, values in python["histories"].items():
        atol = 1e-11 * max(1.0, np.abs(values).max())
        np.testing.assert_allclose(values, compiled["histories"][name], rtol=0, atol=atol)
    for measures, expected in zip(python["readings"], compiled["readings"]):
        np.testing.assert_allclose(measures, expected, rtol=1e-9, atol=1e-10)
