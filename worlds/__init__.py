"""Worlds that robots drive through: floor plans as TOML, surfaces drawn by code, light in photometric units."""
