"""Cases of a sweep share their meshes whichever of them are done here, and in which chunks."""

from pathlib import Path

import numpy as np
from scene_texts import PATCH

from patchfem.campaigns.sweeps.asked import Asked
from patchfem.campaigns.sweeps.cases import Cases
from patchfem.campaigns.sweeps.executors.here import Here
from patchfem.campaigns.sweeps.sweep import Work, solved, with_meshes
from patchfem.runs.many.answers import joined
from patchfem.scene.axes import read

WORK = Work(Asked(Path("a.toml"), PATCH), Cases(tuple(read(["contact.tilt.angle=2e-5 rad,2e-4 rad",
                                                           "contact.load=50 N,100 N"])[0])))


def test_exact_a_part_of_a_sweep_has_the_answers_of_the_whole():
    whole = joined(4, [part[:2] for part in solved(WORK, range(4), Here())])
    rest = joined(4, [part[:2] for part in solved(WORK, [3, 1], Here())])
    assert len({one["interface_nodes"] for one in whole.numerics.values()}) == 1
    for name, values in whole.values.items():
        np.testing.assert_allclose(rest.values[name][[3, 1]], values[[3, 1]], rtol=1e-9)


def test_exact_meshes_are_made_once_and_travel_with_the_work():
    work = with_meshes(WORK)
    assert with_meshes(work) is work and len(work.meshes.meshes) == 1
