"""What the paper's four learned rivals share: how they fly, remember, explore and are kept on disk. Needs torch."""
