"""One file a device: `encode` beside a parser whose `feed(data, time_s)` gives samples; no I/O inside.

`samples` holds the types that every device speaks, in the device's own axes and SI units;
`mounting` turns them into the vehicle's axes. Malformed bytes give no sample and are counted
by reason in the parser's `counts`; they never raise.
"""
