"""Errors of all static measures cover the results on meshes refined twice.

`python tests/runs/test_error_bars.py graded 0 40` prints the coverage and the error ratios of forty
random scenes.
"""

import sys

import numpy as np
import pytest
from scene_texts import PIECE

from patchfem import build
from patchfem.runs import estimate_measures, solve_with_coarser
from patchfem.runs.patch import ladder
from patchfem.runs.patch.condensed import condense
from patchfem.runs.patch.limits import extrapolate
from patchfem.runs.patch.press import press_patch
from patchfem.runs.patch.values import values
from patchfem.scene import loads

BLOCKS = PIECE + 'substrate = "Ti-8Al-1Mo-1V"\n'
SEEDS_OF_KIND = {"uniform": (4, 13, 15, 28, 50), "graded": (3001, 3036)}
# CPU seconds for a mesh; low, so that two finer levels remain affordable.
MAX_SECONDS = {True: 0.02, False: 0.02}


def draw_settings(seed: int, kind: str) -> list:
    """Return the --set options of a random patch.

    The options are load, coating, tilt, crown or step, holder or load line, unlike pieces, plane
    stress and skin.
    """
    r = np.random.default_rng(seed)
    options = []

    def draw_log_uniform(low, high):
        return 10 ** r.uniform(np.log10(low), np.log10(high))

    options.append(f"contact.load={draw_log_uniform(1, 1e4):.6g} N")
    if coated := r.random() < 0.8:
        options.append(f"contact.coating.thickness={draw_log_uniform(1e-5, 5e-4):.4g} m")
        options.append(f"contact.coating.material={r.choice(['WC-Co', 'steel', 'WC-Co sintered'])}")
    if tilted := r.random() < 0.6:
        options.append(f"contact.tilt.angle={draw_log_uniform(1e-6, 3e-3):.4g} rad")
    draw = r.random()
    if draw < 0.4:
        options.append(f"contact.crown.radius={draw_log_uniform(1e-2, 30):.4g} m")
    elif draw < 0.55:
        options += [
            f"contact.step.height={draw_log_uniform(1e-7, 1e-5):.3g} m",
            f"contact.step.at={r.uniform(-5, 5):.3g} mm",
        ]
    draw = r.random()
    if draw < 0.25:
        options.append(
            f"contact.holder.rotational_stiffness={draw_log_uniform(1e2, 1e6):.3g} N m/rad"
        )
        if r.random() < 0.3:
            options.append(f"contact.load_line.offset={r.uniform(-5, 5):.3g} mm")
    elif draw < 0.4 and not tilted:
        options.append(f"contact.load_line.offset={r.uniform(-6, 6):.3g} mm")
    draw = r.random()
    if draw < 0.15:
        options.append("contact.upper.coating=none" if coated else "contact.upper.substrate=steel")
    elif draw < 0.25:
        options.append(f"contact.upper.height={draw_log_uniform(3e-3, 2e-2):.3g} m")
    if r.random() < 0.3:
        options.append("contact.plane=stress")
    draw = r.random()
    if draw < 0.15:
        options += [
            "contact.asperities.law=linear",
            f"contact.asperities.normal_stiffness={draw_log_uniform(1e11, 1e15):.3g} Pa/m",
        ]
    elif draw < 0.3:
        options += [
            "contact.asperities.law=exponential",
            f"contact.asperities.decay_length={draw_log_uniform(1e-8, 3e-6):.3g} m",
        ]
    if kind == "uniform":
        options.append(f"contact.element_size={12.7 / r.integers(40, 130):.6g} mm")
    return [*options, "accuracy.tolerance=1e-2"]


