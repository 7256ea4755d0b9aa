"""How the robot and people move: pure steps on arrays."""

# [m/s^2] greatest acceleration of walkers: 99.9 % of those in the BIWI hotel and Zara recordings, from positions 0.4 s
# apart, are below 2.6 and 1.7.
WALKING_ACCELERATION = 2.5
