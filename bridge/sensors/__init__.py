"""Sensor drivers, one file per device: an `encode` function and a parser whose `feed(data, time_s)` returns samples.

The files do no I/O. `samples` holds the sample types of all devices, in the device's own axes and SI units;
`mounting` turns them into the vehicle's axes. Malformed bytes give no sample and raise nothing; the parser counts
them by reason in `counts`.
"""
