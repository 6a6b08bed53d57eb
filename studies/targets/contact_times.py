"""Seconds of the contact patch: medians of CPU seconds of one thread."""

import sys
from pathlib import Path
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from contact_accuracy import COATED, COATING
from contact_identities import HEIGHT, LENGTH, LOAD, MOUNTS, coated_pair
from maps import press_map

from patchfem.contact.gaps import crown, tilt
from patchfem.contact.unilateral import press
from patchfem.core import Outcome
from patchfem.elasticity.elasticity import assemble, interface_compliance
from patchfem.mesh.tensor import graded_grid


def _median(work, repeats: int) -> float:
    seconds = []
    for _ in range(repeats):
        start = process_time()
        work()
        seconds.append(process_time() - start)
    return float(np.median(seconds))


def condensing(nodes: int, repeats: int = 3) -> float:
    """Assembly and condensation of one coated piece, normal, tangential and coupling [s]."""
    grid = graded_grid(LENGTH, HEIGHT, LENGTH / (nodes - 1), COATING)
    return _median(lambda: interface_compliance(assemble(grid.x, grid.depth, grid.coating_rows, COATED)), repeats)


def cold_solve(nodes: int, repeats: int = 5) -> float:
    """The slowest of a flat face, the tilts and two crowns from nothing [s]."""
    pair = coated_pair(nodes)
    x = pair.interface.x
    gaps = [tilt(x, angle) for angle in MOUNTS] + [crown(x, radius) for radius in (1.0, 10.0)]
    return max(_median(lambda gap=gap: press(pair, gap, LOAD), repeats) for gap in gaps)


def _steps(pair, tilts, loads) -> list:
    """CPU seconds of each solve of a map, every one started from its neighbour's contact set."""
    x, start, seconds = pair.interface.x, None, []
    for row, angle in enumerate(tilts):
        gap = tilt(x, angle)
        for load in loads if row % 2 == 0 else loads[::-1]:
            before = process_time()
            start = press(pair, gap, load, rotation=angle, start=start).sigma_n > 0
            seconds.append(process_time() - before)
    return seconds


def warm_step(nodes: int = 400) -> float:
    """Median of 200 tilts from 2e-5 to 1e-3 rad, each from the one before [s]."""
    return float(np.median(_steps(coated_pair(nodes), np.geomspace(2e-5, 1e-3, 200), np.array([LOAD]))[1:]))


def map_of_1000(nodes: int = 400) -> float:
    """25 tilts from 1e-6 to 1e-3 rad by 40 loads from 0.1 to 2 times 26 lbf [s]."""
    pair = coated_pair(nodes)
    begin = process_time()
    found = press_map(pair, np.zeros(pair.interface.x.size), LOAD * np.geomspace(0.1, 2, 40),
                      np.geomspace(1e-6, 1e-3, 25))
    assert (found.outcome == Outcome.DONE).all()
    return process_time() - begin
