"""The physics-informed network: `layout` and `intervals` (a dive on the network's instants), `physics` between two of
them, `network` (weights, and what pulls on them), `noise` levels, `blocks` and `equations` (all weights at once),
`start`, `training`, `drag` (what is missing), `fit`, and `answer` with `estimate`."""
