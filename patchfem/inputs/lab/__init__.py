"""Files of a laboratory's instruments, read whatever their channels are called.

In: universal files (datasets 58, 164), .mat files, tables with units. Out: `Records`, channels in SI over one time.
`records` has the nouns and how channels are chosen, the others read one kind of file each. Read `records` first.
"""
