"""Errors of rigs and benches include the error of the sum over bonds: truncation and merging."""

import pytest

from patchfem import build
from patchfem.runs.bench.engine import choose_bench_engine
from patchfem.runs.bench.errors import find_bond_sum_error
from patchfem.runs.run import run
from patchfem.scene import loads

RIG = (
    '[normal]\nload = "90 N"\n[friction]\nstatic = 0.3\nlaw = "nonlocal"\nbond_length = "4 um"\n{law}'
    '[structure]\nmoving_mass = "0.884 kg"\n[[structure.mode]]\nname = "axial"\nfrequency = "143 Hz"\n'
    'damping = 0.01\nslide = 1.0\n[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 12\n'
    "[accuracy]\nsteps_per_cycle = 120\n"
)
REPORT_LAW = 'reading = "report"\ninitial_bonds = 0\nkinetic = 0.2\nrest_growth = "10 m/s^2"\nslip_growth = "0.4 um"\n'


@pytest.mark.share(0, 3)
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


def test_exact_bond_sum_error_of_every_engine():
    """The NumPy sum, used for a pressure that varies, has the truncation error of the scene; the
    recursion and the direct sum have no error."""
    text = (
        '[normal]\nload = "90 N"\namplitude = "9 N"\nfrequency = "10 Hz"\n[friction]\nstatic = 0.3\n'
        'law = "nonlocal"\nbond_length = "20 um"\norder = 2\n[slide]\nkind = "sine"\namplitude = "20 um"\n'
        'frequency = "10 Hz"\n'
    )

    def sum_error(*sets, where=text):
        model = build(loads(where, sets=sets))
        return find_bond_sum_error(model, choose_bench_engine(model, model.slide.samples(100)[1]))

    assert sum_error() == 1e-6 and sum_error("accuracy.tail=0.05") == 0.05
    assert sum_error("accuracy.quadrature=direct") == sum_error("friction.order=1") == 0.0
    steady = text.replace('amplitude = "9 N"\nfrequency = "10 Hz"\n', "")
    assert 0 < sum_error(where=steady) <= 1e-4
    assert sum_error("accuracy.quadrature=truncated", "accuracy.tail=0.05", where=steady) == 0.05
