"""The terminal app: `app` ties it together; `screens` show a `view`, which `station` makes in a thread of its own.

drawing, curves    lines of text with roles, and braille, apart from Textual
themes, keys       the looks of the roles; the table of actions, the keymap and the view-only gate
desk, jobs         what the screens share, and the verbs that run
view, header       the state at one instant, and the lines on top of every screen
station, recorder  the link, and the recording that outlives the app
terminal, in_turn  how fast the terminal draws, how the app dies; keys one after the other
"""
