"""Notes and warnings of a run about its bonds."""

from patchfem import load
from patchfem.friction import Bonds
from patchfem.runs.results.notes import warn_of_unbounded_bonds
from patchfem.runs.run import run

BENCH = (
    '[normal]\nload = "100 N"\n[friction]\nlaw = "nonlocal"\nstatic = 0.3\nbond_length = "2 um"\n{law}[slide]\n'
    'kind = "dwell"\nspeed = "10 mm/s"\ndistance = "200 um"\nhold = "1 ms"\ndistance_after = "20 um"\n'
    "[accuracy]\nsteps_per_cycle = 2000\n"
)
GROWTH = 'kinetic = 0.06\nrest_growth = "2 m/s^2"\nslip_growth = "50 um"\nrest_speed = "10 um/s"\n'
RIG = (
    '[normal]\nload = "90 N"\n[friction]\nstatic = 0.3\nlaw = "nonlocal"\nbond_length = "4 um"\n{law}'
    '[structure]\nmoving_mass = "0.884 kg"\n[[structure.mode]]\nname = "axial"\nfrequency = "143 Hz"\n'
    'damping = 0.01\nslide = 1.0\n[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 10\n'
    "[accuracy]\nsteps_per_cycle = 100\n"
)


def run_with_notes(text, law):
    """Return the result of a scene with a friction law, and its notes as one text."""
    result = run(load(text.format(law=law)), estimate=False)
    return result, " | ".join(result.extra["notes"])


def test_exact_friction_above_static_limit_is_noted():
    """After a rest, short bonds are stretched and the friction force exceeds mu_s N, which a note
    reports; steady sliding of order 3 never exceeds it."""
    result, text = run_with_notes(BENCH, GROWTH + "order = 3\n")
    ratio = result.measures["friction_ratio_peak"].value / 0.3
    assert ratio > 1.1 and f"friction force reaches {ratio:.3g} times mu_s N" in text
    assert "order = 3 and a growing" in text
    result, text = run_with_notes(BENCH, "order = 3\n")
    assert result.measures["friction_ratio_peak"].value / 0.3 <= 1 and not text


def test_exact_initial_bonds_without_growth_are_noted():
    """With the law of the report, a note says that the initial bonds keep their length although the other bonds grow."""
    growth = GROWTH.replace("50 um", "0.5 um").replace("0.06", "0.2") + 'reading = "report"\n'
    assert "the initial bonds keep the bond length eps_0" in run_with_notes(BENCH, growth)[1]
    assert "initial bonds" not in run_with_notes(BENCH, growth + "initial_bonds = 0\n")[1]


def test_exact_initial_bonds_of_negative_order_give_warning():
    """Initial bonds of negative order have an infinite force at first; a rig with them gives a warning."""
    result, _ = run_with_notes(
        RIG.replace("cycles = 10", "cycles = 1"), 'reading = "report"\norder = -0.5\n'
    )
    assert any("infinite at the first instant" in line for line in result.warnings)
    assert not warn_of_unbounded_bonds(
        Bonds(0.3, 1e-6, -0.5, "report", initial=0.0)
    ) and not warn_of_unbounded_bonds(Bonds(0.3, 1e-6))
