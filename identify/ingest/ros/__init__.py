"""Reads bags of ROS 1 and ROS 2 into streams, without ROS.

`bags` makes the streams · `recorded` topics and messages, whatever the form of the bag, unpacked · `rosbag1`, `mcap`,
`db3` each read one form, all of it that is whole · `definitions` the fields of a message type · `fields` messages to
columns · `thruster_topics` joins the topics of single thrusters.
"""
