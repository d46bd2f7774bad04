"""Control and thrust against the motion.

`controller` used other readings than those recorded · `thrust_response` whether velocity follows thrust · `motors`
reversed or swapped.
"""
