"""The localiser and its files: views, features, incidence matrix, mixture, chain, maps and logs; never MuJoCo.

Import from the modules: ``refseq.sequence``, ``refseq.localiser``, ``refseq.logs``, ``refseq.mapfile``. Nothing is
imported here, so that a machine that lacks a package can still be asked what it lacks.
"""
