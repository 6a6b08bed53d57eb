"""Patches of one geometry together, as a sweep has them: the meshes that they share.

In: `PatchModel`s that differ in what presses and shapes them. Out: `Meshes` that serve all of them, and what runs of
one patch need not do again (`kept`). Read `meshes`.
"""
