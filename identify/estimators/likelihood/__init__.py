"""The method of maximum likelihood, on the filters' innovations.

`axis`, `joint` the likelihood of one axis, of all · `misread_drift` in it · `spikes` left out of it · `priors` of an
axis · `fit` its summit · `scoring` the climb · `intervals` beyond the parabola · `start` a rough fit, for the network
and a diagnosis · `answer` the result.
"""
