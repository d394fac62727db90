"""When and by which policy the robots of a group decide."""
