"""Memory of elastic-plastic elements against the elements one by one, and known loops."""

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.dynamics import make_elements
from patchfem.dynamics.events import memory_kernels as kernels
from patchfem.dynamics.events.elements import (
    element_stretches,
    make_element_table,
    unstretched_memory,
)


class Follower:
    """Elements along prescribed slides, by the memory of the engine and one by one."""

    def __init__(self, stiffness, yield_displacement):
        self.k = np.asarray(stiffness, float)
        self.y = np.asarray(yield_displacement, float)
        self.group = make_elements(self.k, self.y)
        self.table = make_element_table([self.group])
        self.memory = unstretched_memory(self.table, [0.0])
        self.stretch = np.zeros(self.k.size)
        self.lost = 0.0
        self.depth = 0

    def to(self, slide: float) -> float:
        """Slide straight to a place [m]; the force [N] there."""
        memory = self.memory
        way = 1.0 if slide > self.memory.slide[0] else -1.0
        if memory.n_slipping[0] and memory.direction[0] != way:
            kernels.store_reversal.py_func(0, memory)
        while (
            way * (at := kernels.next_yield_slide.py_func(0, way, self.table, memory))
            <= way * slide
        ):
            self.lost += self.limit * abs(at - memory.slide[0])
            memory.slide[0] = at
            kernels.release_next_element.py_func(0, way, self.table, memory)
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
def test_exact_memory_is_that_of_elements_one_by_one(seed):
    random = np.random.default_rng(seed)
    count = int(random.integers(1, 60))
    y = np.exp(random.uniform(-4, 0, count))
    y[random.random(count) < 0.2] = y[0]  # equal yields become one element
    k = random.uniform(0.1, 2.0, count) * (random.random(count) > 0.1)
    one = Follower(k, y)
    for slide in np.cumsum(random.normal(0.0, 0.6, 300) * random.random(300) ** 2):
        force = one.to(slide)
        assert force == pytest.approx(k @ one.stretch, abs=1e-12 * (k @ y))
        energy = kernels.find_force_and_energy.py_func(0, one.table, one.memory)[1]
        assert energy == pytest.approx(0.5 * k @ one.stretch**2, rel=1e-10, abs=1e-12)
        np.testing.assert_allclose(
            k * element_stretches(one.group, one.memory, 0), k * one.stretch, atol=1e-12
        )
    # a turning point that says nothing more is forgotten
    assert one.depth <= one.group.yield_displacement.size + 1


def test_refuses_elements_that_are_none():
    with pytest.raises(PatchfemError, match="finite"):
        make_elements([1.0, -1.0], [1.0, 1.0])
    with pytest.raises(PatchfemError, match="finite"):
        make_elements([1.0], [np.inf])
