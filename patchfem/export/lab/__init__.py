"""Histories and loops in the formats of laboratories, so that a run lies beside a measurement in any program.

In: a results folder (of a run or of a fit), or records that were imported. Out: universal files (dataset 58 with units
in 164), .mat, CSV with units. `series` says what a folder holds, the others write. Read `series` first.
"""

UNIVERSAL = (".uff", ".unv", ".uf", ".58")
ENDINGS = (*UNIVERSAL, ".mat", ".csv")
FIELDS = "fields.vtkhdf"  # of a results folder, beside its histories
