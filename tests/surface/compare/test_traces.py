"""Comparison of two traces: worn areas and ends of constructed tracks, and what is said in rare cases."""

import numpy as np
import pytest
from command_line import modules_after
from scipy import optimize
from scipy.ndimage import gaussian_filter1d
from traces import write_traces

from patchfem.core import PatchfemError
from patchfem.surface import Options, Profile
from patchfem.surface.compare.compare import compare_files, compare_surfaces
from patchfem.surface.compare.fit import solve_non_negative

UM = 1e-6
NM = 1e-9
SHIFT = 40 * UM


def draw_surface(seed: int, count: int = 4400, rms: float = 0.4 * UM) -> np.ndarray:
    """Return rough heights [m] at steps of 1 um."""
    z = gaussian_filter1d(np.random.default_rng(seed).normal(size=count), 8.0)
    return rms * z / z.std()


def make_pair(worn, seed=0, noise=5 * NM, tilt=2e-4, surface=None) -> tuple[Profile, Profile]:
    """Return traces of a surface before and after the loss `worn` (n,) [m]; x of the second one starts 40 um later."""
    random = np.random.default_rng([seed, 1])
    count = len(worn)
    surface = draw_surface(seed, count + 400) if surface is None else surface
    x = UM * np.arange(count)
    before = surface[:count] + noise * random.normal(size=count)
    start = round(SHIFT / UM)
    after = surface[start : start + count] - worn + tilt * x + noise * random.normal(size=count)
    return Profile(x, before, "before"), Profile(x, after, "after")


def make_parabola(depth: float, first: int, last: int, count: int = 4000) -> np.ndarray:
    """Return the depths (count,) of a parabolic track between two samples."""
    u = (np.arange(count) - (first + last) / 2) / ((last - first) / 2)
    return depth * np.clip(1 - u**2, 0, None)


def has_finding(comparison, code: str) -> bool:
    """Return whether a comparison has a finding of this code."""
    return any(finding.code == code for finding in comparison.findings)


@pytest.mark.parametrize("depth", [0.1 * UM, 20 * UM])
def test_area_and_ends_of_parabola(depth):
    """Area 2/3 depth x width, its mean over the common length, largest depth, ends and shift lie in narrow intervals."""
    worn = make_parabola(depth, 1500, 2500)
    found = compare_surfaces(*make_pair(worn))
    assert found.verdict.code == "worn" and found.evidence.placement.basis == "place"
    values = found.values
    area = worn.sum() * UM
    length = np.ptp(found.evidence.curves.x)
    truths = {
        "worn_area": area,
        "worn_depth_mean": area / length,
        "worn_depth_max": depth,
        "worn_from_after": 1500 * UM,
        "worn_to_after": 2500 * UM,
        "worn_from_before": 1540 * UM,
    }
    for name, true in truths.items():
        assert (
            values[name].low - UM * name.startswith("worn_f") <= true <= values[name].high + UM
        ), name
    assert values["worn_area"].value == pytest.approx(area, rel=0.03)
    assert values["shift"].value == pytest.approx(-SHIFT, abs=0.1 * UM)
    track = found.track.values
    assert track["depth_mean"].value == pytest.approx(2 / 3 * depth, rel=0.05)
    assert track["width"].low <= 1000 * UM <= track["width"].high
    place = values["worn_depth_max_at"]
    assert place.low <= 2000 * UM <= place.high and place.high - place.low < 400 * UM
    assert values["common_length"].value == pytest.approx(length, rel=1e-3)


def test_floor_of_skew_groove_and_gain():
    """The fifth of a skew triangle around its tip is .9 times as deep as the tip; the gain has an interval around 1."""
    worn = UM / 0.9 * np.interp(np.arange(4000), (1500, 2100, 2500), (0, 1, 0))
    before, after = make_pair(worn)
    found = compare_surfaces(before, Profile(after.x, after.z + 3 * UM, "after"))
    floor = found.track.values["depth_floor"]
    assert floor.low <= UM <= floor.high and floor.value == pytest.approx(UM, rel=0.01)
    gain = found.values["gain"]
    assert gain.low <= 1.0 <= gain.high and gain.high - gain.low < 0.02
    # a single track has the area of the whole section
    assert found.track.values["area_gross"][:3] == found.values["worn_area"][:3]


