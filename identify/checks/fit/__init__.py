"""Doubts about a fit, by subject.

`hardly_this_vehicle` another vehicle, or axes that are mixed up · `at_the_surface` a hull that never went under ·
`loud_noise` of sensors · `unread_speeds` · `thrust_timing` thrust at another time · `missing_forces` of the model.
"""
