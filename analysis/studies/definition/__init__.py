"""The definition of a study: its file, axes, samples, points and components, and how two definitions differ."""
