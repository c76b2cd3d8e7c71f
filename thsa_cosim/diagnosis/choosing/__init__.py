"""Which candidates the recordings ask for: ``screen`` all, ``score`` the best on held-out recordings, ``gates``."""
