"""Pages and files of backbones, fits, costs and several results: equal to their files, short, and made again from them."""

import re
import shutil

import numpy as np
import pytest
import xarray as xr
from command_line import read_json, read_page, run_successfully
from friction_loops import elastic_plastic_force, write_loop
from measured_rows import make_linear_rows, write_rows
from page_data import find_strange_curves, find_wrong_numbers, read_charts, read_figures
from scene_texts import DRIVE, MODE, PLASTIC, POINT
from sweep_tables import read_rows

BENCH = (
    POINT
    + PLASTIC
    + '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "20 Hz"\ncycles = 2\n'
)
BLOCK = POINT + PLASTIC + MODE + DRIVE
STATIC = "friction.static=0.1..0.7"


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Results folders of backbones, of fits to a loop, to a curve and to rows, and of a cost, by name."""
    base = tmp_path_factory.mktemp("studies")
    (base / "bench.toml").write_text(BENCH, "utf-8")
    (base / "block.toml").write_text(BLOCK, "utf-8")
    (base / "linear.toml").write_text(MODE + DRIVE, "utf-8")
    time = np.linspace(0.0, 0.1, 121)
    slide = 10e-6 * np.sin(2 * np.pi * 20 * time)
    force = elastic_plastic_force(slide, 30.0, 2e-6)
    force += 0.3 * np.random.default_rng(1).normal(size=time.size)
    write_loop(base / "loop.csv", time, slide, force, 1 + (time > 0.05))
    write_rows(base, [(*row[:4], "U" * (row[0] == 143)) for row in make_linear_rows()])
    free_mode = (
        "structure.mode.axial.frequency=120 Hz..160 Hz,structure.mode.axial.damping=0.005..0.2"
    )
    commands = {
        "backbone": ("backbone", "block.toml", "--amplitudes", "0.1 um..2.5 um:9"),
        "single backbone": ("backbone", "block.toml", "--amplitudes", "2 um"),
        "loop": (
            *("fit", "bench.toml", "--to", "loop.csv", "--hold", "cycle=2"),
            *("--free", f"{STATIC},friction.bond_length=0.3 um..20 um"),
        ),
        "curve": ("fit", "block.toml", "--to", "backbone/backbone.csv", "--free", STATIC),
        "rows": (
            *("fit", "linear.toml", "--to", "rows.csv", "--free", free_mode),
            *("--hold", "frequency=160 Hz", "--starts", "2"),
        ),
        "cost": ("cost", "bench.toml", "--verbose"),
    }
    for name, (verb, scene, *options) in commands.items():
        paths = [base / word if word.endswith(".csv") else word for word in options]
        if name == "curve":  # the table of a single method
            rows = (base / "backbone/backbone.csv").read_text("utf-8").splitlines()
            kept = [row for row in rows if not row.startswith("quasi-static")]
            (base / "balance.csv").write_text("\n".join(kept), "utf-8")
            paths[1] = base / "balance.csv"
        run_successfully(verb, base / scene, *paths, "-o", base / name, "-q")
    return base


NAMES = ("backbone", "single backbone", "loop", "curve", "rows", "cost")


@pytest.mark.parametrize("name", NAMES)
def test_exact_displayed_numbers_equal_the_files(folders, name):
    """Each measure of a page is that of summary.json, and each point of a chart a number of the netCDF file."""
    page = read_page(folders / name)
    measures = read_json(folders / name / "summary.json")["measures"]
    shown = dict(re.findall(r'<tr id="measure-([^"]+)"><td>.*?</td><td class="v">(.*?)</td>', page))
    assert shown and find_wrong_numbers(shown, measures, 5e-3) == []
    stored = folders / name / ("backbone.nc" if "backbone" in name else "result.nc")
    assert read_charts(page) and find_strange_curves(page, stored) == []


@pytest.mark.parametrize("name", NAMES)
def test_exact_page_is_made_again_from_its_files(folders, name, tmp_path):
    """`report` makes the same bytes from a copy of the folder without its page."""
    shutil.copytree(folders / name, tmp_path / name)
    (tmp_path / name / "report.html").unlink()
    run_successfully("report", tmp_path / name)
    assert read_page(tmp_path / name) == read_page(folders / name)


def test_exact_backbone_files_agree(folders):
    """backbone.csv, backbone.nc and backbone.json hold the same curves, and the band contains the recommended one."""
    folder = folders / "backbone"
    curves = read_json(folder / "backbone.json")["curves"]
    rows = read_rows(folder, "backbone.csv")
    heads = [
        "method",
        "amplitude [m]",
        "frequency [Hz]",
        "frequency_error [Hz]",
        "damping",
        "damping_error",
        "force [N]",
        "force_error [N]",
        "force_frequency [Hz]",
    ]
    assert list(rows[0])[: len(heads)] == heads
    assert "<p>Frequency is " in read_page(folders / "single backbone")
    # the rows of the recommended method come first
    assert rows[0]["method"] == "balance" and rows[-1]["method"] == "quasi-static"
    traces = read_figures(read_page(folder))[0]["data"]
    thin, bold = (trace["line"]["width"] for trace in traces if "name" in trace)
    assert bold > 2 * thin and traces[-1]["name"] == "balance frequency"
    with xr.open_dataset(folder / "backbone.nc") as data:
        for method, curve in curves.items():
            mine = [row for row in rows if row["method"] == method]
            for head in heads[1:]:
                name = head.partition(" ")[0]
                stored = data[f"{method.replace('-', '_')}_{name}"].values
                # No force in phase resonance is found where the damping ratio is near 1; a note says so.
                read = [float(row[head]) if row[head] else None for row in mine]
                assert read == curve[name]
                assert read == [None if np.isnan(value) else value for value in stored.tolist()]
                assert None not in read or "force" in name
        for name in ("frequency", "damping"):
            value = data[f"balance_{name}"]
            assert (data[f"balance_{name}_low"] <= value).all()
            assert (data[f"balance_{name}_high"] >= value).all()


def test_exact_cost_table_agrees_with_json(folders):
    """cost.csv has the columns of the contract, with the numbers of cost.json; the page lists each run."""
    details = read_json(folders / "cost/cost.json")
    rows = read_rows(folders / "cost", "cost.csv")
    assert list(rows[0])[:5] == ["knob", "setting", "seconds", "wall_seconds", "timings"]
    rows_of_convergence = details.pop("convergence")
    assert {row["setting"] for row in rows_of_convergence} == {"steps_per_cycle"}
    runs = [(knob, run) for knob, part in details.items() for run in part["runs"]]
    for row, (knob, run) in zip(rows, runs, strict=True):
        assert (row["knob"], row["setting"]) == (knob, run["label"])
        assert float(row["seconds"]) == run["seconds"]
        errors = {
            name[6:]: float(cell)
            for name, cell in row.items()
            if name.startswith("error_") and cell
        }
        assert errors == run["errors"]
    table = re.search(r"<h2>Runs</h2>.*?</table>", read_page(folders / "cost"), re.S)[0]
    assert table.count("<tr>") == len(runs) + 1


@pytest.mark.parametrize("ending, names", [("png", NAMES), ("svg", NAMES[:1]), ("pdf", NAMES[-1:])])
def test_exact_plot_is_a_picture(folders, tmp_path, ending, names):
    """`write_plot` writes the first chart of an answer in the format of the ending."""
    from patchfem.export import store
    from patchfem.export.charts import axes

    starts = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}
    for name in names:
        path = tmp_path / f"{name}.{ending}"
        axes.write_plot({"": store.read_answer(folders / name)}, path)
        assert path.read_bytes().startswith(starts[ending])
