"""Other programs as engines of the work-precision study; each answers from a child process."""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from engine_problems import ALL, KIND, POINT, POINTS, Problem


def cvode(peer, one: Problem, tolerance: float, method: str = "Adams") -> tuple:
    """Integrate a problem by CVODE of SUNDIALS with its root finder; return the slide and the CPU seconds.

    Parameters
    ----------
    peer : Peer
    one : Problem
    tolerance : float
    method : str
    """
    found = peer.ask(
        problem=KIND[one.name],
        numbers=one.numbers,
        tolerance=tolerance,
        scale=one.size,
        method=method,
        longest=one.longest,
        times=one.times.tolist(),
    )
    return np.array(found["slide"]), found["seconds"]


MATRICES = {
    "decay": {
        "mass": [[1.0]],
        "damper": [[0.0]],
        "stiffness": [[1.0]],
        "row": [1.0],
        "load": [-1.0],
    },
    "block": {
        "mass": [[1.0]],
        "damper": [[0.006]],
        "stiffness": [[1.0]],
        "row": [1.0],
        "load": [-1.0],
    },
    "two": {
        "mass": [[1.0, 0.0], [0.0, 1.0]],
        "damper": [[0.0, 0.0], [0.0, 0.0]],
        "stiffness": [[1.0, -1.0], [-1.0, 1.0]],
        "row": [0.0, 1.0],
        "load": [1.0, 0.0],
    },
}


def siconos(peer, one: Problem, steps: int, theta: float = 0.5) -> tuple:
    """Integrate a problem by Moreau-Jean steps of Siconos with a relay law; return the slide and the CPU seconds.

    Parameters
    ----------
    peer : Peer
    one : Problem
    steps : int
        Steps per cycle.
    theta : float
    """
    found = peer.ask(
        **MATRICES[one.name],
        limit=one.limit,
        amplitude=1.0 if one.start is None else 0.0,
        omega=2 * np.pi / one.drive.period,
        place=[0.0, 0.0] if one.start is None else [11.5],
        step=one.drive.period / steps,
        steps=one.cycles * steps,
        theta=theta,
        every=steps // POINTS,
        last=one.last * POINTS,
    )
    return np.array(found["slide"]), found["seconds"]


# {name: (callable, accuracy settings, problems, script, variable of its interpreter, remedy)}
PEERS = {
    "SUNDIALS CVODE": (
        cvode,
        (1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12),
        ALL,
        "integrators/sundials_child.py",
        "PATCHFEM_SUNDIALS_PYTHON",
        "pip install scikit-sundae",
    ),
    "Siconos, theta 1/2": (
        siconos,
        (100, 200, 400, 1000, 4000),
        POINT,
        "integrators/siconos_child.py",
        "PATCHFEM_SICONOS_PYTHON",
        "apt install python3-siconos",
    ),
}
