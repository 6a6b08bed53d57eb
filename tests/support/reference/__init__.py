"""Generated reference pages: they are made from the records that the program reads and from its answers.

Input: tables of a scene, effects, materials, rows of measures, the rules of a scene. Output:
Markdown, written into patchfem/scene by `python tests/support/reference`: README.md (keys),
MEASURES.md, MATERIALS.md, LIMITS.md; and the table of effects in studies/site/theory.md. `tried`
asks the rules which combinations are permitted. Read `keys` first.
"""
