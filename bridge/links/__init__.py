"""Links that carry bytes: `link` their interface, and a link within a process · `open` by name · `secured` with the
option `--sign-key`.

`descriptor` serial ports, pseudo-terminals and TCP · `udp` · `reconnecting` comes back by itself · `addresses` names of
links and who reaches them.
"""
