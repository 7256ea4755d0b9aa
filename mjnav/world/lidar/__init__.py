"""The planar lidar: exact ranges from the engine, packets of a turn, and what a real one makes of them."""
