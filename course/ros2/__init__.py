"""The `ros2` command without a ROS installation: the chapter's verbs, with the grammar and output of ros2cli."""
