"""The live session: nodes in the notebook's kernel and in processes beside it, and their logs."""
