"""A model's unknowns fitted to recordings, and what that leaves beside noise."""
