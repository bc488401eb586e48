"""TOML → everything above."""
