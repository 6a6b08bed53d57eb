"""A progress callback is called during a run and does not change its result."""

from scene_texts import KEYS

import patchfem as pf
from patchfem.scene import loads, read_template


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
