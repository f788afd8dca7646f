"""The localiser and its files: views, features, incidence matrix, mixture, chain, maps and logs; never MuJoCo.

Import from the modules: ``refseq.map.sequence``, ``refseq.map.localiser``, ``refseq.logs``, ``refseq.map.file``.
Nothing is imported here, so that a machine that lacks a package can still be asked what it lacks.
"""
