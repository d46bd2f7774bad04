"""The vehicle: its configuration, telemetry and parameters. Runs on a small computer; `python -m bridge` starts it.

`sensors` device bytes to samples · `vehicle` model, controller, feed-forward · `flight` manoeuvres flown alone · `wire`
frames and recordings · `links`, `signing` what carries them · `onboard` the program · `firmware` what is known
of an autopilot's · `ardusub` the companion of one · `simulator` a vehicle that stands in for the sea.

`arrays` number types · `attitude` quaternions, angles and matrices · `clock` the boot clock, dates in names · `files`
other people's files read with care, ours written whole · `locks` between programs · `plain`, `schema` untrusted YAML
and JSON, and dataclasses made of it · `text` text harmless on any screen · `version` the installed version · `reports`
lines of JSON between programs · `command_line` options, and a run until it is stopped · `errors`, `exit_codes` how it
ends.
"""
