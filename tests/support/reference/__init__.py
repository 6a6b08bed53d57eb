"""Pages for readers, generated from the records that the program itself reads and from what it answers.

In: tables of a scene, effects, materials, rows of measures, the rules of a scene. Out: Markdown, written into
patchfem/scene by `python tests/support/reference`: README.md (keys), MEASURES.md, MATERIALS.md, LIMITS.md; and the
table of effects in studies/site/theory.md. `tried` asks the rules what stands together. Read `keys` first.
"""
