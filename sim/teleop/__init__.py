"""Familiarisation by hand (card R5): somebody at the controls leads the robot, and views are taken on the way.

``orders`` says what can be asked for, ``sitting`` does it; what asks is a script (``script``), the keys of a viewer
(``keys``, ``window``) or a gamepad (``gamepad``).
"""
