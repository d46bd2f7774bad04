"""The gap between model and sea: where it lies, which effect causes it, how far it shrinks.

`diagnose` runs it all. Before: `recording` checks · `judged_axes`, `slow_samples`, `nominal` the fitted model ·
`accepted_before` held in it, `changed` since. The gap: `simulation` open loop · `drift` over seconds, noise floor, plain
baseline · `gap` by place and axis.

The causes: `predicted` motion · `innovations`, `witnesses` what filters and other sensors show · `regression` the
dive as linear equations · `candidates` what is tried, `seas` with their periods · `evidence`, `weighing`, `ranking`
what it saves · `requirement` what it must save · `selection` one step, `search` to the end · `shafts` beside which
lag · `confidence` intervals and presence · `form_remainder`, `ambiguity` against others. What is left: `unexplained`, by `generic_forces`, `lines`, `bursts`, and
`slow` forces.

The answer: `held_out`, `shrink`, `shrunk` how far it shrinks · `check_dive` on a further dive, and its
`contradiction` · `findings` the
causes, `verdict`, the next dive · `feedforward_gain` · `result` the types · `wording` sentences, of `cause_words`,
`drift_words` and `gap_words` · `accepted` for the feed-forward · `lateness` of the thrust · `simulator`, `thrust_ratio`,
`against` it, in `against_words`.
"""
