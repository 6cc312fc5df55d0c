"""Other people's engines behind the same interface, to compare with. Each needs a package that may be missing."""
