"""The terminal app: `app` ties it together; `screens` show a `view`, made by `station` in a thread of its own.

The app in parts: `shell` the base of the others · `recordings` begun and ended · `modes` of the feed-forward.

`drawing`, `curves` lines of text with roles, and braille, apart from Textual · `themes` looks of the roles · `keys` the
table of actions, the keymap, the view-only gate · `desk` state that the screens share · `jobs` the verbs that run ·
`header` the lines on top of every screen · `identification`, `diagnosis` as their verbs left them · `recorder` the
recording, which outlives the app, `recording_news` notices on it · `alarm_notes` alarms as events of a dive ·
`connecting` the ways to a vehicle, `connection` the one in use · `next_step` by the situation, `read_situation` it ·
`key_queue` keys taken one at a time · `terminal` how fast it draws · `crash_trace`.
"""
