"""What goes over a link and into a recording: MAVLink frames, the telemetry contract, files of frames.

`framing` bytes to frames · `readings` the contract, version 1 · `status_codes` texts to the crew, with codes for
programs · `ftp` packets of file transfers · `tlog` recordings, `redaction` what they leave out · `whole_recording`
the complete recording · `segments` of the vehicle's own · `silences` what was not heard · `clock_line` two clocks.
"""
