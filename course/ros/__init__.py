"""The lowest library for ROS 2: the graph, messages, packages, parameters, and rclpy's internals."""
