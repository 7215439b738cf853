"""The world as learners see it: many campaigns at once on tensors, and single ones behind gymnasium and PettingZoo."""
