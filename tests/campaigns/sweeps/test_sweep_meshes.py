"""Meshes that the cases of a sweep share, for any division into chunks and processes."""

from pathlib import Path

import numpy as np
import pytest
from scene_texts import COULOMB, DRIVE, MODE, PATCH

import patchfem as pf
from patchfem.campaigns import Cases, SweepScene, WorkerData, iterate_chunks
from patchfem.campaigns.sweeps.executors import LocalExecutor
from patchfem.campaigns.sweeps.executors.pool import Pool
from patchfem.runs.batch.case_results import join_case_results
from patchfem.scene import read_assignments

MOTION = COULOMB + MODE + DRIVE
WORK = WorkerData(
    SweepScene(Path("a.toml"), PATCH),
    Cases(
        tuple(
            read_assignments(["contact.tilt.angle=2e-5 rad,2e-4 rad", "contact.load=50 N,100 N"])[0]
        )
    ),
)


def test_exact_rigs_have_the_meshes_of_single_runs():
    """The values of a sweep of rigs are those of single runs."""
    scene = SweepScene(Path("a.toml"), PATCH + MOTION)
    work = WorkerData(scene, WORK.cases)
    for (number,), results, _ in iterate_chunks(work, [0, 3], LocalExecutor()):
        single = pf.run(scene.build_model(work.cases.assignments(number))).measures
        for name in results.values:
            if single[name].value is not None:
                np.testing.assert_allclose(results.values[name], single[name].value, 1e-9)


@pytest.mark.slow
def test_exact_processes_use_the_chosen_meshes():
    """The results of several processes agree with those of a single process within 1e-9."""
    local = join_case_results(
        4, [part[:2] for part in iterate_chunks(WORK, range(4), LocalExecutor())]
    )
    joined = join_case_results(4, [part[:2] for part in iterate_chunks(WORK, range(4), Pool(2))])
    assert joined.numerics == local.numerics
    for name, values in local.values.items():
        np.testing.assert_allclose(joined.values[name], values, rtol=1e-9)
