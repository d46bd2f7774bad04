"""Short runs that repeat one manoeuvre, from rest into one steady push: what they have in common, and what changed it.

`marks` what a single run shows · `usual` the marks of accepted runs, and how far they scatter · `causes` how the
library's effects move the marks · `judge` which of them moved those of further runs · `answer` what is said of them.
"""
