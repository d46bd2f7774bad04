"""The terminal app: `app` ties it together; `screens` show a `View`; `station` makes views in a thread of its own.

Drawings are worked out as lines of text with roles (`lines`), apart from Textual; `themes` gives the roles their
looks. `actions` is the table of all actions, from which keys, help and palette are made.
"""