def test_always_unworn_pairs_show_no_wear():
    """Unworn pairs with a tilt, and with a bow too, are not called worn or grown; the detection limit is stated."""
    for seed in range(2):
        before, after = make_pair(np.zeros(3000), seed)
        bow = 0.1 * UM * np.linspace(-1, 1, 3000) ** 2
        found = compare_surfaces(before, Profile(after.x, after.z + bow * (seed % 2), "after"))
        assert found.verdict.code == "no_wear", seed
        assert 0 < found.verdict.numbers["detection_limit"] < 20 * NM
        assert has_finding(found, "hidden_even_wear") and not has_finding(found, "drift")
        assert found.values["hidden_wear"].high is None


def test_exact_shallow_track_is_found_above_limit():
    """A track of twice the detection limit over the middle third is found, with its area in the interval."""
    limit = compare_surfaces(*make_pair(np.zeros(3000))).verdict.numbers["detection_limit"]
    worn = np.zeros(3000)
    worn[1000:2000] = 2 * limit
    found = compare_surfaces(*make_pair(worn))
    assert found.verdict.code == "worn"
    area = found.values["worn_area"]
    assert area.low <= 2 * limit * 1000 * UM <= area.high


def test_always_drift_alone_is_hardly_ever_called_wear():
    """Of 4 unworn pairs whose datum drifts by five times the noise at most one is called worn; a deep track is found."""
    drifts = []
    for seed in range(4):
        drift = gaussian_filter1d(np.random.default_rng([seed, 5]).normal(size=1500), 125.0)
        drifts.append(25 * NM * drift / drift.std())
    found = [compare_surfaces(*make_pair(drift, seed)) for seed, drift in enumerate(drifts)]
    codes = [each.verdict.code for each in found]
    assert set(codes) <= {"no_wear", "scar_or_drift", "worn"} and codes.count("worn") <= 1
    assert sum(has_finding(each, "drift") for each in found) >= 3
    # A scar of twice the range of the drift may be either.
    unsure = compare_surfaces(*make_pair(make_parabola(0.15 * UM, 500, 900, 1500) + drifts[0], 0))
    assert unsure.verdict.code == "scar_or_drift"
    assert unsure.verdict.numbers["scar_depth"] > 0
    assert unsure.values["worn_depth_mean"].reason == "scar_or_drift"
    worn = make_parabola(UM, 500, 900, 1500)
    for seed, drift in enumerate(drifts[:2]):
        area = compare_surfaces(*make_pair(worn + drift, seed)).values["worn_area"]
        assert area.value == pytest.approx(worn.sum() * UM, rel=0.1)


NEW, WORN = make_pair(make_parabola(UM, 1500, 2500))
STRANGE = {  # pair, and its verdict
    "identical": (NEW, NEW),
    "grown": (WORN, NEW),
    "worn": (NEW, Profile(WORN.x, WORN.z[::-1].copy(), "after")),
    "elsewhere": (NEW, make_pair(np.zeros(4000), 100)[1]),
    "mirror_finish": make_pair(
        np.zeros(4000), 5, noise=4 * NM, surface=draw_surface(5, rms=0.2 * NM)
    ),
}


@pytest.mark.parametrize("code", STRANGE)
def test_always_strange_pairs_have_their_own_verdicts(code):
    """A mirrored trace is turned back; the same file, exchanged files, other places and mirrors have no depth."""
    found = compare_surfaces(*STRANGE[code])
    assert found.verdict.code == code
    assert (found.values["worn_depth_mean"].value is None) == (code != "worn")
    assert has_finding(found, "mirrored") == (code == "worn")


@pytest.mark.parametrize(
    "first, last, name", [(200, 3800, "growth_height"), (800, 4000, "scar_depth")]
)
def test_always_step_over_most_of_the_trace_may_be_growth(first, last, name):
    """A step of 1 um over at least 80 % of the trace is a scar, or growth of the rest: both numbers are stated."""
    worn = np.zeros(4000)
    worn[first:last] = UM
    verdict = compare_surfaces(*make_pair(worn)).verdict
    assert verdict.code == "growth_at_ends"
    assert verdict.numbers[name] == pytest.approx(UM, rel=0.1)


