"""Whether a dive bears its model out.

`tracking` errors of a dive, `tracking_curves` against the reference · `raising` whether the feed-forward may be raised,
`axis_criteria` by each axis · `forecast` of the next dive's tracking errors, `against_forecast` a dive held against it.
"""
