"""Elastic pieces condensed to their interface.

In: tagged meshes and materials. Out: compliance matrices of the interface nodes (normal, tangential, coupled), and
displacement and stress inside for a given interface traction. Plane strain or stress, bilinear or any cells.
`condense` eliminates the inside, `factor`, `fronts` and `dissect` do the linear algebra, `mortar` joins meshes that do
not match, `recovery` goes back inside. Read `elasticity` first, then `condense`.
"""
