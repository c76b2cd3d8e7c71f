"""A simulate study: ``files`` it leaves and ``tables`` it prints."""
