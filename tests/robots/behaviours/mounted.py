"""Place of the laser on the robot that behaviours are tried on."""

from refseq_bench.robots.mounting import Mounting

ON_THE_ROBUTER = Mounting(ahead=0.25, height=0.35, axle=0.12)
