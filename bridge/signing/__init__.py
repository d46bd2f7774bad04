"""MAVLink 2 signing: only senders with the key are heard.

`key` the key's file, which only its owner can read · `gate` signatures, their times, who is let in · `link` links with
and without a key.
"""
