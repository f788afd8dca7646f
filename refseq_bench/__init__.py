"""Test bench for robots that find their place along a path: ``worlds``, ``robots``, ``sim`` and ``scenarios``.

The four packages lie beside this folder in a checkout, which links to them here, and in this folder where the bench is
installed: `docs/decisions/0015-one-name.md`. The localiser, ``refseq``, needs none of them.
"""
