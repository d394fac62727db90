"""Style of pictures, surface plots and Markdown tables."""
