"""The gap between model and sea: where it lies, which effect causes it, how far it shrinks.

`diagnose` runs it all, in this order: `prepared` the dive, `cleaned` of wrong readings, its commands judged by
`holding`, its `nominal_fit` by `filters`, with effects that were `accepted_before` held in it · `causes` the search ·
masses and dampings that `changed` since · `remainder` what no cause explains · `gap` where force is missing · `shrink`
how far it shrinks, held out and on a check dive.

The answer: `findings` the causes with their sizes · `feedforward_gain` what the feed-forward gains by each ·
`lateness` of the thrust · `verdict`, with the next dive · `unjudged` what the recording can't tell · `notes` beside the
verdict · `result` the types · `words` its sentences · `accepted` the model to fly by. `simulators` compares a dive with
a simulator's.
"""
