"""Manoeuvres that the vehicle flies by itself, within limits that it holds: a lost ground ends them safely.

`limits` of a flight · `course` to a place and back, by dead reckoning · `flight` the state machine · `orders` on the
wire.
"""
