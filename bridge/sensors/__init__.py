"""Sensor drivers, one file per device: a function that encodes and a parser whose `feed(data, time_s)` returns samples.

`waterlink`, `wayfinder` DVL · `xsens` IMU · `kvh1750`, `kvh1760` fibre-optic gyros · `bar30` pressure · `ublox` GNSS ·
`esc` shaft speed · `drivers` the driver of each device · `samples` sample types, in the device's own axes and SI units
· `mounting` turns them into the vehicle's axes · `streams` frames in bytes, a device's counter to time of arrival.

The drivers do no I/O. Malformed bytes give no sample and raise nothing.
"""
