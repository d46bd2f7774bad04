"""Short runs that repeat one manoeuvre, from rest into one steady push, judged by runs of the same vehicle when sound.

`marks` of a single run · `usual` marks of accepted runs, and how far they scatter · `causes` how the library's effects
move the marks · `judge` which of them moved those of further runs · `answer` for programs and for a crew.
"""
