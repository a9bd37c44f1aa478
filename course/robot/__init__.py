"""The robot's agent and what it sees of a laser scan, in plain Python and NumPy: no ROS."""
