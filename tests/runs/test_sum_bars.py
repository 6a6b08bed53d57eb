"""Errors of rigs and benches include the error of the sum over bonds: truncation and merging."""

import pytest

from patchfem.runs.run import run
from patchfem.scene import loads

RIG = (
    '[normal]\nload = "90 N"\n[friction]\nstatic = 0.3\nlaw = "nonlocal"\nbond_length = "4 um"\n{law}'
    '[structure]\nmoving_mass = "0.884 kg"\n[[structure.mode]]\nname = "axial"\nfrequency = "143 Hz"\n'
    'damping = 0.01\nslide = 1.0\n[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 12\n'
    "[accuracy]\nsteps_per_cycle = 120\n"
)
REPORT_LAW = 'reading = "report"\ninitial_bonds = 0\nkinetic = 0.2\nrest_growth = "10 m/s^2"\nslip_growth = "0.4 um"\n'


@pytest.mark.share(3)
@pytest.mark.parametrize(
    "settings", [["accuracy.merge=0.3"], ["accuracy.quadrature=truncated", "accuracy.tail=0.05"]]
)
@pytest.mark.parametrize("law", ["order = 0.5\n", REPORT_LAW])
def test_exact_errors_of_rig_cover_truncated_and_merged_bonds(law, settings):
    """The errors cover the difference from the sum over all bonds with the same steps. A truncation
    of 5 % changes the amplitude by 7 %, which the errors of the steps alone did not cover."""
    text = RIG.format(law=law)
    fine = ["accuracy.quadrature=truncated", "accuracy.tail=1e-9"]
    reference = run(loads(text, sets=fine), estimate=False).measures
    measures = run(loads(text, sets=settings)).measures
    for name, measure in measures.items():
        if measure.value is not None and measure.error is not None and name in reference:
            assert abs(measure.value - reference[name].value) <= measure.error, name
