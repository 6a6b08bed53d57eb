"""What the studies of the report's figures say, recomputed."""

import numpy as np
import pytest
from study_module import study

from patchfem.closed_forms.dynamics import bounded_input, sliding_amplitude


def inside(text, *parts):
    """Every part stands in the text."""
    missing = [part for part in parts if part not in text]
    assert not missing, f"{missing} not in: {text}"


def test_figures_2_and_3_motions_of_one_block(tmp_path, capsys):
    one = study("report/figures_2_3.py")
    rows, stopped = one.main(tmp_path / "x.svg")
    at = {(r.onset, r.level): r for r in rows}
    for onset in one.ONSETS:  # sliding without a stop has a closed form
        for level in (6.0, 7.0, 8.0):
            assert at[onset, level].q == pytest.approx(sliding_amplitude(1.0, onset / level, 0.003), rel=1e-9)
        assert at[onset, 4.0].outcome == "stuck" and at[onset, 4.0].q == 0
    assert at[4.0, 5.0].q == pytest.approx(0.28704671337871602, rel=1e-9)  # 40-digit marching
    assert at[4.14, 5.0].q == pytest.approx(0.150075, abs=2e-6)  # half-cycle shooting with D = 0.828
    five, eight = at[4.14, 5.0], at[4.14, 8.0]
    inside(one.ANSWER, f"q = {five.q:.3f}", f"of {five.acceleration / 5:.2f} need", f"{at[4.0, 5.0].q:.3f} and "
           f"{at[4.0, 5.0].acceleration / 5:.2f}", f"to {eight.acceleration:.0f} g",
           f"moves {at[4.14, 6.0].mil:.0f} and {at[4.14, 7.0].mil:.0f} mil")
    loose, tight = (np.ptp(each.displacement) / 2 for each in stopped.values())
    inside(" ".join(one.__doc__.split()), f"{five.mil:.3f} mil for 0.23", f"{five.acceleration:.2f} g for 6.0",
           f"q is {loose:.3f}", f"0.21 q is {tight:.3f}", f"the onset, {4.14 * bounded_input(1.0):.2f} g",
           f"acceleration {np.abs(stopped[one.STICK_SPEED].absolute).max():.2f}; below")
    assert "input displacement / 5" in (tmp_path / "x.svg").read_text() and one.ANSWER in capsys.readouterr().out


def test_figures_2_and_3_where_the_stops_end_and_what_jumps():
    one = study("report/figures_2_3.py")
    assert one.steady(4.14, 5.28).stuck > 0 == one.steady(4.14, 5.31).stuck
    inside(one.ANSWER, "from 5.3 g on")
    inside(one.REPRODUCED, "in part", "4.14 g", "5.3 g")
    exact, stopped = one.exact_cycle(4.14), one.newmark_run(one.STICK_SPEED)
    step = 2 * np.pi / (one.CURVE - 1)
    jump = np.abs(np.diff(exact.relative)).max()
    assert jump == pytest.approx(0.704, abs=2 * step)
    assert np.abs(np.diff(exact.velocity)).max() < step * np.abs(exact.relative).max() * 1.01
    assert 0.15 < np.abs(np.diff(stopped.velocity)).max() < one.STICK_SPEED + step
    assert exact.friction.max() == pytest.approx(0.828, rel=1e-12) and stopped.friction.max() == pytest.approx(0.8)
