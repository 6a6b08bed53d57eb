"""The peer's side of formats.py: runs under the interpreter that has pyNastran, knows nothing of patchfem.

Reads one JSON request per line, answers one JSON line each: pyNastran writes the symmetric matrix of a .npy file as a
DMIG and as two OUTPUT4 files in text, and tells how far what it reads from other OUTPUT4 files is from that matrix.
"""

import json
import sys
from pathlib import Path

import numpy as np


def answer(ask: dict) -> dict:
    """Names of files written in the folder, and largest differences by file."""
    from pyNastran.bdf.cards.dmig import DMIG
    from pyNastran.op4.op4 import OP4, read_op4
    from scipy.sparse import coo_matrix

    folder, K = Path(ask["folder"]), np.load(ask["matrix"])
    columns, rows = np.nonzero(np.triu(K))
    place = [(k // 3 + 1, k % 3 + 1) for k in range(len(K))]
    card = DMIG("KAAX", 6, 2, 0, 0, len(K), [place[k] for k in columns], [place[k] for k in rows],
                K[rows, columns].tolist())
    (folder / "dmig.pch").write_text(card.write_card(size=16))
    for name, matrix in (("dense", K), ("sparse", coo_matrix(K))):
        OP4(debug=False).write_op4(folder / f"{name}.op4", {"KAAX": (6, matrix)}, is_binary=False, precision="double")
    off = {}
    for name in ask["read"]:
        found = read_op4(folder / name, debug=False)["K"].data
        off[name] = float(abs((found.toarray() if hasattr(found, "toarray") else found) - K).max())
    return {"written": ["dmig.pch", "dense.op4", "sparse.op4"], "off": off}


def main() -> None:
    """Say which pyNastran this is, then answer request by request."""
    out, sys.stdout = sys.stdout, sys.stderr  # the library prints what it does
    try:
        import pyNastran
    except ImportError as error:
        print(json.dumps({"missing": str(error)}), file=out, flush=True)
        return
    print(json.dumps({"version": pyNastran.__version__}), file=out, flush=True)
    for line in sys.stdin:
        try:
            found = answer(json.loads(line))
        except (ValueError, ArithmeticError, KeyError, OSError) as error:
            found = {"error": str(error)}
        print(json.dumps(found), file=out, flush=True)


if __name__ == "__main__":
    main()
