"""The user's side: the command seatrial, the terminal app and the app in a browser.

`cli` finds the verb · `commands` the verbs · `app` the terminal app · `web` the app in a browser.

For all verbs: `show` tables, progress, questions, JSON · `files` written by a verb · `pages` of --report and --figures
· `links` the way to a link, or to its hub · `recordings` that a verb names · `parameter_files` between identify and
params · `job` a verb as a process, for the app.

For single verbs: `recording` record, and texts for ff · `switching` ff · `watched` watch · `wet_check` doctor ·
`fetched` fetch · `merging` merge and fetch · `dive_list` dives, and the app · `answers` identify, diagnose, batch ·
`accepted` earlier values for diagnose, plan, prior, simulate · `demo` demo.
"""
