"""The terminal app: `app` composes; `screens` show a `View`; `station` makes one in a thread of its own.

What is drawn is worked out as lines of text with roles (`lines`), apart from Textual; `themes` gives roles their looks.
`actions` is the one table of what can be done: keys, help and palette are made from it.
"""
