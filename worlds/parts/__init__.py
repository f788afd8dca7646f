"""What worlds are made of: things of a plan as geoms, meshes and pictures; nothing here knows of light."""
