"""A TOML file becomes a `Scene` in SI units, every mistake named at once with its line.

In: text of a scene and --set words. Out: `Scene`, frozen tables of SI values with the line of every key.
`keys/` holds the keys and their kinds, `rules/` what excludes or needs what, `text` the resolved scene.
Read `scene` first, then `keys/tables`. What every key means stands in README.md beside them.
"""
