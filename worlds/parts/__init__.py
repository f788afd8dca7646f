"""Parts of worlds: things of a plan as geoms, meshes and pictures, without their light."""
