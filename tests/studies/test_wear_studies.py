"""What the studies of wear say, from their cheap share."""

import re

import pytest
from study_module import study


@pytest.fixture(scope="module")
def bands():
    return study("wear/bands.py")


def sentence(bands, rows, within):
    """The numbers of the docstring against rows of strokes 6.4 and 12.8 um."""
    new, found = rows[0], {(round(r.stroke / bands.STEP), round(r.worn / bands.UM)): r for r in rows[1:]}
    six, twelve = found[2, 6], found[4, 6]
    assert [*six.after, *twelve.after] == pytest.approx([0.55, 0.67, 0.42, 0.62], abs=within)
    ratios = [six.ratio, twelve.ratio, found[2, 3].ratio, found[4, 3].ratio]
    assert ratios == pytest.approx([0.83, 0.67, 0.92, 0.86], abs=within)
    assert [*six.interval, *twelve.interval, *new.interval] == pytest.approx(
        [0.51, 1.30, 0.38, 1.09, 0.64, 1.55], abs=5 * within)
    assert [six.seen, twelve.seen] == pytest.approx([0.18, 0.45], abs=5 * within)
    assert six.interval[1] > 1 and twelve.interval[1] > 1 and six.after_interval[0][1] < 1  # what the sentence rests on


def test_always_the_sentence_on_bands(bands, tmp_path, capsys):
    rows = bands.main(strokes=(2, 4), seeds=2, bite=0.03e-6, path=tmp_path / "x.svg")
    sentence(bands, rows, 0.03)
    text = (tmp_path / "x.svg").read_text()
    assert all(each in text for each in ("along x (sliding)", "6 um worn off each: whole area", "strokes of Table 1"))
    assert len(re.findall("one trace each way", capsys.readouterr().out)) == 5


@pytest.mark.slow
def test_always_the_sentence_on_bands_in_full(bands):
    rows = bands.main(path=None)
    sentence(bands, rows, 0.006)
    six = {round(r.stroke / bands.STEP): r.ratio for r in rows if r.worn > 5e-6}
    assert min(six, key=six.get) == 8 and six[8] == pytest.approx(0.53, abs=0.006)
    assert all(r.scatter < 0.03 for r in rows)
