"""The wear studies: their stated figures, from inexpensive cases."""

import numpy as np
import pytest
from study_module import make_study_fixture

bands = make_study_fixture("wear/bands.py")


def check_bands(bands, rows, within):
    """Check the figures of the docstring against rows of strokes of 6.4 and 12.8 um."""
    new = rows[0]
    found = {(round(r.stroke / bands.STEP), round(r.worn / bands.UM)): r for r in rows[1:]}
    six = found[2, 6]
    twelve = found[4, 6]
    assert [*six.after, *twelve.after] == pytest.approx([0.55, 0.67, 0.42, 0.62], abs=within)
    ratios = [six.ratio, twelve.ratio, found[2, 3].ratio, found[4, 3].ratio]
    assert ratios == pytest.approx([0.83, 0.67, 0.92, 0.86], abs=within)
    assert [*six.interval, *twelve.interval, *new.interval] == pytest.approx(
        [0.51, 1.30, 0.38, 1.09, 0.64, 1.55], abs=5 * within
    )
    assert [six.seen, twelve.seen] == pytest.approx([0.18, 0.45], abs=5 * within)
    # these inequalities support the stated conclusion
    assert six.interval[1] > 1 and twelve.interval[1] > 1 and six.after_interval[0][1] < 1


@pytest.mark.slow
def test_always_all_bands_give_stated_ratios(bands):
    """The complete study gives the stated amplitude ratios within 0.006."""
    rows = bands.main(path=None)
    check_bands(bands, rows, 0.006)
    six = {round(r.stroke / bands.STEP): r.ratio for r in rows if r.worn > 5e-6}
    assert min(six, key=six.get) == 8 and six[8] == pytest.approx(0.53, abs=0.006)
    assert all(r.scatter < 0.03 for r in rows)


story = make_study_fixture("wear/rig_story.py")


def check_worn_rig(story, rows, within):
    """Check the figures of the docstring against the new rig and each wear coefficient."""
    new, ten, hundred = (
        next(r for r in rows if r.coefficient == kappa) for kappa in (0.0, 1e-14, 1e-13)
    )
    touch = [100 * r.values["contact_fraction"] for r in (new, ten, hundred)]
    assert touch == pytest.approx([21.9, 38.2, 96.9], rel=within)
    assert [r.values["pressure_peak"] / 1e6 for r in (new, ten)] == pytest.approx(
        [8.33, 2.71], rel=within
    )
    assert hundred.values["pressure_peak"] == pytest.approx(0.78e6, abs=hundred.error)
    assert [1e6 * ten.depth, 1e6 * hundred.depth] == pytest.approx([0.314, 1.205], rel=within)
    assert [r.values["normal_stiffness"] / 1e6 for r in (new, ten)] == pytest.approx(
        [535, 845], rel=within
    )
    assert [r.values["tangential_stiffness"] / 1e6 for r in (new, ten)] == pytest.approx(
        [229, 303], rel=within
    )
    assert [r.onset for r in (new, ten, hundred)] == pytest.approx([3.88, 3.90, 4.00], abs=0.02)


@pytest.mark.slow
def test_always_complete_run_of_the_worn_rig_gives_stated_figures(story):
    """The complete study gives the stated figures within 1 %."""
    rows = story.main(path=None)
    check_worn_rig(story, rows, 0.01)
    motion = [
        [r.values["relative_displacement_amplitude"] * 1e6, r.values["loop_area"] * 1e3]
        for r in rows
    ]
    assert np.ravel([motion[0], *motion[2:]]) == pytest.approx(
        [14.80, 1.96, 15.04, 2.00, 15.31, 2.04], rel=3e-3
    )
    peak = next(r for r in rows if r.coefficient == 1e-13)
    assert [peak.values["pressure_peak"] / 1e6, peak.error / 1e6] == pytest.approx(
        [0.78, 0.50], rel=0.02
    )
