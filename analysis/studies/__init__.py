"""Studies: settings times replicates of a model, made by any executor, kept in a folder and read as one table."""
