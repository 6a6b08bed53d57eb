"""Draw the pictures of README and site from fresh runs, or name the committed ones that are stale.

Without arguments this script writes all pictures into `pictures/`. With `--check` it draws them
anew and compares; the exit status is 1 if a committed picture is stale. Texts and curves of every
picture are kept beside it in numbers.json, with the SHA-256 of the picture. `.ci/site` runs the
comparison, which takes about 20 CPU seconds. No browser is needed.
"""

import json
import os
import re
import sys
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib
import numpy as np
from matplotlib.figure import Figure

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

import patchfem as pf  # noqa: E402
from patchfem.export.charts.axes import MATPLOTLIB_STYLE  # noqa: E402
from patchfem.export.fields.film import find_contact_window, select_last_frames  # noqa: E402
from patchfem.export.fields.vtkhdf import VTKHDF_FILE, Frames, read_frames  # noqa: E402
from patchfem.export.pieces import draw_cells, magnify_pieces  # noqa: E402

FOLDER = Path(__file__).parent / "pictures"
BLUE = "#1f5f99"
ORANGE = "#c8551b"
GREY = "#8a8a8a"
WIDTH = 4.4  # inch; letters of 11 points stay 12 pixels high on a screen 360 pixels wide
DPI = 190  # dots per inch: 836 pixels, the column of a README on a code host
MAX_BYTES = 1_000_000  # bytes; with larger pictures a page is slow to load on a telephone
SAMPLES = 25  # values kept of each curve and of each field of stresses
CURVE_TOL = 2e-3  # difference over largest value; a smaller one cannot be seen in a picture
# Fraction of the largest value of all curves of a picture; a curve below it is round-off.
ROUND_OFF = 1e-9
LOOK = MATPLOTLIB_STYLE | {
    "font.size": 11,
    "axes.titlesize": 11,
    "axes.labelsize": 11,
    "legend.fontsize": 10.5,
    "lines.linewidth": 1.6,
}
TILT_LIMIT = 5.0  # %, the change of a measure up to which the recipe of the README allows a tilt
UM = 1e6  # um per m
MM = 1e3  # mm per m
MPA = 1e-6  # MPa per Pa


def new_figure(height: float, rows: int = 1, **layout) -> tuple:
    """Return an empty figure of the common width and its axes, one below the other."""
    figure = Figure(figsize=(WIDTH, height))
    return figure, figure.subplots(rows, 1, squeeze=False, **layout)[:, 0]


def draw_interface(result) -> Figure:
    """Draw normal and shear stress along the interface."""
    figure, (axis,) = new_figure(3.1)
    x = result.patch.x * MM
    shear = result.fields["shear_stress"] * MPA
    axis.plot(x, result.fields["normal_stress"][-1] * MPA, color=BLUE, label="normal stress σn")
    axis.plot(x, shear[1:].T, color=GREY, lw=0.7)
    axis.plot(
        x, shear[-1], color=GREY, lw=0.7, label=f"shear stress τ at {len(shear) - 1} instants"
    )
    axis.plot(x, shear.max(axis=0), color=ORANGE, label="largest τ of the cycle")
    right = x[np.flatnonzero(result.fields["normal_stress"][-1] > 0)[-1]]
    axis.set(
        xlabel="x [mm]",
        ylabel="stress [MPa]",
        xlim=(x[0], right + 0.15 * (right - x[0])),
        title="Normal and shear stress where the pieces touch",
    )
    axis.legend()
    return figure


def draw_loop(result) -> Figure:
    """Draw the friction force against the relative displacement of the last cycles."""
    figure, (axis,) = new_figure(3.1)
    area = result.measures["loop_area"]
    axis.plot(result.window.slide * UM, result.window.force, color=BLUE)
    axis.set(
        xlabel="relative displacement [um]",
        ylabel="friction force [N]",
        title=f"Friction loop: {area.value * 1e3:.3g} mJ dissipated per cycle",
    )
    return figure


