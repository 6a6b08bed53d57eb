"""The test series of Table 1 with accumulated wear: the figures of the study."""

import numpy as np
import pytest
from study_module import make_study_fixture

repeats = make_study_fixture("report/repeats.py")


def test_always_wear_accumulates_and_changes_a_repeat_little(repeats, tmp_path):
    """Wear continues from run to run.

    It changes a repeated reading by less than 2 %, where the measured change is larger.
    """
    short = [
        one for one in repeats.columns() if (one[1].frequency, one[1].input) == (135, 5 * 9.80665)
    ]
    first, second = repeats.series(tmp_path, rows=short)
    assert 0 == first.before < first.depth == pytest.approx(second.before, rel=1e-12)
    assert second.depth > first.depth
    ((read, model),) = repeats.pairs([first, second])
    assert read == np.log(6.5 / 8.4) and 0 < model < 0.02


@pytest.mark.slow
def test_repeats_have_stated_changes(repeats):
    """The rms changes of repeated readings, measured and computed, are those stated in the study."""
    found = repeats.main((1e-14, 1e-13))
    read = repeats.pairs(found["1e-14"])[:, 0]
    model = {name: repeats.pairs(one)[:, 1] for name, one in found.items()}
    left = {name: repeats.rms(read - one) for name, one in model.items()}
    assert repeats.rms(read) == pytest.approx(0.122, abs=5e-4) and left["1e-14"] == pytest.approx(
        0.126, abs=5e-4
    )
    assert left["onset"] == pytest.approx(0.102, abs=5e-4)
    assert [repeats.rms(model[name]) for name in ("1e-14", "onset")] == pytest.approx(
        [0.007, 0.027], abs=5e-4
    )
    ends = [
        end
        for name in ("1e-14", "1e-13", "onset")
        for end in (model[name].min(), model[name].max())
    ]
    assert ends == pytest.approx([-0.009, 0.012, -0.011, 0.008, -0.064, 0.013], abs=5e-4)
    same = [int((np.sign(model[name]) == np.sign(read)).sum()) for name in ("1e-14", "onset")]
    assert same == [2, 5] and len(read) == 7
    last = found["1e-14"][-1]
    assert [last.depth * 1e6, last.contact, found["1e-14"][0].contact] == pytest.approx(
        [0.55, 0.94, 0.22], abs=5e-3
    )
    full = next(one for one in found["1e-13"] if one.contact == 1)
    assert full.column == 1
    assert [read[1], model["onset"][1], read[4], model["onset"][4]] == pytest.approx(
        [-0.26, -0.064, 0.095, -0.018], abs=4e-3
    )
    fell = np.delete(read**2 - (read - model["onset"]) ** 2, 1).sum()
    # one reading accounts for more than 80 % of the improvement
    assert fell < 0.2 * (read**2 - (read - model["onset"]) ** 2).sum()
