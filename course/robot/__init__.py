"""The robot's agent, the sectors of a laser scan that it decides on, and a good driver to learn from: no ROS."""
