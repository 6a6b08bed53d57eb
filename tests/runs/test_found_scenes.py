"""Scenes whose bars once missed: each measure lies inside its bar of what is true.

The truths printed here come from other programs or from many more steps; those of the slow tests from the independent
integrator of `motion_reference`.
"""

from pathlib import Path

import pytest
from motion_scenes import spec, written

from patchfem import run

FOUND = Path(__file__).parent / "found"
KNOWN = [  # scene, measure, truth, half a unit of its last digit
    ("s77_21", "relative_displacement_amplitude", 3.5862e-5, 5e-10),
    ("s77_21", "absolute_acceleration_peak", 3.562, 5e-4),
    ("s77_21", "friction_force_peak", 2.820, 5e-4),
    ("s77_41", "relative_displacement_amplitude", 6.458e-5, 5e-9),
    ("s20261120_51", "friction_force_peak", 28.747, 5e-4),
    ("s20261120_10", "drift_per_cycle", 1.891e-8, 5e-12),
    ("s77_40", "drift_per_cycle", -1.02e-8, 5e-11),
]


@pytest.mark.parametrize(("name", "measure", "truth", "digit"), KNOWN)
def test_exact_a_truth_from_outside_lies_inside_the_bar(name, measure, truth, digit):
    found = run(FOUND / f"{name}.toml").measures[measure]
    assert abs(found.value - truth) <= found.error + digit
    assert found.error <= 0.1 * abs(found.value)


DRAWN = [  # random scene, measure, truth of the independent program, half a unit of its last digit
    (7062, "stick_fraction", 0.048004613, 5e-10),  # off 400 samples a cycle it was 0.0403
    (7062, "slip_start_phase", 2.089609, 5e-7),
    (
        5046,
        "relative_displacement_amplitude",
        8.20190559e-6,
        5e-15,
    ),  # 768 cells for the density of Iwan's law
    (5046, "equivalent_stiffness", -74645.1102, 5e-5),
    (
        9256,
        "relative_displacement_amplitude",
        6.689247147339e-5,
        5e-18,
    ),  # the rise at v_s lay between the stages
    (9256, "equivalent_stiffness", 4188.7310127, 5e-8),
]


@pytest.mark.share(2, 3)
@pytest.mark.parametrize(("seed", "measure", "truth", "digit"), DRAWN)
def test_exact_a_random_scene_holds_what_the_independent_program_found(
    seed, measure, truth, digit, tmp_path
):
    asked = spec(seed)
    if seed == 5046:  # all its cells, where a looser tolerance takes as few as do
        asked["tolerance"] = 1e-6
    found = run(written(asked, tmp_path)).measures[measure]
    assert abs(found.value - truth) <= found.error + digit
    # a run whose steps meet a tolerance keeps a hundredth of the floor, a crossing besides 1e-7, 1e-4 of its floor
    assert found.error <= 1e-6 * abs(found.value) + 0.0101 * found.floor


@pytest.mark.parametrize(
    ("measure", "truth"), [("stick_fraction", 0.1762914152), ("slip_start_phase", 2.2076168335)]
)
def test_instants_of_slip_of_a_density_in_cells_have_an_error_of_first_order(
    measure, truth, tmp_path
):
    """The stiffness of Iwan's law jumps from cell to cell; with errors of second order, which were 1.4 times too small
    here, the run took a quarter of the cells."""
    found = run(written(spec(97000034), tmp_path)).measures[measure]
    assert abs(found.value - truth) <= found.error <= 0.01
