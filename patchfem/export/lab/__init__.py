"""Laboratory files: histories and loops of results out, records in, and the structure of a scene for other programs.

Universal files (dataset 58, with units in 164), .mat, and CSV with units. `write` writes, `imported` reads
laboratory files as tables and modes, `structures` writes matrices and friction elements.

Read `write` first.
"""

from ...scene.keys.tables import UNIVERSAL_EXTENSIONS

LAB_FILE_ENDINGS = (*UNIVERSAL_EXTENSIONS, ".mat", ".csv")
