"""Presets: TOML and profiles, each number with its source."""
