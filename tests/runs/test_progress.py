"""A progress callback is called during a run and does not change its result."""

import pytest
from scene_texts import KEYS

import patchfem as pf
from patchfem.scene import loads, read_template

LAWS = "coulomb", "elastic-plastic", "nonlocal", "tanh", "lugre", "iwan"


def load_rig(law, *sets):
    """Return the scene of the rig template with a friction law."""
    return loads(
        read_template("rig").replace('"coulomb"', f'"{law}"\n{KEYS[law]}'),
        sets=("drive.cycles=40", *sets),
    )


@pytest.mark.share(0, 1, 2, 6)
@pytest.mark.parametrize(
    "law, sets", [(law, ()) for law in LAWS] + [("coulomb", ("accuracy.method=march",))]
)
def test_exact_progress_callback_changes_no_result(law, sets):
    """A run with a progress callback has the measures and errors of a run without one."""
    without_callback = pf.run(load_rig(law, *sets))
    with_callback = pf.run(load_rig(law, *sets), progress=lambda fraction: None)
    assert {
        name: (measure.value, measure.error) for name, measure in without_callback.measures.items()
    } == {name: (measure.value, measure.error) for name, measure in with_callback.measures.items()}


def test_always_long_run_reports_progress():
    """A long sweep reports its progress on the way, in increasing fractions up to 1."""
    head, drive = (
        read_template("rig")
        .replace('"coulomb"', f'"nonlocal"\n{KEYS["nonlocal"]}')
        .split("[drive]")
    )
    drive = (
        '[drive]\nkind = "base"\nwaveform = "sweep"\nfrom = "120 Hz"\nto = "160 Hz"\nrate = "2 Hz/s"\n'
        'acceleration = "5 g"\n[accuracy]' + drive.split("[accuracy]")[1]
    )
    fractions = []
    pf.run(loads(head + drive), progress=fractions.append)
    assert sum(0.2 < fraction < 0.9 for fraction in fractions) >= 1
    assert fractions == sorted(fractions)
    assert fractions[-1] <= 1.0