def compare_with_refined_meshes(seed: int, kind: str) -> dict:
    """Return name -> (value, error, reference) of a random scene; the reference extrapolates two
    refinements."""
    model = build(loads(BLOCKS, "a.toml", draw_settings(seed, kind)))
    series = solve_with_coarser(model.patch, model.accuracy.tolerance)
    measures = estimate_measures(
        *series, tolerance=model.accuracy.tolerance if model.patch.mesh.is_automatic else None
    )
    grids = [series[0].pair.grid, series[0].pair.upper_grid]
    finest = [values(series[0])]
    is_symmetric = grids[0] is grids[1]
    for _ in range(2):
        grids = [grid.refine() for grid in grids[: 2 - is_symmetric]]
        finest.append(values(press_patch(model.patch, condense(model.patch, *grids))))
    return {
        name: (m.value, m.error, extrapolate_or_last(*(value[name] for value in finest)))
        for name, m in measures.items()
        if m.value is not None
    }


def extrapolate_or_last(coarse, middle, fine) -> float:
    """Return the limit of three values on refined meshes if their changes shrink with one sign,
    otherwise the last value."""
    first_change = middle - coarse
    last_change = fine - middle
    if first_change * last_change <= 0 or abs(first_change) < 1.15 * abs(last_change):
        return fine
    return fine + last_change / (min(max(first_change / last_change, 1.2), 4.0) - 1)


def exceeds_error(value, error, reference) -> bool:
    """Return whether the reference differs from a value by more than its error."""
    return not abs(reference - value) <= error + 1e-11 * abs(value)


def error_ratios(rows) -> list:
    """Return stated over true error of rows (value, error, reference) whose true error exceeds
    round-off."""
    return [
        error / abs(truth - value)
        for value, error, truth in rows
        if abs(truth - value) > 1e-9 * abs(value)
    ]


@pytest.fixture
def limit_mesh_cost(monkeypatch):
    """Limit the cost of the meshes so that two refinements remain affordable."""
    monkeypatch.setattr(ladder, "MAX_CONDENSING_SECONDS", MAX_SECONDS)


@pytest.mark.share(0, 3, 6)
@pytest.mark.parametrize(
    ("kind", "seed"), [(kind, seed) for kind, seeds in SEEDS_OF_KIND.items() for seed in seeds]
)
def test_always_errors_cover_refined_meshes(kind, seed, limit_mesh_cost):
    """The errors cover refined meshes for scenes where three meshes alone would not suffice:
    symmetry up to round-off, full contact, contact of a few nodes."""
    for name, row in compare_with_refined_meshes(seed, kind).items():
        assert not exceeds_error(*row), (name, row)


def collect_campaign_rows(kind: str, first_seed: int, count: int) -> dict:
    """Return name -> [(value, error, reference)] of the scenes with `count` seeds from `first_seed`."""
    rows = {}
    for seed in range(first_seed, first_seed + count):
        for name, row in compare_with_refined_meshes(seed, kind).items():
            rows.setdefault(name, []).append(row)
    return rows


@pytest.mark.parametrize("ratio", [4, 3, 2])
def test_exact_limit_of_geometric_series(ratio):
    """The extrapolation of 1 + 1/r + 1/r^2 + ... gives r/(r - 1); the error of the finest value is
    1.8 times its distance from this limit."""
    sums = np.cumsum(ratio ** -np.arange(4.0))
    estimate = extrapolate(sums)
    limit = ratio / (ratio - 1)
    assert estimate.extrapolated == pytest.approx(limit, rel=1e-12)
    assert estimate.error == pytest.approx(1.8 * (limit - sums[-1]), rel=1e-12)
    assert estimate.extrapolated_error == pytest.approx(
        (limit - sums[-1]) / (4 if ratio > 2.6 else 2), rel=1e-12
    )


if __name__ == "__main__":
    ladder.MAX_CONDENSING_SECONDS = MAX_SECONDS
    for name, found in collect_campaign_rows(
        sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    ).items():
        cover, ratio = (
            1 - np.mean([exceeds_error(*row) for row in found]),
            error_ratios(found) or [0.0],
        )
        print(
            f"{name:24s} coverage {cover:.3f}  width over true error: median {np.median(ratio):.3g}, "
            f"nine in ten below {np.quantile(ratio, 0.9):.3g}"
        )
