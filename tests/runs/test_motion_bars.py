"""Do the bars of a motion hold? Random rigs of every law, drive and structure against the truth of `motion_bars`.

`python tests/support/motion_bars.py run FILE` is the whole campaign, tests/README.md has what campaigns found.
"""

import numpy as np
import pytest
from motion_bars import FINE, ROUGH, compared, held, score
from motion_laws import LAWS
from motion_read import measures
from motion_reference import Motion
from motion_scenes import spec, text

from patchfem.scene.scene import loads

FEW = (11, 21, 30, 111)  # exact, in pieces, exact, a march


@pytest.mark.share(0, 2)
@pytest.mark.parametrize("seed", FEW)
def test_always_the_bars_of_a_random_rig_hold_the_independent_program(seed, tmp_path):
    found = compared(spec(seed), tmp_path)
    assert found["rows"] and found["truth"] == "reference"
    assert not [row for row in found["rows"] if not held(row)]


@pytest.mark.slow
def test_exact_the_independent_program_reads_peaks_between_its_nodes():
    """Against itself with steps of five eighths: a half range between two cycles, and a cycle that ends on a slope
    (5e-8 of the amplitude and 2e-5 of the damping were lost there), a slip that turns inside a step, a crossing."""
    for seed, cycles in ((5061, 6), (5067, 4)):
        s, found = spec(seed) | {"cycles": cycles}, []
        for share, rtol in (ROUGH, FINE):
            motion = Motion(s, share)
            period = 1 / s["frequency"] if s["drive"] != "free" else 1 / s["modes"][0]["frequency"]
            found.append(measures(motion, motion.run(cycles * period, rtol), period, cycles, 3))
        for name, value in found[1].items():
            assert found[0][name] == pytest.approx(value, rel=1e-8, abs=1e-16), name


def test_exact_the_independent_program_goes_on_from_a_state_as_if_it_had_not_stopped():
    """Bouc-Wen with its stretch against the speed: from two cycles on, in one run and from where another stopped."""
    s = spec(41100125)
    period, motion, whole = 1 / s["frequency"], Motion(s), Motion(s)
    one = motion.run(2 * period, 1e-11)[-1].solution(2 * period)[:motion.size]
    other = motion.run(period / 3, 1e-11, one)[-1].solution(period / 3)
    once = whole.run(7 * period / 3, 1e-11)[-1].solution(7 * period / 3)
    np.testing.assert_allclose(other[:motion.size], once[:motion.size], rtol=1e-7)


@pytest.mark.slow
def test_always_most_bars_of_forty_rigs_hold(tmp_path):
    """What 114 other rigs had (tests/README.md), less what the chance of forty allows."""
    found = score([compared(spec(seed), tmp_path) for seed in range(6000, 6040)])
    assert found["coverage"] >= 0.93 and found["right"] >= 0.7, found["misses"]


def test_always_every_random_scene_is_one():
    """Two hundred of them are accepted as they are written, and all laws and drives are among them."""
    specs = [spec(seed) for seed in range(200)]
    for one in specs:
        if one["drive"] != "file":  # its record is a file beside the scene
            loads(text(one))
    assert {one["law"] for one in specs} >= set(LAWS) | {"order", "report"}
    assert {one["drive"] for one in specs} == {"sine", "force", "step", "sweep", "levels", "file", "free"}


def test_exact_the_sliders_of_the_independent_iwan_law():
    """Kinked line of two straight pieces for beta without end; slip force and first slope for any; Masing's rule wipes
    out a minor loop."""
    keys = {"static": 0.3, "stiffness": 1e6, "chi": -0.4, "beta": 0.5}
    law = LAWS["iwan"](30.0, **keys)
    assert law.loading(law.top) == pytest.approx(30.0, rel=1e-12)
    assert law.loading(1e-12) / 1e-12 == pytest.approx(1e6, rel=1e-3)
    assert law.loading(2 * law.top) == law.loading(law.top)
    path, force = [0.8, -0.5, 0.3, -0.5, 0.9], []
    for end in path:
        slide = np.array([end * law.top])
        while [g for g in law.guards(slide, 0.0, 0.0)[1:] if g < 0]:
            law.turned(1, slide, 0.0, 0.0)
        force.append(float(law.force(slide, 0.0, 0.0)))
        law.turned(0, slide, 0.0, -law.mode)
    assert force[3] == pytest.approx(force[1], rel=1e-12)
    assert force[4] == pytest.approx(law.loading(0.9 * law.top), rel=1e-12)


@pytest.mark.parametrize("order", [0.0, 1.0, 2.0])
def test_exact_the_printed_sum_of_the_independent_program(order):
    """A path of five strokes, the first 80 bond lengths: bond by bond by the middle rule, and 1 - exp(-R/eps) (2.18) of
    a first loading of order one."""
    law, q, path, places = LAWS["report"](2.0, bond_length=0.5, order=order), 0.0, 0.0, [np.zeros((1, 2))]
    for end in (40.0, 39.0, 39.6, 38.0, 38.5):
        law.mode = 1 if end > q else -1
        share = (np.arange(50_000) + 0.5) / 50_000 * abs(end - q)
        places.append(np.column_stack([path + share, q + law.mode * share]))
        if end == 40.0 and order == 1:
            assert law.force(np.array([1.3, 1.3]), 0.0, 0.0) == pytest.approx(2 * (1 - np.exp(-2.6)), rel=1e-12)
        q, path = end, path + abs(end - q)
        bonds, u = np.concatenate(places[1:]), q - np.concatenate(places[1:])[:, 1]
        steps = np.concatenate([np.full(50_000, one[1, 0] - one[0, 0]) for one in places[1:]]) / 0.5
        rho = (path - bonds[:, 0]) / 0.5
        total = float(np.sum(rho**order * np.exp(-rho) * np.sign(u) * steps)) / max(1.0, order)
        assert law.force(np.array([q, path]), 0.0, 0.0) == pytest.approx(2 * total, abs=1e-3)
        law.turned(0, np.array([q, path]), 0.0, -law.mode)
