"""Teleoperation (familiarisation by hand, card R5): a person leads the robot, and views are taken on the way.

``commands`` says what can be asked for, ``session`` does it; a script (``script``), the keys of a viewer (``keys``,
``viewer``) or a gamepad (``gamepad``) asks.
"""
