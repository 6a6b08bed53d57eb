"""The error of the sum over bonds, of its tail and of merging, inside the bars of rigs and benches."""

import pytest

from patchfem import build
from patchfem.runs.bench.engine import bench_engine
from patchfem.runs.bench.errors import bond_sum_error
from patchfem.runs.run import run
from patchfem.scene import loads

RIG = (
    '[normal]\nload = "90 N"\n[friction]\nstatic = 0.3\nlaw = "nonlocal"\nbond_length = "4 um"\n{law}'
    '[structure]\nmoving_mass = "0.884 kg"\n[[structure.mode]]\nname = "axial"\nfrequency = "143 Hz"\n'
    'damping = 0.01\nslide = 1.0\n[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 12\n'
    "[accuracy]\nsteps_per_cycle = 120\n"
)
PRINTED = 'reading = "report"\ninitial_bonds = 0\nkinetic = 0.2\nrest_growth = "10 m/s^2"\nslip_growth = "0.4 um"\n'


@pytest.mark.share(0, 3)
@pytest.mark.parametrize(
    "knobs", [["accuracy.merge=0.3"], ["accuracy.quadrature=truncated", "accuracy.tail=0.05"]]
)
@pytest.mark.parametrize("law", ["order = 0.5\n", PRINTED])
def test_exact_the_bars_of_a_rig_hold_the_error_of_the_sum(law, knobs):
    """Against the sum of every bond at the same steps: a tail of 5 % moves the amplitude by 7 %, which the bars of the
    steps alone did not hold, nor those of ten other measures."""
    text = RIG.format(law=law)
    fine = ["accuracy.quadrature=truncated", "accuracy.tail=1e-9"]
    whole = run(loads(text, sets=fine), estimate=False).measures
    found = run(loads(text, sets=knobs)).measures
    for name, one in found.items():
        if one.value is not None and one.error is not None and name in whole:
            assert abs(one.value - whole[name].value) <= one.error, name


def test_exact_the_bound_of_every_engine_that_sums_bonds():
    """A sum in NumPy, where the pressure of a point changes on the way, has the tail of the scene; the recursion and a
    sum of every bond lose nothing."""
    text = (
        '[normal]\nload = "90 N"\namplitude = "9 N"\nfrequency = "10 Hz"\n[friction]\nstatic = 0.3\n'
        'law = "nonlocal"\nbond_length = "20 um"\norder = 2\n[slide]\nkind = "sine"\namplitude = "20 um"\n'
        'frequency = "10 Hz"\n'
    )

    def bound(*sets, where=text):
        model = build(loads(where, sets=sets))
        return bond_sum_error(model, bench_engine(model, model.slide.samples(100)[1]))

    assert bound() == 1e-6 and bound("accuracy.tail=0.05") == 0.05
    assert bound("accuracy.quadrature=direct") == bound("friction.order=1") == 0.0
    steady = text.replace('amplitude = "9 N"\nfrequency = "10 Hz"\n', "")
    assert 0 < bound(where=steady) <= 1e-4
    assert bound("accuracy.quadrature=truncated", "accuracy.tail=0.05", where=steady) == 0.05
