"""The robot's agent, and the sectors of a laser scan that it decides on, in plain Python and NumPy: no ROS."""
