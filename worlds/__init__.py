"""Worlds that robots drive through: floor plans as TOML, surfaces drawn by code, light in photometric units.

``schema``, ``frame``, ``areas`` and ``footprints`` tell what a plan is; ``plan``, ``generate``, ``change`` and
``write`` make plans of files, seeds and other plans, and ``draw`` draws them. ``parts`` builds things; ``lighting``
lights them and looks at parts, never the other way round. ``meter`` stands on ``lighting``, ``build`` on all of these,
``check`` on ``build``.
"""
