"""FMUs for the tests, built from the C sources in this folder."""
