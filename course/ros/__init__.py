"""The library on ROS 2 below everything else: the graph, messages, packages, parameters, and rclpy's internals."""
