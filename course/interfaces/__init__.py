"""The course's ROS interface packages, and building a student's own `.srv`, `.msg` or `.action` at run time."""
