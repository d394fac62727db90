"""Online learners: robots that learn while they act, from the rewards in their percept."""
