"""Laws of contact points: slopes are derivatives, paths compose, and no law creates energy."""

import numpy as np
import pytest

from patchfem.friction import Bonds
from patchfem.friction.laws.bouc_wen import BoucWen
from patchfem.friction.laws.coulomb import Coulomb
from patchfem.friction.laws.iwan import Iwan
from patchfem.friction.laws.lugre import LuGre
from patchfem.friction.laws.tanh import TanhLaw
from patchfem.kernel_cache import load_compiled_module
from patchfem.time_steps import laws
from patchfem.time_steps.step_rows_kernels import N_VALUES, WIDTH, Step, Value

LOAD = 100.0  # N
LENGTH = 1e-6  # m
DURATION = 1e-5  # s
LAWS = {
    "elastic-plastic": laws.make_cells(0.3, LENGTH, LOAD),
    "fixed stiffness": laws.make_cells(0.3, LENGTH, LOAD, is_fixed=True),
    "coulomb behind compliance": laws.make_coulomb(Coulomb(0.3, 0.3), LOAD, 1e-9),
    "iwan": laws.make_iwan(Iwan(0.3, 0.3 / LENGTH, -0.5, 0.5), LOAD),
    "nonlocal": laws.make_bonds(Bonds(0.3, LENGTH), LOAD),
    "dahl": laws.make_lugre(LuGre(0.3, 0.3, 0.3 / LENGTH, 1e-3), LOAD),
    "lugre": laws.make_lugre(LuGre(0.3, 0.25, 0.3 / LENGTH, 1e-3), LOAD),
    "bouc-wen": laws.make_bouc_wen(BoucWen(0.3, LENGTH), LOAD),
    "bouc-wen, exponent 2": laws.make_bouc_wen(BoucWen(0.3, LENGTH, 2.0, 0.7), LOAD),
    "tanh": laws.make_tanh(TanhLaw(0.3, 1e-3), LOAD),
    "tanh behind compliance": laws.make_tanh(TanhLaw(0.3, 1e-3), LOAD, 1e-9),
}


class Point:
    """A point with its law, which slides step by step."""

    def __init__(self, law):
        self.law = law
        blocks = law.make_blocks()
        self.numbers = blocks.numbers[0]
        self.memory = blocks.memory[0].copy()
        self.trial = self.memory.copy()
        self.values = np.zeros(N_VALUES * WIDTH)
        self.values[Value.END_LOAD] = self.values[Value.END_BACK] = law.load[0]
        self.slide_law = load_compiled_module("time_steps.laws_kernels").slide_law
        self.slide(0.0, 0.0, LOAD, 0.0)

    def slide(self, slide, velocity, load, duration=DURATION, commits=True):
        """Return the values after a step; the memory advances if it is committed."""
        last = self.values.copy()
        values = self.values
        values[Value.START] = last[Value.END]
        values[Value.START_VELOCITY] = last[Value.VELOCITY]
        values[Value.START_LOAD] = values[Value.START_BACK] = last[Value.END_LOAD]
        values[Value.SLIDE] = slide
        values[Value.VELOCITY] = velocity
        values[Value.END_LOAD] = values[Value.END_BACK] = load
        step = Step(duration, 1 / duration if duration else 0.0, 0.0)
        self.slide_law(int(self.law.law), self.numbers, self.memory, self.trial, values, 1, step)
        out = values.copy()
        if commits:
            self.memory[:] = self.trial
        else:
            self.values = last
        return out


@pytest.mark.parametrize("varies", [False, True])
@pytest.mark.parametrize("name", LAWS)
def test_laws_create_no_energy(name, varies):
    """Work is at least the change of the stored energy: to round-off, and to 1e-3 of limit times length under load jumps."""
    rng = np.random.default_rng(7)
    point = Point(LAWS[name])
    energy = point.values[Value.ENERGY]
    least = 0.0
    for _ in range(5000):
        load = LOAD * rng.uniform(0.02, 2.0) if varies else LOAD
        slide = LENGTH * rng.normal() * 10 ** rng.uniform(-2, 0.7)
        after = point.slide(slide, slide / DURATION, load)
        least = min(least, after[Value.MEAN] * slide - after[Value.ENERGY] + energy)
        energy = after[Value.ENERGY]
        assert abs(after[Value.END]) <= 0.3 * load * (1 + 1e-12)
    # The path mean of spring and slip in series is not exact where they move against each other.
    tolerance = 1e-3 if varies and name == "tanh behind compliance" else 1e-12
    assert least >= -tolerance * 0.3 * LOAD * LENGTH


# Laws whose slopes under a changing load are approximate
APPROXIMATE = (
    "nonlocal",
    "dahl",
    "lugre",
    "bouc-wen",
    "bouc-wen, exponent 2",
    "tanh behind compliance",
)


@pytest.mark.parametrize("load", [0.5, 1.0, 1.5])
@pytest.mark.parametrize("name", LAWS)
def test_slopes_are_derivatives(name, load):
    """The slopes by slide and by velocity agree with differences, before slip, after a reversal and in slip."""
    if load != 1.0 and name in APPROXIMATE:
        load = 1.0
    stiffness = 0.3 * LOAD / LENGTH
    change = 1e-5 * LENGTH
    for start, slide in ((0.1, 0.07), (0.3, -0.25), (2.0, 1.5)):
        point = Point(LAWS[name])
        velocity = slide * LENGTH / DURATION
        point.slide(start * LENGTH, start * LENGTH / DURATION, LOAD)
        here = point.slide(slide * LENGTH, velocity, load * LOAD, commits=False)
        farther = point.slide(slide * LENGTH + change, velocity, load * LOAD, commits=False)
        faster = point.slide(
            slide * LENGTH, velocity + change / DURATION, load * LOAD, commits=False
        )
        by_slide = (farther - here) / change
        by_velocity = (faster - here) / change
        errors = [
            by_velocity[Value.END] - here[Value.END_BY_VELOCITY] / DURATION,
            by_velocity[Value.MEAN] - here[Value.MEAN_BY_VELOCITY] / DURATION,
        ]
        if name == "tanh behind compliance":
            errors.pop()  # the slope of the mean is approximate
        # The bond length of the LuGre law depends on the mean speed, which the slope leaves out.
        if name not in ("lugre", "tanh behind compliance"):
            errors += [
                by_slide[Value.END] - here[Value.END_BY_SLIDE],
                by_slide[Value.MEAN] - here[Value.MEAN_BY_SLIDE],
            ]
        np.testing.assert_allclose(errors, 0.0, atol=3e-4 * stiffness)


@pytest.mark.parametrize("name", ["nonlocal", "damped lugre"])
def test_exact_kept_bonds_do_not_notice_a_change_of_load_at_rest(name):
    """Bonds that keep the load under which they formed keep force and energy at rest, until the point has no load."""
    damped = LuGre(0.3, 0.25, 0.3 / LENGTH, 1e-3, 50.0, 0.0)
    law = laws.make_lugre(damped, LOAD) if name == "damped lugre" else LAWS[name]
    point = Point(laws.keep_loads(law))
    point.slide(0.5 * LENGTH, 0.0, LOAD)
    before = point.slide(0.0, 0.0, LOAD)
    after = point.slide(0.0, 0.0, 0.3 * LOAD)
    for row in (Value.END, Value.MEAN, Value.ENERGY, Value.STRETCH):
        assert after[row] == pytest.approx(before[Value.END if row == Value.MEAN else row])
    assert point.slide(0.0, 0.0, 0.0)[Value.END] == 0.0
