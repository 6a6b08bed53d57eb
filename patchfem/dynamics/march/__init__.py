"""The march in time: modes move exactly under the path-mean friction forces of each step.

In: modes, a drive, laws under their load. Out: histories, extremes, energy ledger. One loop, `loop_kernels`, over the
faces of a rig: one contact under a load that stays or changes (`pressing_kernels`), or elements beside it or in its
place (`faces_kernels`), of which the set-valued ones stop and go inside a step (`stops_kernels`). `instances` makes an
instance of it per contact, set of laws and load. Many cases of bonds behind shear modes march side by side in `lanes`.
Read `march` first, then `instances` and `loop_kernels`.
"""
