"""Papers that are reproduced, each in a file or folder: its experiments, claims, figures and page."""
