"""The verbs of the command line, one function each.

In: words of the command line, as typed parameters. Out: the answer on stdout, remarks and progress on stderr, files.
A verb imports what it needs when it is called, so that help and `check` come back at once. `shared` holds the options
and refusals that several verbs have. Read `run` first.
"""
