"""Whether a dive bears its model out.

`raising` whether the feed-forward may be raised, `axis_criteria` by each axis · `tracking_curves` against the
reference · `forecast` of the next dive's tracking errors, `against_forecast` a dive held against it.
"""