def test_exact_deep_track_at_another_place_is_measured_below_its_flanks():
    """A track of 20 um in a trace without any old surface is measured below the line through its flanks."""
    worn = make_parabola(20 * UM, 1200, 2800)
    found = compare_surfaces(NEW, make_pair(worn, 77)[1])
    assert found.verdict.code == "worn" and found.evidence.placement.basis == "flanks"
    assert has_finding(found, "no_old_surface_left")
    area = found.values["worn_area"]
    assert area.low <= worn.sum() * UM <= area.high
    assert found.values["shift"].value is None


def test_always_valley_of_another_place_is_no_track(tmp_path):
    """Two unworn places, of which the second has a wide valley, are not comparable: it may be as deep as they are rough."""
    paths = write_traces("elsewhere", 20261133, tmp_path, ("before", "after"))
    found = compare_files(*paths)
    assert found.verdict.code == "elsewhere" and not found.tracks
    assert not has_finding(found, "no_old_surface_left")


def test_always_comparison_imports_no_optimizers(tmp_path):
    """SciPy's optimizers, whose import takes longer than a comparison, are not imported."""
    paths = write_traces("groove", 30077, tmp_path, ("before", "after"))
    code = (
        "import json, sys; from pathlib import Path; from patchfem.surface.compare.compare import compare_files; "
        "compare_files(*map(Path, sys.argv[1:])); print(json.dumps(list(sys.modules)))"
    )
    assert not {"scipy.optimize", "scipy.sparse"} & modules_after(code, *paths)


@pytest.mark.parametrize("seed", range(4))
def test_exact_non_negative_least_squares_agrees_with_scipy(seed):
    """The factors are those of `scipy.optimize.nnls`, also where some of them are 0."""
    random = np.random.default_rng(seed)
    columns = random.normal(size=(40, 3)) + 0.5
    values = columns @ random.normal(size=3) + 0.1 * random.normal(size=40)
    expected = optimize.nnls(columns, values)[0]
    assert solve_non_negative(columns, values) == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_known_shift_is_used():
    """A known shift places traces that no search could place."""
    worn = make_parabola(0.2 * UM, 1500, 2500)
    pair = make_pair(worn, 5, noise=4 * NM, surface=draw_surface(5, rms=0.2 * NM))
    found = compare_surfaces(*pair, Options(shift=-SHIFT))
    assert found.values["worn_area"].value == pytest.approx(worn.sum() * UM, rel=0.03)


def test_deposit_on_a_bowed_trace_is_growth():
    """A deposit over a third of a trace with a bow is growth of the known area, not a track between flanks."""
    deposit = 1.2 * UM * np.sqrt(make_parabola(1.0, 1400, 2700))
    bow = UM * np.linspace(-1, 1, 4000) ** 2
    found = compare_surfaces(*make_pair(-deposit - bow, 3))
    assert found.verdict.code == "grown" and found.evidence.placement.basis == "place"
    assert found.values["grown_area"].value == pytest.approx(deposit.sum() * UM, rel=0.03)


@pytest.mark.parametrize("seed", range(2))
def test_always_largest_depth_contains_a_crest_between_samples(seed):
    """The deepest point of a V, a quarter step from a sample, is deeper than all samples, but in the interval."""
    places = np.arange(1500)
    bottom = 700.25
    worn = UM * np.sqrt(np.clip(1 - np.abs(places - bottom) / 200, 0, None))
    worn += 2 * UM * np.clip(1 - np.abs(places - bottom) / 5, 0, None)
    found = compare_surfaces(*make_pair(worn, seed))
    largest = found.values["worn_depth_max"]
    assert worn.max() < 3 * UM - 90 * NM
    assert largest.low <= 3 * UM <= largest.high
    assert largest.high < 3.6 * UM


