"""Short runs that repeat one manoeuvre, from rest into one steady push, judged by runs of the same vehicle when sound.

`marks` of a single run, and how far those of accepted runs scatter · `judge` which of the library's effects moved those
of further runs · `answer` for programs and for a crew.
"""
