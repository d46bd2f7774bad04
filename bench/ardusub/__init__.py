"""The companion beside the real ArduSub, the simulated BlueROV2 as its body: dives recorded, identified and diagnosed.

`firmware` the autopilot as a process, in step with the body · `flight` a plan flown by sticks and recorded by the
companion · `planned` a plan that the companion flies, against laps by hand · `following` how well each way to fly
follows the sticks · `page` what is planted, and the tables.
"""
