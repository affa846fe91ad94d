"""The commands of the command line, one function each; `simrail.cli` puts them together."""