def test_always_scar_like_a_parabola_may_be_a_bow():
    """A parabola of 2 um over 90 % of the trace is no wear of nanometres; a straight datum is no bow.

    The scar is at most as deep as the subtracted parabola. A least-squares parabola has the mean depth c L^2/6 below its
    ends; the robust one that is subtracted gives the unworn ends less weight.
    """
    worn = make_parabola(2 * UM, 200, 3800)
    pair = make_pair(worn)
    found = compare_surfaces(*pair)
    assert found.verdict.code == "scar_or_bow"
    x = np.arange(worn.size)
    bow_depth = abs(np.polyfit(x, worn, 2)[0]) * worn.size**2 / 6
    assert found.verdict.numbers["scar_depth"] == pytest.approx(bow_depth, rel=0.1)
    assert found.verdict.numbers["scar_depth"] > worn.mean()
    assert found.values["worn_depth_mean"].reason == "scar_or_bow"
    found = compare_surfaces(*pair, Options(datum="straight"))
    assert found.verdict.code in ("worn", "growth_at_ends")


def test_always_low_scar_like_a_parabola_may_be_a_bow():
    """A parabola over all of the trace, hardly higher than the waves, is no "no wear" either."""
    found = compare_surfaces(*make_pair(make_parabola(0.7 * UM, 0, 4000)))
    assert found.verdict.code == "scar_or_bow"
    assert found.verdict.numbers["scar_depth"] == pytest.approx(0.467 * UM, rel=0.1)


def test_exact_clean_pair_has_narrow_intervals():
    """With a noise of 5 nm in 1 um, area and largest depth are known to .5 and 1.5 % on either side."""
    worn = make_parabola(UM, 1500, 2500)
    values = compare_surfaces(*make_pair(worn)).values
    for name, true, limit in (
        ("worn_area", worn.sum() * UM, 5e-3),
        ("worn_depth_max", UM, 1.5e-2),
    ):
        assert values[name].low <= true <= values[name].high, name
        assert values[name].high - values[name].low < 2 * limit * true, name


def test_always_transfer_of_equal_area_is_worn_and_grown():
    """Material lost at one place and built up at another one is stated as both."""
    change = make_parabola(UM, 600, 1400) - make_parabola(UM, 2400, 3200)
    found = compare_surfaces(*make_pair(change))
    assert found.verdict.code == "worn_and_grown"
    assert found.values["worn_area"].value == pytest.approx(2 / 3 * UM * 800 * UM, rel=0.05)
    assert found.values["grown_area"].value == pytest.approx(2 / 3 * UM * 800 * UM, rel=0.05)


def test_pile_up_is_measured_beside_the_track():
    """Ridges on both sides are pile-up, and the net area is the lost area less the pile-up."""
    worn = make_parabola(2 * UM, 1600, 2400)
    ridges = make_parabola(0.5 * UM, 1400, 1600) + make_parabola(0.5 * UM, 2400, 2600)
    track = compare_surfaces(*make_pair(worn - ridges)).track.values
    assert track["pile_up"].value == pytest.approx(ridges.sum() * UM, rel=0.03)
    for name, place in (("from", 1600 * UM), ("to", 2400 * UM)):
        assert track[name].low <= place <= track[name].high
    net = track["area_gross"].value - track["pile_up"].value
    assert track["area_net"].value == pytest.approx(net, rel=1e-9, abs=0)


def test_exact_cut_track_has_no_end_beyond_the_trace():
    """A track that leaves the common part has one end, and a width without upper limit."""
    worn = UM * np.clip((np.arange(4000) - 2500) / 100, 0, 1)
    found = compare_surfaces(*make_pair(worn))
    assert found.verdict.code == "worn"
    assert found.track.cut == (False, True)
    assert found.track.values["to"].reason == "cut_off" and found.track.values["width"].high is None
    assert found.track.values["from"].value == pytest.approx(2500 * UM, abs=6 * UM)


@pytest.mark.parametrize("depth", [0.1 * UM, UM])
def test_always_step_to_the_end_of_a_trace_may_be_a_jump_of_the_datum(depth):
    """A step without a flank that reaches an end is a scar or a jump of the datum: its height is stated, no depth."""
    found = compare_surfaces(*make_pair(depth * (np.arange(4000) > 2500)))
    assert found.verdict.code == "scar_or_step"
    assert found.verdict.numbers["scar_depth"] == pytest.approx(depth, rel=0.02)
    assert found.values["worn_depth_mean"].reason == "scar_or_step" and not found.tracks


