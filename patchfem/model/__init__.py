"""What a scene means: pieces, gap, law, load, slide, modes, drive and numerical choices, nothing solved.

In: a `Scene`. Out: nouns of the engines. Read `pieces`, `law` and `structure` first.
"""
