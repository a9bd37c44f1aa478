"""The ground floor: waiting, files replaced as a whole, processes, folders, and reading what anybody may have made."""
