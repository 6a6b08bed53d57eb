"""Grooves that wear: volume, amplitude by its own differential equation, work of friction, capacity and runaway."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from patchfem import build
from patchfem.runs.run import run as run_plan
from patchfem.scene import loads

MU, LOAD, KAPPA, WAVE, AREA = 0.4, 115.65, 2e-14, 2 * np.pi / 80e-6, 12.7e-3**2
PIECES = """
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6 mm"
load = "115.65 N"
substrate = "Ti-8Al-1Mo-1V"
element_size = "1 mm"
grooves = {wavelength = "80 um", amplitude = "7.5 um"}
[friction]
law = "coulomb"
static = 0.4
[wear]
coefficient = "2e-14 m^2/N"
cycles = 4e6
"""
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


def run(text, estimate=True, **keys):
    model = build(loads(text, sets=[f"{key}={value}" for key, value in keys.items()]))
    return run_plan(model, estimate=estimate)


def value(result, name):
    return result.measures[name].value


def path(amplitude, reach=15e-6):
    """int R ds/N over a cycle between +-reach, R ds = (1 + t^2)/(1 -+ mu t) N dq."""

    def part(q, way):
        t = amplitude * WAVE * np.sin(WAVE * q)
        return (1 + t * t) / (1 - way * MU * t)

    return sum(quad(part, -reach, reach, args=(way,))[0] for way in (-1, 1))


@pytest.mark.parametrize("share", [0.5, 0.3])
def test_exact_the_amplitude_by_its_own_differential_equation(share):
    """dA/dn = -share kappa N int R ds/N over the area, of the piece that loses more; the volume is what left both."""
    found = run(PIECES + SLIDE, **{"wear.upper_share": share})
    more = max(share, 1 - share)
    way = solve_ivp(
        lambda n, a: -more * KAPPA * LOAD * path(a[0]) / AREA,
        (0, 4e6),
        [7.5e-6],
        rtol=1e-9,
        atol=1e-15,
    )
    left = found.measures["groove_amplitude"]
    volume = value(found, "worn_volume")
    assert abs(left.value - way.y[0, -1]) <= left.error < 2e-3 * left.value
    assert (7.5e-6 - left.value) * AREA == pytest.approx(more * volume, rel=1e-12)
    steep = left.value * WAVE
    t = steep * np.sin(WAVE * 15e-6)
    assert value(found, "friction_force_peak") == pytest.approx(
        LOAD * (t + MU) / (1 - MU * t), rel=1e-9
    )
    history = found.extra["wear"]
    assert history["groove_amplitude"][0] == 7.5e-6
    assert (np.diff(history["groove_amplitude"]) < 0).all()


@pytest.mark.share(1)
@pytest.mark.parametrize("lifted", ["0 kg", "0.4 kg"])
def test_exact_a_rig_wears_by_the_work_of_its_friction(lifted):
    """Coulomb: f = mu R along the flank, so kappa int R ds is kappa/mu times friction's own work, the loop's area; with
    form 'energy' it is kappa times that work."""
    for form, part in (("archard", MU), ("energy", 1.0)):
        found = run(
            PIECES + RIG,
            False,
            **{
                "wear.form": f'"{form}"',
                "wear.cycles": 10,
                "drive.acceleration": "5 g",
                "contact.grooves.lifted_mass": lifted,
                "wear.jumps": 1,
            },
        )
        assert value(found, "worn_volume") == pytest.approx(
            KAPPA * 10 * value(found, "loop_area") / part, rel=1e-4
        )


SOFT = PIECES.replace("[friction]", "[contact.shear]\n[friction]")


@pytest.mark.share(0)
@pytest.mark.parametrize(
    ("text", "more"),
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
def test_exact_elastic_pieces_wear_by_the_work_of_their_friction(text, more):
    """Slip and normal force of every point along the flank: their sum over the patch is what the books say, kappa times
    friction's own work (form 'energy') or that over mu, and the flanks lose their share of it."""
    for form, part in (("archard", MU), ("energy", 1.0)):
        found = run(
            SOFT + text,
            False,
            **{"wear.form": f'"{form}"', "wear.cycles": 10, "wear.jumps": 1, **more},
        )
        volume = value(found, "worn_volume")
        assert volume == pytest.approx(KAPPA * 10 * value(found, "loop_area") / part, rel=1.2e-3)
        assert (7.5e-6 - value(found, "groove_amplitude")) * AREA == pytest.approx(
            0.5 * volume, rel=1e-9
        )
        assert value(found, "energy_balance") < 1e-8


def test_exact_on_flat_ground_they_wear_as_the_exact_set_of_elements():
    """Worn depth of every point, flanks of a slope of 1e-12, a stroke of some three slides at which the pieces let
    go."""
    keys = {"slide.amplitude": "0.3 um", "wear.cycles": 1000, "wear.jumps": 1}
    here = run(SOFT + SLIDE, False, **keys, **{"contact.grooves.amplitude": "1e-11 um"})
    there = run(SOFT + SLIDE, False, **keys, **{"contact.grooves.amplitude": "0 um"})
    np.testing.assert_allclose(here.patch.unloaded_gap, there.patch.unloaded_gap, rtol=2e-3)
    path = here.patch.unloaded_gap / here.patch.pressure.sigma_n
    assert np.ptp(path) > 0.05 * path.mean()


def test_always_worn_grooves_let_the_motion_run_away():
    """At 7 g new grooves hold for ever; worn by a tenth they let the motion grow, and then pass its stop."""
    found = run(PIECES + RIG, False, **{"wear.cycles": 2e7, "wear.jumps": 12})
    said = next(
        line for line in found.warnings if line.startswith("wear was computed only up to cycle")
    )
    assert "exceeded the travel" in said
    history = found.extra["wear"]
    assert 6e-6 < history["groove_amplitude"][-1] < 7e-6
    moves = history["relative_displacement_amplitude"]
    assert (np.diff(moves) > 0).all() and moves[-1] > 1.3 * moves[0]


def test_exact_flat_grooves_wear_on_as_the_law_itself():
    """Worn flat the run is Coulomb's on flat ground."""
    found = run(PIECES + SLIDE, False, **{"wear.cycles": 1e8})
    assert value(found, "groove_amplitude") == 0.0
    assert value(found, "loop_area") == pytest.approx(4 * MU * LOAD * 15e-6, rel=1e-12)
    assert value(found, "worn_volume") > 2 * 7.5e-6 * AREA
