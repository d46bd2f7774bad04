"""The user's side: the command seatrial, the terminal app and the app in a browser.

`cli` finds the verb · `verbs` their sentences and options · `options` those that several verbs share · `commands` what
they do · `app` the terminal app · `web` the app in a browser.

For several verbs: `show` tables, progress, questions, JSON · `files` written by a verb, --report and --figures among
them · `links` the way to a link, or to its hub · `recordings` that a verb names · `parameter_files` that hold a model ·
`accepted_priors` accepted values, for prior and plan · `accept_diagnosis` into a file, `unsent_diagnosis` in none that
was uploaded · `watch_text` a picture as text · `dive_list` for dives and the app, `dive_reading` for dives ·
`flight_recording` for fly · `column_map` of import --map.
"""

import time
from typing import Final

BEGAN_UNIX_S: Final = time.time()
"""When this program began to start: what follows is imported, which takes a quarter of a second and more."""
