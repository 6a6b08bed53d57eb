"""Reading of scenes: a TOML file becomes a `Scene` in SI units; all mistakes are listed.

In: text of a scene and --set words. Out: `Scene`, frozen tables of SI values with the line of every key.
`keys/` holds the keys and their kinds, `rules/` what excludes or needs what, `text` the resolved scene.
Read `scene` first, then `keys/tables`. README.md in this folder explains every key.
"""
