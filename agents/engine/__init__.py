"""What stands between a world and its kernels: the records they read, and the loop that calls them."""
