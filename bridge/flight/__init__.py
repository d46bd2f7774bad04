"""Manoeuvres that the vehicle flies by itself, within limits that it holds: a lost ground ends them safely.

`limits` of a flight · `pose` by dead reckoning · `transit` to a pose and back · `flight` the state machine · `orders`
on the wire.
"""
