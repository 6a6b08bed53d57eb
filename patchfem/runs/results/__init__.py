"""What every run hands back.

In: a `Plan` that was run and what its engine found. Out: `Result`, with the meaning of every measure and notes on what
the law and the heat of friction leave out. Read `result` first.
"""
