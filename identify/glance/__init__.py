"""Quick looks at a recording, without a fit.

`loss` share of messages missing · `excitation` which coefficients it could identify, `span` of thrust and speed ·
`following` curves against the reference · `raising` whether the feed-forward may be raised, `axis_criteria` by
each axis · `foretold` a dive against the errors foretold for it.
"""
