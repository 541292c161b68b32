"""The command line: composes settings, builds the parts, connects them."""
