"""The peer's side of westergaard_tamaas.py: runs under the interpreter that has Tamaas, knows nothing of patchfem.

Reads one JSON request per line, answers one JSON line each; SI units. One period of the wavy surface
A cos(2 pi x/lambda), its crest in the middle, pressed on a half plane by Tamaas' Polonsky-Keer-Rey solver under a
mean pressure.
"""

import json
import os
import sys
import tempfile
from time import process_time

import numpy as np


def solve(tm, ask: dict, tolerance: float, every: int):
    """(pressure, residual) of one solve; its log is written every `every` iterations."""
    n, length = ask["points"], ask["wavelength"]
    model = tm.Model(tm.model_type.basic_1d, [length], [n])
    model.E, model.nu = ask["material"]
    heights = ask["amplitude"] * np.cos(2 * np.pi * (np.arange(n) - n // 2) / n)
    solver = tm.PolonskyKeerRey(model, heights, tolerance)
    solver.max_iter, solver.dump_freq = 100000, every
    left = solver.solve(ask["mean"])
    if not left <= tolerance:
        raise ArithmeticError(f"the residual {left:.1e} stays above {tolerance:.0e}")
    return np.array(model.traction).ravel(), float(left)


def iterations(tm, ask: dict, tolerance: float) -> int:
    """Lines of the library's own log, caught from the two standard streams of the process."""
    with tempfile.TemporaryFile() as log:
        sys.stderr.flush()
        saved = [os.dup(stream) for stream in (1, 2)]
        for stream in (1, 2):
            os.dup2(log.fileno(), stream)
        tm.set_log_level(tm.LogLevel.info)
        try:
            solve(tm, ask, tolerance, 1)
        finally:
            tm.set_log_level(tm.LogLevel.error)
            for stream, old in zip((1, 2), saved):
                os.dup2(old, stream)
                os.close(old)
        log.seek(0)
        counts = [line.split()[0] for line in log.read().decode(errors="replace").splitlines() if line.split()]
    return max((int(count) for count in counts if count.isdigit()), default=0)


def answer(tm, ask: dict) -> dict:
    """Pressure, CPU seconds from the heights to the pressure, iterations, at one tolerance."""
    start = process_time()
    pressure, left = solve(tm, ask, ask["tolerance"], 10**9)
    seconds = process_time() - start
    count = iterations(tm, ask, ask["tolerance"]) if ask.get("count") else 0
    return {"pressure": pressure.tolist(), "seconds": seconds, "residual": left, "iterations": count}


def main() -> None:
    """Say which Tamaas this is, then answer request by request."""
    try:
        import tamaas as tm
    except ImportError as error:
        print(json.dumps({"missing": str(error)}), flush=True)
        return
    tm.set_log_level(tm.LogLevel.error)
    print(json.dumps({"version": str(tm.__version__)}), flush=True)
    for line in sys.stdin:
        try:
            found = answer(tm, json.loads(line))
        except (RuntimeError, ArithmeticError) as error:
            found = {"error": str(error)}
        print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
