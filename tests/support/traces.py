"""Texts of profile files, and pairs of traces before and after a known wear."""

from pathlib import Path

import numpy as np

UM = 1e-6
# Kinds of stored pairs: traces that a laboratory compares. They were made from how instruments work, without knowledge of
# the method that compares them (`surface_pairs.py` in `tests/support` of version 1.11).
KINDS = (
    "unworn",
    "even",
    "wedge",
    "groove",
    "edge",
    "run-in",
    "deposits",
    "dust",
    "dropouts",
    "bent",
    "mirrored",
    "turned",
    "exchanged",
    "elsewhere",
    "scale",
)


def format_trace(x, z, header="x [um],z [um]", delimiter=",", digits=17) -> str:
    """Return a file of two columns whose numbers are already in the units of the header."""
    rows = (f"{a:.{digits}g}{delimiter}{b:.{digits}g}" for a, b in zip(x, z))
    return header + "\n" + "\n".join(rows) + "\n"


def draw_uneven_trace(count=50, seed=3) -> tuple:
    """Return unevenly spaced x and rough z, both in um."""
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.uniform(0.5, 2.0, count)) - 20.0, rng.normal(0.0, 1.5, count)


def write_traces(kind: str, seed: int, folder: Path, names: tuple) -> list:
    """Write both traces of a stored pair as tables in um and return their paths.

    kind, seed: the pair, one of KINDS with seed 41003, "groove" with 30077, 7100 or 7101, or "elsewhere" with 20261133;
    names: of both files, without ending.
    """
    paths = [folder / f"{name}.csv" for name in names]
    with np.load(Path(__file__).with_name("trace_pairs.npz")) as stored:
        for path, side in zip(paths, ("before", "after")):
            # Heights and step are stored in nm.
            heights = stored[f"{kind} {seed} {side}"]
            x = np.arange(heights.size) * stored[f"{kind} {seed} {side} step"]
            path.write_text(format_trace(x / 1000, heights / 1000, digits=9), "utf-8")
    return paths
