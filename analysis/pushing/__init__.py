"""Box pushing after Kube and Zhang: teams of one to twenty robots, and claims of which each can fail."""
