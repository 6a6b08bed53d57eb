"""Histories and loops in the formats of laboratories, to compare a run with a measurement.

In: a results folder (of a run or of a fit), or imported records. Out: universal files (dataset 58,
with units in 164), .mat, and CSV with units. `series` reads the content of a folder; the other
modules write.

Read `series` first.
"""

UNIVERSAL = (".uff", ".unv", ".uf", ".58")
ENDINGS = (*UNIVERSAL, ".mat", ".csv")
FIELDS = "fields.vtkhdf"  # name of the file that contains the fields in a results folder
