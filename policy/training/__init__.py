"""Algorithm 1 of the paper: fly, remember, learn; ``policy.training.api.train`` is the way in. Needs torch."""
