"""Progress is said on the way and changes nothing: a run on a terminal answers as one in a pipe does."""

import pytest
from scene_texts import KEYS

import patchfem as pf
from patchfem.scene import loads, read_template

LAWS = "coulomb", "elastic-plastic", "nonlocal", "tanh", "lugre", "iwan"


def scene(law, *sets):
    return loads(
        read_template("rig").replace('"coulomb"', f'"{law}"\n{KEYS[law]}'),
        sets=("drive.cycles=40", *sets),
    )


@pytest.mark.share(0, 1, 2, 6)
@pytest.mark.parametrize(
    "law, sets", [(law, ()) for law in LAWS] + [("coulomb", ("accuracy.method=march",))]
)
def test_exact_a_progress_callback_changes_no_result(law, sets):
    alone = pf.run(scene(law, *sets))
    seen = pf.run(scene(law, *sets), progress=lambda share: None)
    assert {name: (one.value, one.error) for name, one in alone.measures.items()} == {
        name: (one.value, one.error) for name, one in seen.measures.items()
    }


def test_always_a_long_run_reports_its_progress():
    """Under a sweep, for a motion that repeats is not run to its end."""
    head, drive = (
        read_template("rig")
        .replace('"coulomb"', f'"nonlocal"\n{KEYS["nonlocal"]}')
        .split("[drive]")
    )
    drive = (
        '[drive]\nkind = "base"\nwaveform = "sweep"\nfrom = "120 Hz"\nto = "160 Hz"\nrate = "2 Hz/s"\n'
        'acceleration = "5 g"\n[accuracy]' + drive.split("[accuracy]")[1]
    )
    shares = []
    pf.run(loads(head + drive), progress=shares.append)
    assert sum(0.2 < share < 0.9 for share in shares) >= 1
    assert shares == sorted(shares)
    assert shares[-1] <= 1.0
