"""What a hidden suite is written with: the student's programs while they run, the grader's own ends of ROS 2, and verdicts."""
