"""The vehicle: its configuration, telemetry and parameters. Runs on a small computer; `python -m bridge` starts it.

`sensors` device bytes to samples · `vehicle` model, controller, feed-forward · `wire` frames and recordings · `links`,
`signing` what carries them · `onboard` the program · `simulator` a vehicle that stands in for the sea.
"""
