"""The grader: runs a student's files as ROS 2 programs in a sandbox, talks to them only by ROS, and gives verdicts."""
