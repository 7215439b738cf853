"""Makes a recorded campaign's decisions again and compares them bit for bit."""
