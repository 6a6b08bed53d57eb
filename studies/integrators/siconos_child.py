"""Siconos' side of work_precision.py: runs under the interpreter that has it, knows nothing of patchfem.

Reads one JSON request per line (mass, damper, stiffness, start, direction of the friction, its limit, the load, steps,
theta), answers one JSON line each. Moreau-Jean time steps with a relay; the relay acts where its argument is not above
zero, hence the offset, and its bound is an impulse, limit times step.
"""

import json
import sys
from time import process_time

import numpy as np

OFFSET = -1e3


def march(kernel, ask: dict):
    """Integrate with fixed steps; return the slide at every step and the CPU seconds of the steps."""
    matrix = {name: np.array(ask[name], float) for name in ("mass", "damper", "stiffness")}
    n = len(matrix["mass"])
    h = ask["step"]
    row = np.array(ask["row"], float)
    body = kernel.LagrangianLinearTIDS(
        np.array(ask["place"][:n], float), np.zeros(n), matrix["mass"]
    )
    body.setKPtr(matrix["stiffness"])
    body.setCPtr(matrix["damper"])
    body.setFExtPtr(np.zeros(n))
    relation = kernel.LagrangianLinearTIR(row[None, :], np.array([OFFSET]))
    bound = ask["limit"] * h
    touch = kernel.Interaction(kernel.RelayNSL(1, -bound, bound), relation)
    world = kernel.NonSmoothDynamicalSystem(0.0, (ask["steps"] + 10) * h)
    world.insertDynamicalSystem(body)
    world.link(touch, body)
    stepping = kernel.TimeStepping(
        world, kernel.TimeDiscretisation(0.0, h), kernel.MoreauJeanOSI(ask["theta"]), kernel.Relay()
    )
    wave = ask["amplitude"] * np.sin(ask["omega"] * h * np.arange(ask["steps"] + 1))
    load = np.outer(ask["theta"] * wave[1:] + (1 - ask["theta"]) * wave[:-1], ask["load"])
    slide = np.zeros(ask["steps"] + 1)
    outer = body.fExt()
    start = process_time()
    for k in range(ask["steps"]):
        outer[:] = load[k]
        stepping.computeOneStep()
        slide[k + 1] = row @ body.q()
        stepping.nextStep()
    return slide, process_time() - start


def main() -> None:
    """Send the version of Siconos, then answer each request."""
    try:
        import siconos
        import siconos.kernel as kernel
    except ImportError as error:
        print(json.dumps({"missing": str(error)}), flush=True)
        return
    print(json.dumps({"version": str(getattr(siconos, "__version__", "unknown"))}), flush=True)
    for line in sys.stdin:
        ask = json.loads(line)
        try:
            slide, seconds = march(kernel, ask)
            found = {"slide": slide[:: ask["every"]][-ask["last"] :].tolist(), "seconds": seconds}
        except (RuntimeError, ValueError) as error:
            found = {"error": str(error)}
        print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
