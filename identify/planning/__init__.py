"""The next dive.

`knowledge` what is known of a vehicle, how well, and what a motion would add · `manoeuvres` what can be dived ·
`limits` of time, space, speed and thrust, and trials · `propose` chooses · `writing` the mission, for a crew and for
`seatrial simulate`.
"""