def read_stress(frames: Frames, name: str) -> np.ndarray:
    """Return a stress (f, c, ...) [MPa] of the cells of both pieces in the frames of the last cycle."""
    numbers = select_last_frames(frames.times)
    parts = [frames.blocks[side].cell_data[name][numbers] for side in ("lower", "upper")]
    return MPA * np.concatenate(parts, axis=1)


def draw_pieces(frames: Frames) -> Figure:
    """Draw normal and shear stress inside both pieces at the largest shear stress."""
    figure, axes = new_figure(5.2, 2, sharex=True)
    drawn = magnify_pieces(frames, select_last_frames(frames.times), find_contact_window(frames))
    stress = read_stress(frames, "stress")
    index = int(np.argmax(np.abs(stress[..., 3]).max(axis=1)))
    stresses = {"normal stress −σyy": -stress[..., 1], "shear stress τxy": stress[..., 3]}
    for axis, (name, values), colours in zip(axes, stresses.items(), ("Blues", "RdBu_r")):
        top = np.quantile(np.abs(values[index, drawn.is_inside]), 0.995)
        limits = (0, top) if colours == "Blues" else (-top, top)
        cells, show = draw_cells(axis, drawn, values, cmap=colours, clim=limits)
        show(index)
        figure.colorbar(cells, ax=axis, label="MPa", shrink=0.8, aspect=14)
        axis.set_title(f"{name} inside both pieces")
        axis.grid(False)
    axes[0].set_xlabel("")
    axes[1].set_xlabel(f"x [mm]  ({drawn.captions[index].partition(',')[0]})")
    return figure


def draw_film(frames: Frames) -> Figure:
    """Draw two frames of the film of a cycle: upper piece farthest to the left and to the right."""
    figure, axes = new_figure(5.2, 2, sharex=True)
    numbers = select_last_frames(frames.times)
    drawn = magnify_pieces(frames, numbers, find_contact_window(frames))
    stress = read_stress(frames, "von_mises")
    top = np.quantile(stress[:, drawn.is_inside], 0.998)
    slides = frames.blocks["interface"].point_data["holder_slide"][numbers, 0]
    for axis, index in zip(axes, (int(np.argmin(slides)), int(np.argmax(slides)))):
        cells, show = draw_cells(axis, drawn, stress, cmap="viridis", clim=(0, top))
        show(index)
        figure.colorbar(cells, ax=axis, label="von Mises [MPa]", shrink=0.8, aspect=14)
        axis.set_title(
            f"frame {index + 1} of {len(slides)}: upper piece at {slides[index] * UM:.1f} um"
        )
        axis.grid(False)
    axes[0].set_xlabel("")
    axes[1].set_xlabel(f"x [mm]  (slide{drawn.captions[0].partition('um')[2]})")
    return figure


def draw_sweep(swept) -> Figure:
    """Draw how far the tilt changes amplitude, loop area and friction force."""
    figure, (axis,) = new_figure(3.4)
    tilt = swept["contact_tilt_angle"].values * 1e3
    measures = {
        "loop_area": "loop area",
        "relative_displacement_amplitude": "amplitude",
        "friction_force_peak": "friction force",
    }
    for (measure, name), colour in zip(measures.items(), (BLUE, ORANGE, GREY)):
        values = swept[measure].values
        axis.plot(tilt, 100 * (values / values[0] - 1), "o-", color=colour, ms=4, label=name)
    axis.axhspan(
        -TILT_LIMIT, TILT_LIMIT, color=BLUE, alpha=0.1, lw=0, label=f"within {TILT_LIMIT:g} %"
    )
    (allowed,) = re.findall(r"[\w.]+ may reach .*? changes by 5 %", swept.attrs["verdict"])
    axis.set(
        xscale="log",
        xlabel="tilt [mrad]",
        ylabel="change [%]",
        title=allowed.replace(" before", "\nbefore"),
    )
    axis.xaxis.set_major_formatter("{x:g}")
    axis.legend(loc="lower left")
    return figure


