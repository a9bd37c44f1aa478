"""The grader: starts a student's files as ROS 2 programs in a sandbox, speaks only ROS to them, and writes verdicts."""
