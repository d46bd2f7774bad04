"""Recordings of MAVLink and logs of autopilots.

`tlog`, `dataflash` the readers · `frames` decoded by message id · `messages` of one vehicle on its boot clock ·
`autopilot_log` added to a dive, `turns` on its clock · `autopilot_parameters` in a log. What an autopilot did to its
readings: `low_pass` takes off its filters, `held_pressure`, `step_velocity` date its pressure and its DVL,
`heading_resets` a heading that is set anew. `message_loss` share of messages missing.
"""