def test_always_loss_of_all_tops_is_no_step():
    """Tops that are lost over the whole trace are worn: no step of the datum explains depths from 0 to their height."""
    x = 2 * UM * np.arange(1000)
    random = np.random.default_rng(1985)
    lengths, phases = random.uniform(60, 110, 40), random.uniform(0, 2 * np.pi, 40)

    def find_heights(x):
        """Return the heights [m] of 40 waves of 60 to 110 um."""
        return 0.1 * UM * np.sin(2 * np.pi * x[:, None] / UM / lengths + phases).sum(axis=1)

    plateau = np.quantile(find_heights(x), 0.6)
    worn = np.minimum(find_heights(x + 30 * UM), plateau) + 0.002 * x
    traces = [z + 5 * NM * random.normal(size=x.size) for z in (find_heights(x), worn)]
    found = compare_surfaces(Profile(x, traces[0], "before"), Profile(x, traces[1], "after"))
    assert found.verdict.code == "worn"
    common = find_heights(x[x >= 30 * UM])
    mean = found.values["worn_depth_mean"]
    assert mean.low <= np.maximum(common - plateau, 0.0).mean() <= mean.high


def test_spikes_and_dropouts_are_left_out():
    """Spikes, saturated dropouts and missing heights do not count, and the removed heights are counted."""
    before, after = make_pair(make_parabola(UM, 1500, 2500))
    z = after.z.copy()
    z[[300, 2900, 2901]] += 8 * UM
    z[3300:3306] = -40 * UM
    z[800:830] = np.nan
    found = compare_surfaces(before, Profile(after.x, z, "after"))
    assert found.verdict.code == "worn"
    assert found.evidence.removed[1] >= 9
    assert found.values["worn_area"].value == pytest.approx(2 / 3 * UM * 1000 * UM, rel=0.02)


def make_cosine(depth: float, first: int, last: int, count: int = 4000) -> np.ndarray:
    """Return the depths (count,) of a track with the shape of one wave of a cosine between two samples."""
    depths = np.zeros(count)
    waves = (np.arange(last - first) + 0.5) / (last - first)
    depths[first:last] = depth * (1 - np.cos(2 * np.pi * waves)) / 2
    return depths


@pytest.mark.parametrize("shape", [make_cosine, "flank of 100 um"])
def test_roughness_in_a_bent_track_is_that_of_the_unworn_surface(shape):
    """Ra, Rq and slope of a surface that was lowered by 20 um are unchanged, and those of ISO 21920-2 without the track.

    The reference is the Gaussian filter of the unworn trace, summed over all of its neighbours; the inside starts one
    cut-off and the flank, a tenth of the track, behind the first worn sample.
    """
    if callable(shape):
        worn = shape(20 * UM, 1500, 2500)
    else:
        worn = gaussian_filter1d(20 * UM * (np.abs(np.arange(4000) - 1999.5) < 500), 25.0)
    surface = draw_surface(7)
    found = compare_surfaces(*make_pair(worn, 7, noise=0.2 * NM, surface=surface))
    cutoff = found.evidence.cutoff / UM
    assert cutoff == pytest.approx(80)
    regions = found.evidence.roughness
    for name in ("Ra", "Rq", "slope"):
        inside, outside = regions["inside"], regions["outside"]
        assert inside["after"][name].value == pytest.approx(inside["before"][name].value, rel=0.01)
        ratio = inside["ratio"][name]
        assert ratio.low < 1 < ratio.high and abs(ratio.value - 1) < 0.01
        assert outside["after"][name].value == pytest.approx(
            outside["before"][name].value, rel=2e-3
        )

    start = round(SHIFT / UM)
    unworn = surface[start : start + 4000]
    columns = np.arange(4000)
    weights = np.exp(-(np.pi**2) / np.log(2) * ((columns[:, None] - columns) / cutoff) ** 2)
    rough = unworn - weights @ unworn / weights.sum(axis=1)
    indices = np.flatnonzero(found.evidence.curves.masks.worn)
    flank = (indices[-1] - indices[0]) // 10 + 80
    part = rough[round(found.evidence.curves.x[0] / UM) + indices[0] :][
        flank : np.ptp(indices) - flank
    ]
    assert regions["inside"]["before"]["Ra"].value == pytest.approx(np.abs(part).mean(), rel=0.01)
    assert regions["inside"]["before"]["Rq"].value == pytest.approx(part.std(), rel=0.01)

    # Noise of 60 nm hides slopes between neighbouring samples, but not those of waves from 8 steps on, which did not wear.
    found = compare_surfaces(*make_pair(worn, 7, noise=60 * NM, surface=surface))
    ratio = found.values["slope_ratio"]
    assert ratio.low <= 1 <= ratio.high < 1.2
    for region in found.evidence.roughness.values():
        assert region["ratio"]["slope"][:3] == (None,) * 3


