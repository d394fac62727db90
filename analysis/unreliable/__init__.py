"""What awareness is worth, and how large δ must be, in teams whose robots fail or sense rarely."""
