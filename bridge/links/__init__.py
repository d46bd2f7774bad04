"""Links that carry bytes: `link` their interface, `open` by name, `secured` with the option `--sign-key`.

`descriptor` serial ports, pseudo-terminals and TCP · `udp` · `memory` within a process · `reconnecting`
comes back by itself · `addresses` names of links and who reaches them.
"""
