"""The companion of an autopilot that runs ArduSub, without I/O: the bridge gives it frames and sends its messages.

`companion` ties the others together · `heard` the autopilot's last words · `settings` the parameters it depends on ·
`handover` who holds the sticks · `mixing` sticks to force and back · `hold` of a velocity · `law` the feed-forward
added to sticks · `steering` a flight's references by sticks · `dvl` the DVL for the autopilot · `applet` the same law
as a script inside the autopilot. Its facts of the autopilot are in `bridge.firmware.ardusub`.
"""
