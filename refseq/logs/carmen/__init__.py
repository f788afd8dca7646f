"""CARMEN text logs, plain or compressed: one message a line, fields apart by spaces, metres, radians and seconds.

Read are one laser, ODOM, TRUEPOS and PARAM. The laser is the front one (FLASER, ROBOTLASER1, RAWLASER1); in a log that
has none it is the rear one (RLASER, ROBOTLASER2, RAWLASER2), or else the first of RAWLASER3 to 5. Other kinds are
counted and passed over: a view has one scan, an IMU measures no way, and a position without a heading (NMEAGGA) is no
pose. The layouts are those of CARMEN's logger.
"""
