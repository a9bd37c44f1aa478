"""An exercise's files as ROS 2 packages in a workspace, which `colcon build` builds, here and on a robot."""