def test_exact_cutoff_of_the_roughness_may_be_given():
    """A cut-off of 25 um gives the Ra of sections of 25 um, which is smaller; one that does not fit is refused."""
    before, after = make_pair(make_cosine(20 * UM, 1500, 2500), 7, noise=0.2 * NM)
    longest, own = (
        compare_surfaces(before, after, Options(cutoff=cutoff)).evidence
        for cutoff in (None, 25 * UM)
    )
    assert (longest.cutoff, own.cutoff) == (pytest.approx(80 * UM), 25 * UM)
    for region in ("inside", "outside"):
        sizes = [one.roughness[region]["before"]["Ra"].value for one in (own, longest)]
        assert sizes[0] < 0.9 * sizes[1]
    for cutoff in (250 * UM, 2 * UM):
        with pytest.raises(PatchfemError, match="the longest standard one is 80 um"):
            compare_surfaces(before, after, Options(cutoff=cutoff))


def test_refuses_short_traces():
    """Traces of too few heights are refused."""
    short = [Profile(trace.x[:20], trace.z[:20], trace.source) for trace in (NEW, WORN)]
    with pytest.raises(PatchfemError, match="20 heights; a comparison needs at least 40"):
        compare_surfaces(*short)


@pytest.mark.long
@pytest.mark.parametrize("shape", ["flat", "round"])
def test_always_floor_of_noisy_track_has_no_bias(shape):
    """Over 12 noisy tracks, the mean error of the floor is within .8 of its scatter; the largest of the means is above."""
    worn = make_parabola(60 * NM, 500, 1000, 1500)
    if shape == "flat":
        worn = np.where(worn > 0, 60 * NM, 0.0)
    true = np.convolve(worn, np.ones(100) / 100, "valid").max()
    floors = []
    for seed in range(12):
        found = compare_surfaces(*make_pair(worn, seed, noise=15 * NM))
        floors.append(found.track.values["depth_floor"])
    errors = np.array([floor.value for floor in floors]) - true
    assert abs(errors.mean()) < 0.8 * errors.std()
    assert sum(floor.low <= true <= floor.high for floor in floors) >= 11


@pytest.mark.parametrize("correlation, noise", [(1.5, 2 * NM), (8.0, 20 * NM)])
def test_always_slope_ratio_holds_between_samples(correlation, noise):
    """The slope ratio of traces shifted by part of a step covers that of the surface, drawn at sixteenths of a step.

    Interpolation smooths waves of a few steps (correlation 1.5), and noise is steep (20 nm at steps of 1 um).
    """
    fine = 16
    for seed, start in enumerate((40 * fine + 8, 40 * fine + 4)):
        random = np.random.default_rng([seed, 77])
        surface = gaussian_filter1d(random.normal(size=4500 * fine), correlation * fine)
        surface *= 0.4 * UM / surface.std()
        worn = np.minimum(surface, np.quantile(surface, 0.7))
        traces = [z[k : k + 4000 * fine : fine] for z, k in ((surface, 0), (worn, start))]
        x = UM * np.arange(4000)
        found = compare_surfaces(
            *(Profile(x, z + noise * random.normal(size=x.size), "trace") for z in traces)
        )

        # Gaussian filters of ISO 16610-21 have the deviation .187 of their cut-off.
        shorter = [gaussian_filter1d(z, 0.187 * 8 * fine) for z in (surface, worn)]
        slopes = [np.diff(z - gaussian_filter1d(z, 0.187 * 110 * fine)).std() for z in shorter]
        ratio = found.values["slope_ratio"]
        assert ratio.low <= slopes[1] / slopes[0] <= ratio.high
        assert ratio.high - ratio.low < 0.2 * ratio.value
