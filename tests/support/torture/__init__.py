"""Seeded attacks on the command line: scenes, files, kills and limits, each trial made again by three words.

In: the name of a campaign, a seed and an index. Out: nothing where the program held, else one line that says what it
did, with the command that does it again. A trial passes when every command ends with 0, 2, 3, 4 or 130 and a helpful
line, in time, and when what it left on the disk is whole. Read `trial` first, then `scenes` as the example of a
campaign, then `driver`.
"""
