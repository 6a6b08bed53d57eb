"""Table 1 and its rungs: `ladder.svg` draws every cell that was read beside what four rungs of the ladder compute, all
fitted to 143 Hz alone.

Run: python studies/table_1/picture.py
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import BLUE, GREY, ORANGE, drawing
from fitting import read_records
from rungs import FOLDER, ROOT2, STUCK_READING, TABLE
from study_run import run_study

from patchfem.campaigns.rows.cells import read_response_table
from patchfem.core import G_N

MIL = 25.4e-6
SHOWN_MODELS = {  # {(model, kind of reading): (name, colour, line style)}
    ("rigid Coulomb", "peak"): ("rigid Coulomb", GREY, ":"),
    ("spring and yaw", ROOT2): ("spring and yaw, √2 × fundamental", BLUE, "-"),
    ("path of Fig. 27", STUCK_READING): ("path of Fig. 27, 1.24 × peak", ORANGE, "-"),
    ("grooves, lift and yaw", "fundamental x gain"): (
        "grooves with lift and yaw, gain × fundamental",
        "#2f7d4f",
        "--",
    ),
}
FREQUENCIES = (135.0, 143.0, 150.0, 155.0)


def main(path: Path = FOLDER / "ladder.svg") -> Path:
    """Draw accelerations at four frequencies and displacements at the two frequencies where a gauge worked.

    Return the path of the file.
    """
    rows = read_records()
    cells = read_response_table(TABLE)
    with drawing(path, (9.6, 5.4), 2, 4, sharex=True) as (figure, axes):
        for panel, frequency in zip(axes[0], FREQUENCIES):
            _panel(panel, rows, cells, frequency, 0, G_N)
            panel.set(
                title=f"{frequency:.0f} Hz", ylim=(0, 16), xlim=(3.7, 8.3), xticks=(4, 5, 6, 7, 8)
            )
        for panel, frequency in zip(axes[1], FREQUENCIES[:2]):
            _panel(panel, rows, cells, frequency, 1, MIL)
            panel.set(ylim=(0, 0.9), xlabel="input [g]")
        axes[0, 0].set_ylabel("acceleration [g]")
        axes[1, 0].set_ylabel("displacement [mil]")
        for panel in axes[1, 2:]:
            panel.set_axis_off()
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(
            handles,
            labels,
            loc="center",
            bbox_to_anchor=(0.74, 0.26),
            frameon=False,
            title="fitted to 143 Hz alone",
        )
    return path


def _panel(panel, rows: dict, cells, frequency: float, what: int, unit: float) -> None:
    at = cells.conditions[:, 0] == frequency
    level = cells.conditions[at, 1] / G_N
    for key, (name, colour, line) in SHOWN_MODELS.items():
        row = rows.get((*key, "143", ""))
        if row is not None:
            values = np.array([np.nan if one is None else one for one in row["cells"][what]])
            panel.plot(level, values[at], line, color=colour, lw=1.6, label=name)
    here = at[cells.condition] & (cells.is_acceleration if what == 0 else ~cells.is_acceleration)
    for flagged, mark, name in (
        (False, "o", "measured"),
        (True, "s", "measured, flagged unstable"),
    ):
        some = here & (cells.unstable == flagged)
        panel.plot(
            cells.conditions[cells.condition[some], 1] / G_N,
            cells.measured[some] / unit,
            mark,
            ms=4.5,
            color="black",
            mfc="none" if flagged else "black",
            label=name,
        )


if __name__ == "__main__":
    run_study(main)
