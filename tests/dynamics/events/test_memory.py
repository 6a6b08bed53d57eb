"""Memory of elastic-plastic elements in the event engine, against the elements one by one."""

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.dynamics import make_elements
from patchfem.dynamics.events import memory_kernels as kernels
from patchfem.dynamics.events.elements import (
    element_stretches,
    make_element_table,
    make_unstretched_memory,
)


class SlideTracker:
    """Parallel elements along a prescribed slide, tracked by the memory of the event engine and one
    by one."""

    def __init__(self, stiffness, yield_displacement):
        self.k = np.asarray(stiffness, float)
        self.y = np.asarray(yield_displacement, float)
        self.group = make_elements(self.k, self.y)
        self.table = make_element_table([self.group])
        self.memory = make_unstretched_memory(self.table, [0.0])
        self.stretch = np.zeros(self.k.size)
        self.lost = 0.0
        self.depth = 0

    def move_to(self, slide: float) -> float:
        """Slide in a straight line to a position [m] and return the force there [N]."""
        memory = self.memory
        direction = 1.0 if slide > self.memory.slide[0] else -1.0
        if memory.n_slipping[0] and memory.direction[0] != direction:
            kernels.store_reversal.py_func(0, memory)
        while (
            direction
            * (next_yield := kernels.next_yield_slide.py_func(0, direction, self.table, memory))
            <= direction * slide
        ):
            self.lost += self.limit * abs(next_yield - memory.slide[0])
            memory.slide[0] = next_yield
            kernels.release_next_element.py_func(0, direction, self.table, memory)
        self.lost += self.limit * abs(slide - memory.slide[0])
        self.stretch = np.clip(self.stretch + slide - self.before, -self.y, self.y)
        memory.slide[0] = self.before = slide
        self.depth = max(self.depth, int(memory.n_groups[0]))
        return kernels.find_force_and_energy.py_func(0, self.table, memory)[0]

    before = 0.0

    @property
    def limit(self) -> float:
        return kernels.find_tangent.py_func(0, self.table, self.memory)[2]


@pytest.mark.share(0, 4, 8, 11)
@pytest.mark.parametrize("seed", range(12))
def test_exact_memory_agrees_with_single_elements(seed):
    """Force, energy and stretches from the memory agree within 1e-10 with the elements one by one,
    along random slides."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 60))
    y = np.exp(rng.uniform(-4, 0, count))
    y[rng.random(count) < 0.2] = y[0]  # elements with equal yield slides are merged
    k = rng.uniform(0.1, 2.0, count) * (rng.random(count) > 0.1)
    tracker = SlideTracker(k, y)
    for slide in np.cumsum(rng.normal(0.0, 0.6, 300) * rng.random(300) ** 2):
        force = tracker.move_to(slide)
        assert force == pytest.approx(k @ tracker.stretch, abs=1e-12 * (k @ y))
        energy = kernels.find_force_and_energy.py_func(0, tracker.table, tracker.memory)[1]
        assert energy == pytest.approx(0.5 * k @ tracker.stretch**2, rel=1e-10, abs=1e-12)
        np.testing.assert_allclose(
            k * element_stretches(tracker.group, tracker.memory, 0), k * tracker.stretch, atol=1e-12
        )
    # reversals that no longer affect the force are deleted
    assert tracker.depth <= tracker.group.yield_displacement.size + 1


def test_refuses_invalid_elements():
    """Elements with a negative stiffness or an infinite yield slide are refused."""
    with pytest.raises(PatchfemError, match="finite"):
        make_elements([1.0, -1.0], [1.0, 1.0])
    with pytest.raises(PatchfemError, match="finite"):
        make_elements([1.0], [np.inf])
