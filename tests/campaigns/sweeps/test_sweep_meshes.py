"""Meshes that the cases of a sweep share, for any division into chunks and processes."""

from pathlib import Path

import numpy as np
import pytest
from scene_texts import COULOMB, DRIVE, MODE, PATCH

from patchfem.campaigns import Cases, SweepScene, WorkerData, iterate_chunks
from patchfem.campaigns.sweeps.executors import LocalExecutor
from patchfem.campaigns.sweeps.executors.pool import Pool
from patchfem.campaigns.sweeps.sweep import prepare_work
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


def test_exact_meshes_are_chosen_once_for_all_cases():
    """The mesh of a sweep is chosen once and stored with its work; twice as long cells meet four times the tolerance."""
    sizes = []
    for tolerance in (1e-3, 4e-3):
        scene = SweepScene(Path("a.toml"), f"{PATCH}{MOTION}[accuracy]\ntolerance = {tolerance}\n")
        work = prepare_work(WorkerData(scene, WORK.cases))
        ((finest, *_),) = work.meshes.meshes.values()
        sizes.append(finest[0].x.size)
    assert sizes[0] / sizes[1] == pytest.approx(2, rel=0.1)


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
