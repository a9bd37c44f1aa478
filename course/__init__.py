"""What a student imports: a live ROS 2 session inside the notebook's kernel, and the chapter's nodes, agent and figures."""
