"""What could be missing, and where: effects, slots, candidates, and the model with all of them (the superset)."""
