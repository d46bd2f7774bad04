"""The physics-informed network: `layout` of a dive on the network's instants, `physics` between two of them,
`blocks` for its normal equations, `training` of weights and coefficients together, `noise` levels, `estimate`."""
