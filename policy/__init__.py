"""Where each UAV heads and how fast, so that everyone's data stays fresh."""
