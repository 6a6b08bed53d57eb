"""Do the bars of a motion hold? Random rigs of every law, drive and structure against the truth of `motion_bars`.

`python tests/support/motion_bars.py run FILE` is the whole campaign, tests/README.md has what campaigns found.
"""

import pytest
from motion_bars import compared, held
from motion_scenes import spec

FEW = (11, 21, 30, 111)  # exact, in pieces, exact, a march


@pytest.mark.share(0, 2)
@pytest.mark.parametrize("seed", FEW)
def test_always_the_bars_of_a_random_rig_hold_the_independent_program(seed, tmp_path):
    found = compared(spec(seed), tmp_path)
    assert found["rows"] and found["truth"] == "reference"
    assert not [row for row in found["rows"] if not held(row)]
