"""The numpy core: every technique on batches of rays."""
