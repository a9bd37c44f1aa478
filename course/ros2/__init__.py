"""The `ros2` command where there is no ROS installation: the verbs of the chapter, with ros2cli's grammar and output."""
