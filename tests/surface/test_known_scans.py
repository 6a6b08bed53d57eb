"""The truth that `known_scans` tells of its pairs, against sums over the surfaces themselves."""

import numpy as np
import pytest
from known_scans import KINDS, Place, caps, pair, points_in
from scans_score import COVERED, errors, line, summary, verdict


def residual(one, scan, heights, to_piece) -> float:
    """Rms [m] of what a scan adds to the heights of the piece at its points, less a plane; spikes count little."""
    x, y, z = scan
    spots = np.ravel(x + 1j * y[:, None])
    left = z.ravel() - heights(to_piece(spots).real, to_piece(spots).imag)
    there = np.isfinite(left)
    plane = np.c_[np.ones(there.sum()), spots[there].real, spots[there].imag] / [1, np.ptp(x), np.ptp(y)]
    left = left[there]
    for _ in range(3):
        near = np.abs(left - np.median(left)) <= 5 * np.median(np.abs(left - np.median(left)))
        left = left - plane @ np.linalg.lstsq(plane[near], left[near], rcond=None)[0]
    return 1.4826 * np.median(np.abs(left))


@pytest.mark.parametrize("seed", range(len(KINDS)))
def test_exact_truth_is_the_sum_over_the_surfaces(seed):
    """Placement and volumes by complex numbers and a mask; the scans hold these surfaces and their noise alone."""
    one = pair(seed, (170, 150))
    kind, before, after, truth = one.kind, one.before, one.after, one.truth()
    assert kind == KINDS[seed] and truth["comparable"] == (kind != "elsewhere")
    sides = [complex(scan[0][-1], scan[1][-1]) for scan in (before, after)]
    shift, turn = complex(*one.place.shift), np.exp(1j * one.place.rotation)
    x, y, z = after
    z = -z if kind == "turned" else z
    z = {"x": z[:, ::-1], "y": z[::-1], "": z}[truth["axis"]]
    bound = np.hypot(one.noise, one.slow)
    for scan, heights, to_piece in (
            (before, one.first, lambda p: p),
            ((x, y, z), one.second, lambda p: sides[0] / 2 + (p - sides[0] / 2 - shift) / turn)):
        assert 0.5 * one.noise < residual(one, scan, heights, to_piece) < 1.6 * bound
    cells = 500
    spots = ((np.arange(cells) + 0.5) / cells * sides[0].real + 1j * (np.arange(cells)[:, None] + 0.5) / cells
             * sides[0].imag)
    there = sides[0] / 2 + turn * (spots - sides[0] / 2) + shift
    inside = (there.real >= 0) & (there.real <= sides[1].real) & (there.imag >= 0) & (there.imag <= sides[1].imag)
    if kind == "elsewhere":
        assert not inside.any() and truth["worn_volume"] is None
        return
    assert (truth["shift_x"], truth["shift_y"], truth["rotation"]) == (*one.place.shift, one.place.rotation)
    depth = (one.first(spots.real, spots.imag) - one.second(spots.real, spots.imag))[inside]
    depth[np.abs(depth) < 1e-9 * one.rms] = 0.0
    cell = sides[0].real * sides[0].imag / cells**2
    close = dict(rel=0.01, abs=1e-6 * one.rms * cell * inside.sum())
    assert truth["common_area"] == pytest.approx(cell * inside.sum(), rel=0.01)
    assert truth["worn_volume"] == pytest.approx(cell * depth[depth > 0].sum(), **close)
    assert truth["grown_volume"] == pytest.approx(-cell * depth[depth < 0].sum(), **close)
    assert truth["worn_share"] == pytest.approx((depth > 0).mean(), rel=0.02, abs=1e-9)
    assert truth["worn_depth_max"] == pytest.approx(max(depth.max(), 0), rel=0.02, abs=1e-9 * one.rms)
    for wide, name in zip(truth["by_pixels"], ("worn_volume", "grown_volume")):
        assert (1 - 1e-4) * truth[name] <= wide <= 1.04 * truth[name]
    assert (truth["worn_volume"] > 0) == (kind not in ("unworn", "deposits", "exchanged"))
    assert (truth["grown_volume"] > 0) == (kind in ("deposits", "pile-up", "exchanged"))