def draw_comparison(compared: dict, traces: tuple) -> Figure:
    """Draw a part of both traces and what wore off between them."""
    figure, (axis,) = new_figure(3.4)
    (x, before), (_, after) = ((trace[:, 0], trace[:, 1]) for trace in traces)
    start = compared["worn_from_before"]["value"] * MM
    part = (x > start - 0.15) & (x < start + 0.65)
    axis.fill_between(
        x[part],
        before[part],
        np.minimum(before, after)[part],
        color=ORANGE,
        alpha=0.35,
        lw=0,
        label="worn off",
    )
    axis.plot(x[part], before[part], color=GREY, label="before")
    axis.plot(x[part], after[part], color=BLUE, label="after")
    depth = compared["worn_depth_mean"]
    value, low, high = (f"{depth[key] * UM:.3f}" for key in ("value", "low", "high"))
    axis.set(
        xlabel="x [mm]",
        ylabel="height [um]",
        title=f"Worn depth, mean over the trace:\n{value} um ({low} to {high} um)",
    )
    axis.set_ylim(top=1.5 * before[part].max())
    axis.legend(ncols=3, loc="upper center")
    return figure


def figures() -> Iterator[tuple[str, Figure]]:
    """Run the scenes and yield name and figure of every picture."""
    wear = ROOT / "studies/wear"
    with TemporaryDirectory() as place, matplotlib.rc_context(LOOK):
        result = pf.run(ROOT / "studies/rig/rig.toml", say=lambda text: None)
        yield "interface", draw_interface(result)
        yield "loop", draw_loop(result)
        result.save(place)
        frames = read_frames(Path(place) / VTKHDF_FILE)
        yield "pieces", draw_pieces(frames)
        yield "film", draw_film(frames)
        os.chdir(place)  # a sweep writes its folder into the current directory
        yield "sweep", draw_sweep(pf.sweep(pf.new("misalignment")))
        os.chdir(ROOT)
        files = [wear / "before.csv", wear / "after.csv"]
        traces = tuple(np.loadtxt(file, delimiter=",", skiprows=1) for file in files)
        yield "compare", draw_comparison(pf.compare(*files, direction="x"), traces)


def sample(values) -> list:
    """Return a few of the drawn values, in their order, with 6 digits."""
    shown = np.ma.compressed(np.ma.masked_invalid(values))
    places = np.linspace(0, len(shown) - 1, min(SAMPLES, len(shown))).astype(int)
    return [float(f"{value:.6g}") for value in shown[places]]


def read_numbers(figure: Figure) -> dict:
    """Return the texts and samples of the curves and fields that a figure shows."""
    texts = []
    curves = []
    for axis in figure.axes:
        texts += [axis.get_title(), axis.get_xlabel(), axis.get_ylabel()]
        texts += (
            [text.get_text() for text in axis.get_legend().get_texts()] if axis.get_legend() else []
        )
        for line in axis.lines:
            curves += [sample(line.get_xdata()), sample(line.get_ydata())]
        curves += [
            sample(np.sort(cells.get_array()))
            for cells in axis.collections
            if cells.get_array() is not None
        ]
    return {"texts": [text for text in texts if text], "curves": curves}


def relative_difference(old: list, new: list) -> float:
    """Return the largest difference of two curves over the largest absolute value of the first."""
    difference = np.abs(np.subtract(old, new)).max(initial=0)
    return float(difference / max(np.abs(old).max(initial=0), np.finfo(float).tiny))


def find_changes(kept: dict, fresh: dict) -> list[str]:
    """Return what a committed picture shows that a fresh one does not show, as sentences."""
    changes = [
        f'the text "{text}" is no longer shown'
        for text in kept["texts"]
        if text not in fresh["texts"]
    ]
    changes += [f'the text "{text}" is new' for text in fresh["texts"] if text not in kept["texts"]]
    if [len(curve) for curve in kept["curves"]] != [len(curve) for curve in fresh["curves"]]:
        return [*changes, "the number of curves or of their points has changed"]
    largest = max((np.abs(curve).max(initial=0) for curve in kept["curves"]), default=0)
    worst = 0.0
    for old, new in zip(kept["curves"], fresh["curves"]):
        if np.abs([old, new]).max(initial=0) > ROUND_OFF * largest:
            worst = max(worst, relative_difference(old, new))
    if worst > CURVE_TOL:
        changes.append(f"a curve differs by {100 * worst:.2g} % of its largest value")
    return changes


