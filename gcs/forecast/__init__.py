"""Dry runs: what a campaign would score, flown in the world model before any drone takes off."""
