"""Parameters of a vehicle on the ground; all but `client` without I/O on a link.

`files` parameter files · `sidecar` their provenance · `identified` an identification as parameters · `last_accepted`
the values last taken over · `unfinished` uploads · `meaning` of a parameter's id and value · `float32` single precision
as sent · `plan` which lines change · `plausible` checks before an upload · `wanted` values of a file · `comparison` of
them with a vehicle · `proposal` of an upload or a roll back, for the operator to agree to · `listing` reads all
parameters · `transfer` writes and proves values · `deadline` how long to wait · `upload` plan to outcome, or back ·
`session` reading and upload of one vehicle · `client` the session on a link · `receipt` how an upload ended.
"""