def find_stale(drawn) -> list[str]:
    """Compare fresh figures, pairs of name and figure, with the committed pictures."""
    kept = json.loads((FOLDER / "numbers.json").read_text("utf-8"))
    stale = []
    for name, figure in drawn:
        if name not in kept:
            stale.append(f"{name}.png: it has not been drawn yet")
            continue
        stale += [
            f"{name}.png: {change}" for change in find_changes(kept[name], read_numbers(figure))
        ]
    return stale


def find_foreign() -> list[str]:
    """Return the committed pictures that are not those of numbers.json."""
    kept = json.loads((FOLDER / "numbers.json").read_text("utf-8"))
    files = {path.stem: sha256(path.read_bytes()).hexdigest() for path in FOLDER.glob("*.png")}
    names = sorted(files.keys() | kept.keys())
    return [f"{name}.png" for name in names if files.get(name) != kept.get(name, {}).get("sha256")]


def write_traces(folder: Path) -> None:
    """Write the made-up traces of the README's recipe: a ground surface before and after wear.

    Over the middle half the crests are worn off to 0.4 um above the mean line; both traces have
    noise of 20 nm.
    """
    generator = np.random.default_rng(4)
    x = np.arange(0, 4e-3, 4e-6)
    # amplitude [m], wavelength [m] and phase [rad] of each wave
    waves = [
        (2e-6, 190e-6, 0.3),
        (1.2e-6, 83e-6, 1.1),
        (0.6e-6, 31e-6, 2.0),
    ]
    height = sum(
        amplitude * np.sin(2 * np.pi * x / length + 9e2 * x * phase)
        for amplitude, length, phase in waves
    )
    height = height + np.convolve(generator.standard_normal(x.size), np.ones(8) / 8, "same") * 1e-6
    worn = np.where(abs(x - 2e-3) < 1e-3, np.minimum(height, 0.4e-6), height)
    for name, z in (("before", height), ("after", worn)):
        noisy = z + 2e-8 * generator.standard_normal(x.size)
        np.savetxt(
            folder / f"{name}.csv",
            np.c_[x * MM, noisy * UM],
            "%.3f",
            delimiter=",",
            header="x [mm],z [um]",
            comments="",
        )


def write_all() -> None:
    """Write the made-up traces, every picture and numbers.json; remove all other pictures."""
    write_traces(ROOT / "studies/wear")
    for path in FOLDER.glob("*.png"):
        path.unlink()
    numbers = {}
    for name, figure in figures():
        path = FOLDER / f"{name}.png"
        figure.savefig(path, dpi=DPI, metadata={"Software": None})
        numbers[name] = {"sha256": sha256(path.read_bytes()).hexdigest(), **read_numbers(figure)}
    entries = []
    for name, entry in numbers.items():
        parts = [
            f'    "{key}": {json.dumps(value, ensure_ascii=False)}' for key, value in entry.items()
        ]
        entries.append(f'  "{name}": {{\n' + ",\n".join(parts) + "\n  }")
    (FOLDER / "numbers.json").write_text("{\n" + ",\n".join(entries) + "\n}\n", "utf-8")


def main(words: list[str]) -> int:
    """Draw all pictures, or compare them with --check; return the exit status."""
    if words != ["--check"]:
        write_all()
        return 0
    stale = find_foreign() + find_stale(figures())
    print(f"pictures: {len(stale)} differences from those that are committed")
    if stale:
        print(*stale, sep="\n")
        print(f"draw the pictures anew: python {Path(__file__).relative_to(ROOT)}")
    return int(bool(stale))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
