"""The gap between model and sea: where it lies, which effect causes it, how far it shrinks.

`diagnose` runs it all, in this order: `recording` checks · `filters` the fitted model, with effects that were
`accepted_before` held in it, and masses and dampings that `changed` since · `causes` the search · `remainder` what no
cause explains · `gap` where force is missing · `shrink` how far it shrinks, held out and on a check dive.

The answer: `findings` the causes with their sizes · `feedforward_gain` what the feed-forward gains by each ·
`lateness` of the thrust · `verdict`, with the next dive · `result` the types · `words` its sentences · `accepted` the
model to fly by. `simulators` compares a dive with a simulator's.
"""
