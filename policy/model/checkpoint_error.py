"""The outcome of a checkpoint that cannot be used."""


class CheckpointError(ValueError):
    """Missing, damaged or of another shape: one line that says which file, what is wrong and how to mend it."""