def test_exact_common_region_and_a_hollow():
    """Two squares of one middle, one turned by 45 degrees, share a regular octagon; a paraboloid is pi r^2 h / 2."""
    place = Place((2.0, 2.0), (2.0, 2.0), (0.0, 0.0), np.pi / 4)
    x, y, area = points_in(place.common())
    assert area.sum() * x.shape[1] == pytest.approx(8 * (np.sqrt(2) - 1), rel=1e-5)
    hollow = caps([(1.1, 0.9)], [0.4], [3.0])
    assert (area * hollow(x, y)).sum() == pytest.approx(np.pi * 0.4**2 * 3.0 / 2, rel=1e-4)
    moved = Place((2.0, 1.0), (2.0, 1.0), (0.5, -0.25), 0.0)
    assert moved.common().min(0) == pytest.approx([0.0, 0.25]) and moved.common().max(0) == pytest.approx([1.5, 1.0])


def answer(truth: dict, **other) -> dict:
    """What a comparison without a fault says, but for what is `other`."""
    true = {name: {"value": truth[name], "low": 0.9 * truth[name], "high": 1.1 * truth[name]}
            for name in COVERED[:5]} | other
    place = {name: {"value": truth[name], "low": truth[name] - 1e-9, "high": truth[name] + 1e-9}
             for name in COVERED[5:]} | {"mirrored": truth["mirrored"], "turned": truth["turned"]}
    return {"verdict": "worn", "sentences": [], "registration": place, "hidden_wear": {"high": None}} | true


def test_exact_the_score_of_a_right_a_missed_and_a_false_answer():
    one = pair(KINDS.index("pile-up"), (170, 150))
    truth, none = one.truth(), {"value": 0.0, "low": 0.0, "high": 1e-20}
    right, missed = answer(truth), answer(truth, worn_volume=none)
    assert verdict(one.kind, truth, right) == ("right", []) and verdict(one.kind, truth, missed)[0] == "missed"
    found = errors(truth, right)
    assert set(found) == set(COVERED) and all(each["inside"] and each["error"] == 0 for each in found.values())
    assert errors(truth, missed)["worn_volume"] == {"error": -1.0, "relative": True, "inside": False}
    for fault in ({"sentences": ["The files are in the wrong order."]},
                  {"registration": right["registration"] | {"mirrored": True}}):
        assert verdict(one.kind, truth, right | fault)[0] == "false"
    unworn = dict(truth, worn_volume=0.0)
    assert verdict("deposits", unworn, right) == ("false", ["wear shown where there is none"])
    apart = dict(truth, comparable=False)
    assert verdict("elsewhere", apart, right)[0] == "false" and not errors(apart, right)
    assert verdict("elsewhere", apart, right | {"verdict": "not comparable"})[0] == "right"
    even = dict(unworn, hidden=True, worn_depth_mean=2e-7)
    for high, word in ((1e-7, "false"), (3e-7, "right"), (None, "right")):
        told = answer(truth, worn_volume=none, grown_volume=none, hidden_wear={"value": 0.0, "low": 0.0, "high": high})
        assert verdict("even", dict(even, grown_volume=0.0), told)[0] == word
    assert verdict(one.kind, truth, {"error": "no such file"}) == ("refused", ["no such file"])
    row = {"seed": 6, "kind": one.kind, "style": one.style, "verdict": "missed", "reasons": [], "cpu": 1.0,
           "memory": 2.0, "errors": errors(truth, missed), "pixel": 1e-6}
    assert "-100.0!" in line(row) and any("0 of 1 intervals" in text for text in summary([row]))
