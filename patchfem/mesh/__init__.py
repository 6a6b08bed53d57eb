"""Meshes of the two pieces: generated tensor grids, files of any mesh tool, rounded ends.

In: sizes and layers, or a file with tagged cells and edges. Out: grids whose interface nodes and materials are known.
`nodal_averages` sums over the cells around a node. Read `tensor` first, then `files`.
"""
