"""Wear of grooves: worn volume, amplitude, friction work, complete removal and growth of the
motion."""

import numpy as np
import pytest
from scene_texts import BLOCK, COULOMB, GROOVES
from scipy.integrate import quad, solve_ivp

from patchfem import build
from patchfem.runs.run import run as run_plan
from patchfem.scene import loads

MU, LOAD, KAPPA, WAVE, AREA = 0.4, 115.0, 2e-14, 2 * np.pi / 80e-6, 12.7e-3**2
PIECES = (
    BLOCK
    + 'element_size = "1 mm"\n'
    + GROOVES
    + COULOMB.replace("0.3", "0.4")
    + '[wear]\ncoefficient = "2e-14 m^2/N"\ncycles = 4e6\n'
)
SLIDE = '[slide]\nkind = "triangle"\namplitude = "15 um"\nspeed = "1 mm/s"\ncycles = 2\n'
RIG = """
[structure]
moving_mass = "1.194 kg"
travel = "0.5 mm"
mode = [{name = "axial", frequency = "143 Hz", damping = 0.003, slide = 1.0}]
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "7 g"
cycles = 60
[accuracy]
tolerance = 1e-2
steps_per_cycle = 100
"""


def run_with_keys(text, estimate=True, **keys):
    """Return the result of a scene with some keys replaced."""
    model = build(loads(text, sets=[f"{key}={value}" for key, value in keys.items()]))
    return run_plan(model, estimate=estimate)


def measure_value(result, name):
    """Return the value of a measure."""
    return result.measures[name].value


def slip_path_per_cycle(amplitude, reach=15e-6):
    """Return int R ds/N over a cycle between +-reach, where R ds = (1 + t^2)/(1 -+ mu t) N dq."""

    def slip_rate(q, direction):
        t = amplitude * WAVE * np.sin(WAVE * q)
        return (1 + t * t) / (1 - direction * MU * t)

    return sum(quad(slip_rate, -reach, reach, args=(direction,))[0] for direction in (-1, 1))


def test_exact_worn_amplitude_agrees_with_differential_equation():
    """The worn amplitude agrees with dA/dn = -share kappa N int R ds/N divided by the area, for the
    piece that wears more; the worn volume is that of both pieces."""
    result = run_with_keys(PIECES + SLIDE, **{"wear.upper_share": 0.3})
    larger_share = 0.7
    solution = solve_ivp(
        lambda n, a: -larger_share * KAPPA * LOAD * slip_path_per_cycle(a[0]) / AREA,
        (0, 4e6),
        [7.5e-6],
        rtol=1e-9,
        atol=1e-15,
    )
    amplitude = result.measures["groove_amplitude"]
    volume = measure_value(result, "worn_volume")
    assert abs(amplitude.value - solution.y[0, -1]) <= amplitude.error < 2e-3 * amplitude.value
    assert (7.5e-6 - amplitude.value) * AREA == pytest.approx(larger_share * volume, rel=1e-12)
    slope = amplitude.value * WAVE
    t = slope * np.sin(WAVE * 15e-6)
    assert measure_value(result, "friction_force_peak") == pytest.approx(
        LOAD * (t + MU) / (1 - MU * t), rel=1e-9
    )
    history = result.wear.columns
    assert history["groove_amplitude"][0] == 7.5e-6
    assert (np.diff(history["groove_amplitude"]) < 0).all()


SHEARED_PIECES = PIECES.replace("[friction]", "[contact.shear]\n[friction]")


@pytest.mark.share(0)
@pytest.mark.parametrize(
    ("text", "keys"),
    [
        (SLIDE, {"slide.amplitude": "0.3 um", "contact.grooves.phase": "1 rad"}),
        (
            RIG,
            {
                "drive.acceleration": "5 g",
                "drive.cycles": 20,
                "contact.grooves.lifted_mass": "0.4 kg",
            },
        ),
        pytest.param(
            RIG,
            {
                "drive.acceleration": "5 g",
                "drive.cycles": 20,
                "friction.law": "elastic-plastic",
                "friction.bond_length": "5 nm",
            },
            marks=pytest.mark.slow,
        ),
    ],
)
def test_wear_of_sheared_patch_agrees_with_friction_work(text, keys):
    """The wear of all points adds up to kappa times the friction work (form 'energy'), or to this
    divided by mu (form 'archard'); half of the volume is taken from each piece."""
    for form, divisor in (("archard", MU), ("energy", 1.0)):
        result = run_with_keys(
            SHEARED_PIECES + text,
            False,
            **{"wear.form": f'"{form}"', "wear.cycles": 10, "wear.jumps": 1, **keys},
        )
        volume = measure_value(result, "worn_volume")
        assert volume == pytest.approx(
            KAPPA * 10 * measure_value(result, "loop_area") / divisor, rel=1.2e-3
        )
        assert (7.5e-6 - measure_value(result, "groove_amplitude")) * AREA == pytest.approx(
            0.5 * volume, rel=1e-9
        )
        assert measure_value(result, "energy_balance") < 1e-8


def test_exact_removed_grooves_leave_coulomb_loop():
    """After the grooves are worn away, the loop is that of Coulomb's law on a flat surface."""
    result = run_with_keys(PIECES + SLIDE, False, **{"wear.cycles": 1e8})
    assert measure_value(result, "groove_amplitude") == 0.0
    assert measure_value(result, "loop_area") == pytest.approx(4 * MU * LOAD * 15e-6, rel=1e-12)
    assert measure_value(result, "worn_volume") > 2 * 7.5e-6 * AREA
