"""The live page: a server that shows a running world in a browser and takes controls."""
