"""Time taken: `identification` from log to parameters, `reading` a recording, `bags` of ROS."""
